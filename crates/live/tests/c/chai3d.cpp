// Tests of docs/examples/chai3d on the stand-in for CHAI3D: axes, arming, the end of forces, and the device for programs.
#define main bridgeMain
#include "bridge.cpp"
#undef main

static int faults = 0;

static void check(bool right, const char *what, int line) {
    if (!right) std::fprintf(stderr, "chai3d.cpp:%d: %s\n", line, what), ++faults;
}
#define CHECK(condition) check((condition), #condition, __LINE__)

static void waitMs(int ms) { cohaptic_wait_until(cohaptic_now() + ms * INT64_C(1000000)); }

// Waits until the condition holds, at most for ten seconds.
template <typename Condition> static bool comes(Condition condition) {
    for (int ms = 0; ms < 10000; ++ms) {
        if (condition()) return true;
        waitMs(1);
    }
    return false;
}

static bool is(const chai3d::cVector3d &v, double x, double y, double z) { return v.x() == x && v.y() == y && v.z() == z; }

static void axes() {
    const double force[3] = {1, 2, 3};
    CHECK(is(cohapticToChai3d(force), 3, 1, 2));
    double ours[3];
    cohapticFromChai3d(chai3d::cVector3d(3, 1, 2), ours);
    CHECK(ours[0] == 1 && ours[1] == 2 && ours[2] == 3);
}

static chai3d::cVector3d lastForce(chai3d::cStubDevice &stub) {
    const std::lock_guard<std::mutex> guard(stub.lock);
    return stub.last;
}

static void place(chai3d::cStubDevice &stub, double x, bool answers) {
    const std::lock_guard<std::mutex> guard(stub.lock);
    stub.at.set(x, 0.002, 0.003), stub.speed.set(0.1, 0.2, 0.3), stub.answers = answers;
}

static void driven() {
    const std::shared_ptr<chai3d::cStubDevice> stub = chai3d::stubDevice();
    const double force[3] = {1, 2, 3};
    stub->open();
    place(*stub, 0.030, true);
    {
        Driven driven(stub);
        const cohaptic_device device = driven.device();
        cohaptic_state state{};
        int read = COHAPTIC_READ_NOTHING;
        const auto reads = [&] {
            const int now = device.read(device.self, &state);
            if (now != COHAPTIC_READ_NOTHING) read = now;
            return now != COHAPTIC_READ_NOTHING;
        };
        // Away from the middle the device is read and never armed.
        CHECK(comes(reads) && state.position[0] == 0.002 && state.position[1] == 0.003 && state.position[2] == 0.030);
        CHECK(state.velocity[0] == 0.2 && state.velocity[1] == 0.3 && state.velocity[2] == 0.1);
        waitMs(300);
        CHECK(comes(reads) && read == COHAPTIC_READ_NOT_ARMED);
        const std::int64_t near_from = cohaptic_now();
        place(*stub, 0.001, true);
        CHECK(comes([&] { return reads() && read == COHAPTIC_READ; }));
        CHECK(cohaptic_now() - near_from >= 200000000);
        // An armed grip may be anywhere.
        place(*stub, 0.050, true);
        CHECK(comes([&] { return reads() && state.position[2] == 0.050; }) && read == COHAPTIC_READ);
        // A device that does not answer gives no readings, and is armed anew.
        place(*stub, 0.050, false);
        CHECK(comes([&] { return !reads(); }));
        waitMs(50);
        CHECK(!reads());
        place(*stub, 0.050, true);
        CHECK(comes(reads) && read == COHAPTIC_READ_NOT_ARMED);
        // The force goes out along CHAI3D's axes, and ends if nobody renews it.
        CHECK(comes([&] {
            device.push(device.self, force);
            return is(lastForce(*stub), 3, 1, 2);
        }));
        CHECK(comes([&] { return is(lastForce(*stub), 0, 0, 0); }));
        device.push(device.self, force);
        std::thread other([&] { device.stop(device.self); });
        device.stop(device.self);
        other.join();
        CHECK(comes([&] { return is(lastForce(*stub), 0, 0, 0); }));
        device.push(device.self, force);
        waitMs(5);
        CHECK(is(lastForce(*stub), 0, 0, 0));
    }
    CHECK(stub->close() == chai3d::C_SUCCESS);
}

