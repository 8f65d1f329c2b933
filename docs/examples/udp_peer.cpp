// A peer of a live session that simulates its device: the smallest program on cohaptic_peer.h, which has protocol, copy and coordination.
//
// The simulated device is a damped mass under a constant force of a hand. With --inertia the object turns, and the device grasps it at --grasp. Every
// tick is written out here, because a simulated device needs no gate; a device in somebody's hand belongs into cohaptic_run(), as docs/own-device.md
// shows. C++11 and sockets, nothing else. The protocol is in docs/live-protocol.md, the equations are in docs/model.md and docs/rotation.md.
//
//     c++ -O2 -Wall -Wextra -o udp_peer udp_peer.cpp
//     ./udp_peer 127.0.0.1:7000 --session 42 --place 1 --peers 3 --force 0.5 --duration 5
//
// At the end it prints one line of JSON. SI units everywhere.

#include "cohaptic_peer.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>

struct Options {
    cohaptic_options peer = cohaptic_usual();
    std::string door, key_file;
    double duration = 10, force = 0, force_for = std::numeric_limits<double>::infinity();
    double device_mass = 0.1, device_damping = 5;
};

// The device is a damped mass, and moves as the copy does.
static void run(cohaptic_client &client, const Options &options) {
    cohaptic_peer &peer = client.peer;
    const double tick_ns = static_cast<double>(peer.session.tick_ns);
    const std::uint64_t ticks = static_cast<std::uint64_t>(std::llround(options.duration * 1e9 / tick_ns));
    const cohaptic_step step = cohaptic_step_of(options.device_mass, options.device_damping, peer.h);
    const std::int64_t began = cohaptic_now();
    cohaptic_state device = peer.reading;
    for (std::uint64_t k = 0; k < ticks; ++k) {
        // A late tick is made up for, so that the time of the peer never falls behind for good.
        cohaptic_wait_until(began + static_cast<std::int64_t>(k * peer.session.tick_ns));
        cohaptic_exchange(&client, k);
        cohaptic_peer_tick(&peer, k, &device, nullptr);
        client.ticks = k + 1;
        for (int axis = 0; axis < peer.session.axes; ++axis) {
            const bool pushes = axis == 0 && 1e-9 * static_cast<double>(k) * tick_ns < options.force_for;
            cohaptic_move(&step, &device, axis, (pushes ? options.force : 0) + peer.on_hand[axis]);
        }
        if (const char *error = cohaptic_fault(&client)) throw std::runtime_error(error);
    }
    cohaptic_print_summary(&client, &device);
}

static const char *const USAGE =
    "usage: udp_peer HOST:PORT --session N --place I [option value ...]\n"
    "  --key-file FILE      64 hexadecimal digits; then the session tells axes, peers and periods\n"
    "  --axes 1  --peers 2  --tick-ms 1  --update-ms 8\n"
    "  --duration 10        s\n"
    "  --patience 10        how long to wait for a welcome, s\n"
    "  --force 0            of the hand, along x, N\n"
    "  --force-for S        how long the hand pushes, s [always]\n"
    "  --object-mass 0.45   of the whole object; each copy has its share, kg\n"
    "  --object-damping 0   of each copy, N·s/m\n"
    "  --inertia X,Y,Z      of the whole object, about its own axes: it turns, kg·m² [it does not]\n"
    "  --grasp 0,0,0        from its centre, in its own axes, m\n"
    "  --device-mass 0.1    kg\n"
    "  --device-damping 5   N·s/m\n"
    "  --coupling 3500,5    N/m, N·s/m\n"
    "  --law AP             AP or PD\n"
    "  --coordination 300,5 N/m, N·s/m\n"
    "  --exchange-every 1   ticks from one exchange with the device to the next\n"
    "  --exchange-age 0     1 if the device is read one exchange late\n";

// Reads `count` numbers with commas between.
static void numbers(const std::string &name, const std::string &text, double *out, int count) {
    std::size_t at = 0;
    for (int i = 0; i < count; ++i) {
        if (i > 0 && (at = text.find(',', at) + 1) == 0) throw std::invalid_argument(name + " needs " + std::to_string(count) + " numbers");
        out[i] = std::stod(text.substr(at));
    }
}

static Options parse(int argc, char **argv) {
    Options options;
    cohaptic_session &told = options.peer.session;
    cohaptic_scene &scene = options.peer.scene;
    if (argc < 2) throw std::invalid_argument("HOST:PORT is missing");
    options.door = argv[1];
    bool session = false, place = false;
    for (int i = 2; i < argc; i += 2) {
        const std::string name = argv[i];
        if (i + 1 == argc) throw std::invalid_argument(name + " has no value");
        const std::string value = argv[i + 1];
        const auto number = [&] { return std::stod(value); };
        const auto whole = [&] { return std::stoull(value); };
        const auto nanos = [&] { return static_cast<std::uint64_t>(std::llround(1e6 * std::stod(value))); };
        const auto gains = [&] {
            double pair[2];
            numbers(name, value, pair, 2);
            return cohaptic_gains{pair[0], pair[1]};
        };
        if (name == "--session") told.number = whole(), session = true;
        else if (name == "--place") told.place = static_cast<std::uint32_t>(whole()), place = true;
        else if (name == "--key-file") options.key_file = value;
        else if (name == "--axes") told.axes = static_cast<std::uint8_t>(whole());
        else if (name == "--peers") told.peers = static_cast<std::uint32_t>(whole());
        else if (name == "--tick-ms") told.tick_ns = nanos();
        else if (name == "--update-ms") told.update_ns = nanos();
        else if (name == "--duration") options.duration = number();
        else if (name == "--patience") options.peer.patience = number();
        else if (name == "--force") options.force = number();
        else if (name == "--force-for") options.force_for = number();
        else if (name == "--object-mass") scene.object_mass = number();
        else if (name == "--object-damping") scene.object_damping = number();
        else if (name == "--device-mass") options.device_mass = number();
        else if (name == "--device-damping") options.device_damping = number();
        else if (name == "--coupling") scene.coupling = gains();
        else if (name == "--coordination") scene.coordination = gains();
        else if (name == "--law" && value == "AP") scene.law = COHAPTIC_AVERAGE_POSITION;
        else if (name == "--law" && value == "PD") scene.law = COHAPTIC_PROPORTIONAL_DERIVATIVE;
        else if (name == "--exchange-every") scene.exchange_every = static_cast<std::uint32_t>(whole());
        else if (name == "--exchange-age") scene.exchange_age = static_cast<std::uint8_t>(whole());
        else if (name == "--inertia") numbers(name, value, scene.inertia, 3), told.turns = 1;
        else if (name == "--grasp") numbers(name, value, scene.grasp, 3);
        else throw std::invalid_argument("there is no " + name + " " + value);
    }
    if (!session || !place) throw std::invalid_argument("--session and --place are needed");
    return options;
}

int main(int argc, char **argv) {
    Options options;
    try {
        options = parse(argc, argv);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "udp_peer: %s\n%s", error.what(), USAGE);
        return 2;
    }
    options.peer.door = options.door.c_str();
    if (!options.key_file.empty()) options.peer.key_file = options.key_file.c_str();
    static cohaptic_client client;
    int status = 0;
    try {
        if (const char *error = cohaptic_open(&client, &options.peer)) throw std::runtime_error(error);
        run(client, options);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "udp_peer: %s\n", error.what());
        status = 1;
    }
    cohaptic_close(&client);
    return status;
}
