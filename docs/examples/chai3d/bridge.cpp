// Joins a live session of cohaptic with the first haptic device that CHAI3D finds: Force Dimension, 3D Systems, Novint and others.
//
// The device is read and driven in a thread of its own. Every force passes the gate of cohaptic_peer.h, with the device's own largest force as the limit.
// Forces come on when the grip has been within 20 mm of the middle for 200 ms, anew after each loss of the device; Ctrl-C switches them off.
//
//     c++ -std=c++11 -O2 -I CHAI3D/src -I CHAI3D/external/Eigen -I CHAI3D/external/glew/include -o bridge bridge.cpp -L CHAI3D/lib -lchai3d ...
//     ./bridge 192.0.2.7:7400 --session 7 --place 2 --key-file session.key
//
// Written for CHAI3D 3.2.0 (www.chai3d.org, licence BSD-3-Clause), and never compiled against CHAI3D: tests use the stand-in in stub/chai3d.h. The parts for
// Windows are in cohaptic_peer.h: Winsock, timeBeginPeriod(1), and the last two milliseconds of each wait in a loop. At the end one line of JSON is printed.

#include "cohaptic_device.hpp"

#include <atomic>
#include <csignal>
#include <cstdio>
#include <stdexcept>

// A device of CHAI3D behind the four members of a cohaptic_device.
class Driven {
  public:
    explicit Driven(chai3d::cGenericHapticDevicePtr device) : m_device(device), m_thread([this] { run(); }) {}
    ~Driven() {
        stop();
        m_thread.join();
    }

    cohaptic_device device() {
        cohaptic_device device;
        device.read = [](void *self, cohaptic_state *state) -> int { return static_cast<Driven *>(self)->read(*state); };
        device.push = [](void *self, const double force[3]) { static_cast<Driven *>(self)->push(force); };
        device.stop = [](void *self) { static_cast<Driven *>(self)->stop(); };
        device.self = this;
        return device;
    }

    // Gives each reading once, so that the gate sees the age of a device that has fallen silent.
    int read(cohaptic_state &state) {
        const std::lock_guard<std::mutex> guard(m_lock);
        if (m_readings == m_taken) return COHAPTIC_READ_NOTHING;
        m_taken = m_readings, state = m_state;
        return m_armed ? COHAPTIC_READ : COHAPTIC_READ_NOT_ARMED;
    }

    void push(const double force[3]) {
        const std::lock_guard<std::mutex> guard(m_lock);
        for (int axis = 0; axis < 3; ++axis) m_force[axis] = force[axis];
        m_pushedAt = cohaptic_now();
    }

    // Any thread, any number of times. Waits until the device has got its zero, at most half a second: a driver may hang.
    void stop() {
        m_stopped = true;
        for (int ms = 0; ms < 500 && !m_off; ++ms) cohaptic_wait_until(cohaptic_now() + 1000000);
    }

  private:
    enum { EVERY = 500000, FORCE_AGE = 50000000, LOST_AFTER = 10000000, ARMED_AFTER = 200000000 }; // ns

    void run() {
        chai3d::cVector3d position, velocity;
        std::int64_t heard_at = COHAPTIC_NEVER, near_since = COHAPTIC_NEVER;
        while (!m_stopped) {
            const std::int64_t now = cohaptic_now();
            double force[3] = {0, 0, 0};
            if (m_device->getPosition(position) && m_device->getLinearVelocity(velocity)) {
                const std::lock_guard<std::mutex> guard(m_lock);
                cohapticFromChai3d(position, m_state.position);
                cohapticFromChai3d(velocity, m_state.velocity);
                const double *const x = m_state.position;
                const bool isNear = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] < 0.020 * 0.020;
                if (heard_at != COHAPTIC_NEVER && now - heard_at > LOST_AFTER) m_armed = false, near_since = COHAPTIC_NEVER;
                if (!isNear) near_since = COHAPTIC_NEVER;
                else if (near_since == COHAPTIC_NEVER) near_since = now;
                m_armed = m_armed || (isNear && now - near_since >= ARMED_AFTER);
                heard_at = now, ++m_readings;
            }
            {
                // A force that nobody renews ends, also if the loop of the peer hangs.
                const std::lock_guard<std::mutex> guard(m_lock);
                if (m_pushedAt != COHAPTIC_NEVER && now - m_pushedAt <= FORCE_AGE) memcpy(force, m_force, sizeof force);
            }
            m_device->setForce(cohapticToChai3d(force));
            cohaptic_wait_until(now + EVERY);
        }
        m_device->setForce(chai3d::cVector3d(0, 0, 0));
        m_off = true;
    }

    chai3d::cGenericHapticDevicePtr m_device;
    std::atomic<bool> m_stopped{false}, m_off{false};
    std::mutex m_lock; // of the members below
    cohaptic_state m_state{};
    double m_force[3] = {0, 0, 0};
    std::int64_t m_pushedAt = COHAPTIC_NEVER;
    unsigned long m_readings = 0, m_taken = 0;
    bool m_armed = false;
    std::thread m_thread; // last: the thread uses all members above
};

static cohaptic_client theClient;

extern "C" void endOnSignal(int) { cohaptic_stop(&theClient); }