static std::string refusal(cohaptic_options options) {
    try {
        opened(options);
    } catch (const std::runtime_error &error) {
        return error.what();
    }
    return std::string();
}

static void limits() {
    cohaptic_options options = cohaptic_usual();
    options.force_limit = 12;
    CHECK(opened(options) == chai3d::stubDevice() && options.force_limit == 8);
    options.force_limit = 2;
    CHECK(opened(options) && options.force_limit == 2);
    chai3d::stubDevice()->opens = false;
    CHECK(refusal(options).find("stand-in cannot be opened") == 0);
    chai3d::stubDevice()->opens = true;
    const std::shared_ptr<chai3d::cStubDevice> stub = chai3d::stubDevice();
    chai3d::stubDevice() = nullptr;
    CHECK(refusal(options) == "CHAI3D finds no haptic device");
    chai3d::stubDevice() = stub;
}

static void deviceOfPrograms() {
    cohaptic_options options = cohaptic_usual();
    options.door = "127.0.0.1:9", options.session.axes = 3;
    options.scene.coordination.stiffness = 500;
    std::shared_ptr<cCohapticDevice> device = cCohapticDevice::create(options);
    CHECK(std::fabs(device->getSpecifications().m_maxLinearStiffness - 9500 / 5) < 1e-9);
    options.scene.coordination.stiffness = options.scene.coordination.damping = 0;
    device = cCohapticDevice::create(options);
    const chai3d::cGenericHapticDevicePtr base = device;
    chai3d::cVector3d position(1, 1, 1), velocity, later;
    CHECK(base->getPosition(position) == chai3d::C_ERROR && base->close() == chai3d::C_ERROR);
    CHECK(base->getSpecifications().m_model == chai3d::C_HAPTIC_DEVICE_CUSTOM && base->getSpecifications().m_maxLinearForce == 3);
    const std::int64_t began = cohaptic_now();
    CHECK(base->open() == chai3d::C_SUCCESS && base->open() == chai3d::C_SUCCESS && device->error().empty());
    // A force to the right of the operator pushes the copy to the right, and ends 50 ms after the last call.
    CHECK(comes([&] { return base->setForce(chai3d::cVector3d(0, 1, 0)) && base->getPosition(position) && position.y() > 0; }));
    const double pushed = 1e-9 * static_cast<double>(cohaptic_now() - began) + 0.060;
    waitMs(200);
    CHECK(base->getLinearVelocity(velocity));
    CHECK(velocity.x() == 0 && velocity.z() == 0 && velocity.y() > 0 && velocity.y() <= pushed / 0.225);
    waitMs(50);
    CHECK(base->getLinearVelocity(later) && is(later, velocity.x(), velocity.y(), velocity.z()));
    // A force that is no number pushes nothing.
    CHECK(base->setForce(chai3d::cVector3d(0, NAN, 0)));
    waitMs(20);
    CHECK(base->getLinearVelocity(later) && is(later, velocity.x(), velocity.y(), velocity.z()));
    CHECK(base->close() == chai3d::C_SUCCESS && base->close() == chai3d::C_ERROR && base->getPosition(position) == chai3d::C_ERROR);
    CHECK(base->open() == chai3d::C_SUCCESS && base->getPosition(position) && is(position, 0, 0, 0));
    options.door = "nowhere";
    device = cCohapticDevice::create(options);
    CHECK(!device->open() && device->error() == "nowhere is no HOST:PORT" && !device->calibrate());
}

int main() {
    axes();
    driven();
    limits();
    deviceOfPrograms();
    return faults != 0;
}
