// A haptic device for programs on CHAI3D: the copy of the shared object of a live session of cohaptic.
//
// The program is the hand. This device gives the position of the peer's copy for the position of a grip, and the force that the program sends pushes the copy
// until the next force, for 50 ms at most. The other peers feel the copy through the session, over the links of the scene.
//
//     cohaptic_options options = cohaptic_usual();
//     options.door = "127.0.0.1:7400", options.session.number = 7, options.session.place = 2, options.session.peers = 3, options.session.axes = 3;
//     std::shared_ptr<cCohapticDevice> device = cCohapticDevice::create(options);
//     if (!device->open()) std::cerr << device->error() << std::endl;
//
// In the scene the peer has `kind = "udp"` and `contact = "none"`. A program that holds the copy by a spring K [N/m] and a damper B [N.s/m] at the tick h is
// stable if B + BT > (K + KT)*h/2 and B + BT < 2*M/h, with the copy's mass M (docs/own-device.md); a slower program bears less.
//
// Written for CHAI3D 3.2.0 (www.chai3d.org, licence BSD-3-Clause), and never compiled against CHAI3D: tests use the stand-in in stub/chai3d.h.
#pragma once

#include "../cohaptic_peer.h"

#include "chai3d.h"

#include <cmath>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

// CHAI3D: x to the operator, y to the right, z up. cohaptic: x to the right, y up, z to the operator.
inline chai3d::cVector3d cohapticToChai3d(const double ours[3]) { return chai3d::cVector3d(ours[2], ours[0], ours[1]); }
inline void cohapticFromChai3d(const chai3d::cVector3d &theirs, double ours[3]) { ours[0] = theirs.y(), ours[1] = theirs.z(), ours[2] = theirs.x(); }

class cCohapticDevice : public chai3d::cGenericHapticDevice {
  public:
    explicit cCohapticDevice(const cohaptic_options &options) : m_options(options), m_door(options.door), m_keyFile(options.key_file ? options.key_file : "") {
        // No device of its own holds the copy: the forces of the program are all that acts on it beside the coordination.
        m_options.scene.coupling.stiffness = m_options.scene.coupling.damping = 0;
        m_label = options.label ? options.label : "chai3d";
        m_options.label = m_label.c_str();
        m_deviceAvailable = true;
        m_specifications.m_model = chai3d::C_HAPTIC_DEVICE_CUSTOM;
        m_specifications.m_modelName = "cohaptic";
        m_specifications.m_manufacturerName = "cohaptic";
        m_specifications.m_maxLinearForce = options.force_limit;
        m_specifications.m_workspaceRadius = 0.1;
        m_specifications.m_sensedPosition = m_specifications.m_actuatedPosition = true;
        setStiffness();
    }
    ~cCohapticDevice() override { close(); }
    cCohapticDevice(const cCohapticDevice &) = delete;
    cCohapticDevice &operator=(const cCohapticDevice &) = delete;

    static std::shared_ptr<cCohapticDevice> create(const cohaptic_options &options) { return std::make_shared<cCohapticDevice>(options); }

    // Joins the session. C_ERROR leaves a sentence in error().
    bool open() override {
        if (m_thread.joinable()) return chai3d::C_SUCCESS;
        m_options.door = m_door.c_str(), m_options.key_file = m_keyFile.empty() ? nullptr : m_keyFile.c_str();
        const char *const error = cohaptic_open(&m_client, &m_options);
        if (error) {
            m_error = error;
            cohaptic_close(&m_client);
            return chai3d::C_ERROR;
        }
        // Forces of a program may change at any rate, because nobody holds the copy in a hand. Size, age and pauses are checked as for any device.
        m_client.gate.limits.slew = 1e6;
        m_options.session = m_client.peer.session;
        setStiffness();
        m_state = m_client.peer.copy, m_setpointAt = COHAPTIC_NEVER, m_error.clear();
        m_deviceReady = true;
        m_thread = std::thread([this] { run(); });
        return chai3d::C_SUCCESS;
    }

    bool close() override {
        if (!m_thread.joinable()) return chai3d::C_ERROR;
        cohaptic_stop(&m_client);
        m_thread.join();
        cohaptic_close(&m_client);
        m_deviceReady = false;
        return chai3d::C_SUCCESS;
    }

    bool calibrate(bool = false) override { return isTakingPart(); }

    bool getPosition(chai3d::cVector3d &position) override {
        const std::lock_guard<std::mutex> guard(m_lock);
        position = cohapticToChai3d(m_state.position);
        return m_deviceReady && m_error.empty();
    }

    bool getLinearVelocity(chai3d::cVector3d &velocity) override {
        const std::lock_guard<std::mutex> guard(m_lock);
        velocity = cohapticToChai3d(m_state.velocity);
        return m_deviceReady && m_error.empty();
    }

    // setForce() and setForceAndTorque() of the base end here. Torques and grippers have no meaning for the copy.
    bool setForceAndTorqueAndGripperForce(const chai3d::cVector3d &force, const chai3d::cVector3d &, const double) override {
        const std::lock_guard<std::mutex> guard(m_lock);
        cohapticFromChai3d(force, m_setpoint);
        m_setpointAt = cohaptic_now();
        return m_deviceReady && m_error.empty();
    }

    // Returns the reason why the session was not joined, or why the device has left the session. Empty while all is well.
    std::string error() {
        const std::lock_guard<std::mutex> guard(m_lock);
        return m_error;
    }

  private:
    bool isTakingPart() {
        const std::lock_guard<std::mutex> guard(m_lock);
        return m_deviceReady && m_error.empty();
    }

    // A fifth of the stiffness that a program without damping may have if it answers at every tick: 2*BT/h - KT.
    void setStiffness() {
        const cohaptic_scene &scene = m_options.scene;
        const double share = scene.law == COHAPTIC_PROPORTIONAL_DERIVATIVE ? m_options.session.peers - 1.0 : 1;
        const double most = share * (2e9 * scene.coordination.damping / static_cast<double>(m_options.session.tick_ns) - scene.coordination.stiffness);
        m_specifications.m_maxLinearStiffness = std::fmax(0, most / 5);
    }

    void run() {
        cohaptic_peer &peer = m_client.peer;
        const std::int64_t began = cohaptic_now();
        double push[3];
        for (std::uint64_t k = 0; !COHAPTIC_IS_SET(m_client.gate.stopped); ++k) {
            cohaptic_wait_until(began + static_cast<std::int64_t>(k * peer.session.tick_ns));
            cohaptic_exchange(&m_client, k);
            const std::lock_guard<std::mutex> guard(m_lock);
            cohaptic_moment moment;
            moment.now = moment.reading_at = cohaptic_now(), moment.ready = moment.armed = 1, moment.setpoint_at = m_setpointAt;
            cohaptic_gate_admit(&m_client.gate, m_setpoint, &moment, push);
            cohaptic_peer_tick(&peer, k, nullptr, push);
            m_client.ticks = k + 1;
            m_state = peer.copy;
            if (const char *const error = cohaptic_fault(&m_client)) {
                m_error = error;
                return;
            }
        }
    }

    cohaptic_options m_options;
    const std::string m_door, m_keyFile;
    std::string m_label;
    cohaptic_client m_client{};
    std::thread m_thread;
    std::mutex m_lock; // of the members below
    cohaptic_state m_state{};
    double m_setpoint[3] = {0, 0, 0};
    std::int64_t m_setpointAt = COHAPTIC_NEVER;
    std::string m_error;
};