static const char *const USAGE =
    "usage: bridge HOST:PORT --session N --place I [option value ...]\n"
    "  --key-file FILE      64 hexadecimal digits; then the session tells axes and peers\n"
    "  --peers 2  --axes 3\n"
    "  --label chai3d       what the session shows: at most 8 printable ASCII characters\n"
    "  --fingerprint HEX    of the scene, which the session prints and compares\n"
    "  --duration S         [until Ctrl-C]\n"
    "  --patience 10        how long to wait for a welcome, s\n"
    "  --force-limit 3      N; never more than the device gives\n"
    "  --object-mass 0.45   of the whole object, kg\n"
    "  --object-damping 0   of each copy, N.s/m\n"
    "  --coupling 3500,5    N/m, N.s/m\n"
    "  --law AP             AP or PD\n"
    "  --coordination 300,5 N/m, N.s/m\n";

static cohaptic_gains gainsOf(const std::string &text) {
    const std::size_t comma = text.find(',');
    if (comma == std::string::npos) throw std::invalid_argument(text + " is not two numbers with a comma");
    cohaptic_gains gains = {std::stod(text), std::stod(text.substr(comma + 1))};
    return gains;
}

// Reads the command line. `door`, `key_file` and `label` of the result point into the command line.
static cohaptic_options parse(int argc, char **argv, double &duration) {
    cohaptic_options options = cohaptic_usual();
    options.session.axes = 3, options.label = "chai3d";
    bool session = false, place = false;
    if (argc < 2) throw std::invalid_argument("HOST:PORT is missing");
    options.door = argv[1];
    for (int i = 2; i < argc; i += 2) {
        const std::string name = argv[i];
        if (i + 1 == argc) throw std::invalid_argument(name + " has no value");
        const std::string value = argv[i + 1];
        if (name == "--session") options.session.number = std::stoull(value), session = true;
        else if (name == "--place") options.session.place = static_cast<std::uint32_t>(std::stoul(value)), place = true;
        else if (name == "--key-file") options.key_file = argv[i + 1];
        else if (name == "--label") options.label = argv[i + 1];
        else if (name == "--fingerprint") options.fingerprint = std::stoull(value, nullptr, 16);
        else if (name == "--peers") options.session.peers = static_cast<std::uint32_t>(std::stoul(value));
        else if (name == "--axes") options.session.axes = static_cast<std::uint8_t>(std::stoul(value));
        else if (name == "--duration") duration = std::stod(value);
        else if (name == "--patience") options.patience = std::stod(value);
        else if (name == "--force-limit") options.force_limit = std::stod(value);
        else if (name == "--object-mass") options.scene.object_mass = std::stod(value);
        else if (name == "--object-damping") options.scene.object_damping = std::stod(value);
        else if (name == "--coupling") options.scene.coupling = gainsOf(value);
        else if (name == "--coordination") options.scene.coordination = gainsOf(value);
        else if (name == "--law" && value == "AP") options.scene.law = COHAPTIC_AVERAGE_POSITION;
        else if (name == "--law" && value == "PD") options.scene.law = COHAPTIC_PROPORTIONAL_DERIVATIVE;
        else throw std::invalid_argument("there is no " + name + " " + value);
    }
    if (!session || !place) throw std::invalid_argument("--session and --place are needed");
    return options;
}

// Finds and opens the first device, and lowers the limit of force to that of the device.
static chai3d::cGenericHapticDevicePtr opened(cohaptic_options &options) {
    chai3d::cHapticDeviceHandler handler;
    chai3d::cGenericHapticDevicePtr device;
    if (handler.getNumDevices() == 0 || !handler.getDevice(device, 0) || !device) throw std::runtime_error("CHAI3D finds no haptic device");
    const chai3d::cHapticDeviceInfo facts = device->getSpecifications();
    if (!device->open()) throw std::runtime_error(facts.m_modelName + " cannot be opened: does another program use the device?");
    device->calibrate();
    options.force_limit = std::fmin(options.force_limit, facts.m_maxLinearForce);
    if (options.scene.coupling.stiffness > facts.m_maxLinearStiffness) {
        std::fprintf(stderr, "bridge: the coupling of %g N/m is stiffer than the %g N/m that CHAI3D gives for %s at 1 kHz: expect buzzing\n",
                     options.scene.coupling.stiffness, facts.m_maxLinearStiffness, facts.m_modelName.c_str());
    }
    return device;
}

int main(int argc, char **argv) {
    double duration = INFINITY;
    cohaptic_options options;
    try {
        options = parse(argc, argv, duration);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "bridge: %s\n%s", error.what(), USAGE);
        return 2;
    }
    chai3d::cGenericHapticDevicePtr device;
    int status = 0;
    try {
        device = opened(options);
        std::signal(SIGINT, endOnSignal);
        std::signal(SIGTERM, endOnSignal);
        Driven driven(device);
        const cohaptic_device members = driven.device();
        const char *error = cohaptic_open(&theClient, &options);
        if (!error) error = cohaptic_run(&theClient, &members, duration);
        if (error) throw std::runtime_error(error);
        cohaptic_print_summary(&theClient, nullptr);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "bridge: %s\n", error.what());
        status = 1;
    }
    cohaptic_close(&theClient);
    if (device) device->close();
    return status;
}
