// A stand-in for "chai3d.h", with which the files of this folder are compiled and tested where CHAI3D is not installed.
//
// It has the signatures of CHAI3D 3.2.0 that are used here and nothing else, written for these tests from the library's public interface. No line is copied
// from CHAI3D (www.chai3d.org, licence BSD-3-Clause), and the files here were never compiled against CHAI3D itself.
#pragma once

#include <chrono>
#include <cmath>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace chai3d {

const bool C_ERROR = false;
const bool C_SUCCESS = true;

struct cVector3d {
    cVector3d() : m_v{0, 0, 0} {}
    cVector3d(double x, double y, double z) : m_v{x, y, z} {}
    double x() const { return m_v[0]; }
    double y() const { return m_v[1]; }
    double z() const { return m_v[2]; }
    void set(double x, double y, double z) { m_v[0] = x, m_v[1] = y, m_v[2] = z; }
    void zero() { set(0, 0, 0); }

  private:
    double m_v[3];
};

enum cHapticDeviceModel { C_HAPTIC_DEVICE_VIRTUAL, C_HAPTIC_DEVICE_CUSTOM };

struct cHapticDeviceInfo {
    cHapticDeviceModel m_model = C_HAPTIC_DEVICE_VIRTUAL;
    std::string m_modelName, m_manufacturerName;
    double m_maxLinearForce = 0, m_maxLinearStiffness = 0, m_maxLinearDamping = 0, m_workspaceRadius = 0;
    bool m_sensedPosition = false, m_actuatedPosition = false;
};

class cGenericDevice {
  public:
    virtual ~cGenericDevice() {}
    virtual bool open() { return C_ERROR; }
    virtual bool close() { return C_ERROR; }
    bool isDeviceAvailable() { return m_deviceAvailable; }
    bool isDeviceReady() { return m_deviceReady; }

  protected:
    bool m_deviceAvailable = false, m_deviceReady = false;
};

class cGenericHapticDevice : public cGenericDevice {
  public:
    explicit cGenericHapticDevice(unsigned int = 0) {}
    virtual bool calibrate(bool = false) { return m_deviceReady; }
    virtual bool getPosition(cVector3d &position) {
        position.zero();
        return m_deviceReady;
    }
    virtual bool getLinearVelocity(cVector3d &velocity) {
        velocity.zero();
        return m_deviceReady;
    }
    // Not virtual: both end in the one function that devices override.
    bool setForce(const cVector3d &force) { return setForceAndTorqueAndGripperForce(force, cVector3d(), 0.0); }
    bool setForceAndTorque(const cVector3d &force, const cVector3d &torque) { return setForceAndTorqueAndGripperForce(force, torque, 0.0); }
    virtual bool setForceAndTorqueAndGripperForce(const cVector3d &, const cVector3d &, const double) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return m_deviceReady;
    }
    cHapticDeviceInfo getSpecifications() { return m_specifications; }
    cHapticDeviceInfo m_specifications;
};

typedef std::shared_ptr<cGenericHapticDevice> cGenericHapticDevicePtr;

// A device of the stand-in: a grip that stays where a test puts it, and that remembers forces.
class cStubDevice : public cGenericHapticDevice {
  public:
    cStubDevice() {
        m_deviceAvailable = true;
        m_specifications.m_model = C_HAPTIC_DEVICE_CUSTOM;
        m_specifications.m_modelName = "stand-in";
        m_specifications.m_maxLinearForce = 8, m_specifications.m_maxLinearStiffness = 5000, m_specifications.m_workspaceRadius = 0.05;
    }
    bool open() override { return m_deviceReady = opens; }
    bool close() override {
        m_deviceReady = false;
        return C_SUCCESS;
    }
    bool getPosition(cVector3d &position) override {
        const std::lock_guard<std::mutex> guard(lock);
        position = at;
        return m_deviceReady && answers;
    }
    bool getLinearVelocity(cVector3d &velocity) override {
        const std::lock_guard<std::mutex> guard(lock);
        velocity = speed;
        return m_deviceReady && answers;
    }
    bool setForceAndTorqueAndGripperForce(const cVector3d &force, const cVector3d &, const double) override {
        const std::lock_guard<std::mutex> guard(lock);
        last = force, ++forces;
        largest = std::fmax(largest, std::sqrt(force.x() * force.x() + force.y() * force.y() + force.z() * force.z()));
        return m_deviceReady;
    }

    std::mutex lock;
    cVector3d at, speed, last;
    double largest = 0;
    unsigned long forces = 0;
    bool opens = true, answers = true;
};

// The device of every handler of the stand-in. A test may take it away.
inline std::shared_ptr<cStubDevice> &stubDevice() {
    static std::shared_ptr<cStubDevice> device = std::make_shared<cStubDevice>();
    return device;
}

class cHapticDeviceHandler {
  public:
    unsigned int getNumDevices() { return stubDevice() ? 1 : 0; }
    bool getDeviceSpecifications(cHapticDeviceInfo &specifications, unsigned int index = 0) {
        if (index >= getNumDevices()) return C_ERROR;
        specifications = stubDevice()->m_specifications;
        return C_SUCCESS;
    }
    bool getDevice(cGenericHapticDevicePtr &device, unsigned int index = 0) {
        if (index >= getNumDevices()) return C_ERROR;
        device = stubDevice();
        return C_SUCCESS;
    }
};

} // namespace chai3d
