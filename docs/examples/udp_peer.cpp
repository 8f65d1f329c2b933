// A peer of a live session, complete and small: copy it and put your device into it.
//
// It joins a scene that runs under `cohaptic live`, simulates a haptic device, its own copy of the shared object and average-position coordination at
// 1 kHz, and exchanges samples with the other peers through the session. C++17 and POSIX sockets, nothing else. The protocol is in
// docs/live-protocol.md, the equations are in docs/model.md and, for an object that turns (--inertia), docs/rotation.md.
//
//     c++ -std=c++17 -O2 -Wall -Wextra -o udp_peer udp_peer.cpp
//     ./udp_peer 127.0.0.1:7000 --session 42 --place 1 --peers 3 --force 0.5 --duration 5
//
// At the end it prints one line of JSON. SI units everywhere.

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

using Bytes = std::vector<std::uint8_t>;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

// --- SHA-256 (FIPS 180-4) and HMAC (RFC 2104) --------------------------------------------------------------------------------------------------

using Digest = std::array<std::uint8_t, 32>;

std::uint32_t rotate(std::uint32_t word, int by) { return word >> by | word << (32 - by); }

Digest sha256(Bytes message) {
    static constexpr std::uint32_t K[64] = {
        0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5, 0xd807aa98, 0x12835b01, 0x243185be,
        0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174, 0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa,
        0x5cb0a9dc, 0x76f988da, 0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967, 0x27b70a85,
        0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85, 0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3,
        0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070, 0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f,
        0x682e6ff3, 0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};
    std::uint32_t h[8] = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    const std::uint64_t bits = 8 * std::uint64_t{message.size()};
    message.push_back(0x80);
    while (message.size() % 64 != 56) message.push_back(0);
    for (int shift = 56; shift >= 0; shift -= 8) message.push_back(static_cast<std::uint8_t>(bits >> shift));
    for (std::size_t block = 0; block < message.size(); block += 64) {
        std::uint32_t w[64], s[8];
        for (std::size_t i = 0; i < 16; ++i) {
            const std::uint8_t *at = &message[block + 4 * i];
            w[i] = std::uint32_t{at[0]} << 24 | std::uint32_t{at[1]} << 16 | std::uint32_t{at[2]} << 8 | at[3];
        }
        for (int i = 16; i < 64; ++i) {
            const std::uint32_t s0 = rotate(w[i - 15], 7) ^ rotate(w[i - 15], 18) ^ w[i - 15] >> 3;
            const std::uint32_t s1 = rotate(w[i - 2], 17) ^ rotate(w[i - 2], 19) ^ w[i - 2] >> 10;
            w[i] = w[i - 16] + s0 + w[i - 7] + s1;
        }
        std::memcpy(s, h, sizeof h);
        for (int i = 0; i < 64; ++i) {
            const std::uint32_t choice = (s[4] & s[5]) ^ (~s[4] & s[6]), majority = (s[0] & s[1]) ^ (s[0] & s[2]) ^ (s[1] & s[2]);
            const std::uint32_t t1 = s[7] + (rotate(s[4], 6) ^ rotate(s[4], 11) ^ rotate(s[4], 25)) + choice + K[i] + w[i];
            const std::uint32_t t2 = (rotate(s[0], 2) ^ rotate(s[0], 13) ^ rotate(s[0], 22)) + majority;
            for (int j = 7; j > 0; --j) s[j] = s[j - 1];
            s[4] += t1;
            s[0] = t1 + t2;
        }
        for (int i = 0; i < 8; ++i) h[i] += s[i];
    }
    Digest digest;
    for (std::size_t i = 0; i < 32; ++i) digest[i] = static_cast<std::uint8_t>(h[i / 4] >> (24 - 8 * (i % 4)));
    return digest;
}

// The key is one of 32 bytes, which is shorter than a block.
Digest hmac(const Digest &key, const Bytes &message) {
    Bytes inner(64, 0x36), outer(64, 0x5c);
    for (std::size_t i = 0; i < key.size(); ++i) inner[i] ^= key[i], outer[i] ^= key[i];
    inner.insert(inner.end(), message.begin(), message.end());
    const Digest hash = sha256(std::move(inner));
    outer.insert(outer.end(), hash.begin(), hash.end());
    return sha256(std::move(outer));
}

constexpr std::size_t NONCE_LEN = 16, TAG_LEN = 16;

void append_tag(const Digest &key, Bytes &datagram) {
    const Digest tag = hmac(key, datagram);
    datagram.insert(datagram.end(), tag.begin(), tag.begin() + TAG_LEN);
}

// Takes the tag off. Whether it was right; the time does not depend on where it is wrong.
bool take_tag_off(const Digest &key, Bytes &datagram) {
    if (datagram.size() < TAG_LEN) return false;
    const Bytes found(datagram.end() - TAG_LEN, datagram.end());
    datagram.resize(datagram.size() - TAG_LEN);
    const Digest tag = hmac(key, datagram);
    unsigned difference = 0;
    for (std::size_t i = 0; i < TAG_LEN; ++i) difference |= static_cast<unsigned>(tag[i] ^ found[i]);
    return difference == 0;
}

// --- The datagrams -----------------------------------------------------------------------------------------------------------------------------

// Everything is little-endian, whatever this machine is.
void put(Bytes &to, std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}
void put(Bytes &to, const char *text) { to.insert(to.end(), text, text + std::strlen(text)); }
void put(Bytes &to, const Bytes &bytes) { to.insert(to.end(), bytes.begin(), bytes.end()); }
void put(Bytes &to, double value) {
    std::uint64_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    put(to, bits, 8);
}
std::uint64_t get(const Bytes &from, std::size_t at, int bytes) {
    std::uint64_t value = 0;
    for (int i = bytes - 1; i >= 0; --i) value = value << 8 | from[at + static_cast<std::size_t>(i)];
    return value;
}
double get_double(const Bytes &from, std::size_t at) {
    const std::uint64_t bits = get(from, at, 8);
    double value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}
bool begins(const Bytes &datagram, const char *magic) {
    return datagram.size() >= 6 && std::memcmp(datagram.data(), magic, 4) == 0 && get(datagram, 4, 2) == 1;
}

struct State {
    double position = 0, velocity = 0;
};
using States = std::vector<State>; // one for each axis
using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;

// How a body is turned: a unit quaternion w, x, y, z, and the angular velocity about its own axes [rad/s].
struct Attitude {
    std::array<double, 4> quaternion{1, 0, 0, 0};
    Vector rate{};
};

struct Sample {
    std::uint64_t session;
    std::uint32_t sender;
    std::uint64_t number, sent_ns;
    States states;
    std::optional<Attitude> attitude; // if the object turns
};

constexpr std::size_t HEADER_LEN = 48, ATTITUDE_LEN = 56;

Bytes encode(const Sample &sample) {
    Bytes bytes;
    put(bytes, "CHPT");
    put(bytes, 1, 2);
    put(bytes, sample.states.size(), 1);
    put(bytes, sample.attitude ? 1 : 0, 1);
    put(bytes, sample.session, 8);
    put(bytes, sample.sender, 4);
    put(bytes, 0, 4);
    put(bytes, sample.number, 8);
    put(bytes, sample.sent_ns, 8);
    put(bytes, 0, 8);
    for (const State &state : sample.states) put(bytes, state.position), put(bytes, state.velocity);
    if (sample.attitude) {
        for (const double q : sample.attitude->quaternion) put(bytes, q);
        for (const double w : sample.attitude->rate) put(bytes, w);
    }
    return bytes;
}

// Nothing for anything but a good sample of this session.
std::optional<Sample> decode(const Bytes &bytes, std::uint64_t session, std::size_t axes, bool turns) {
    const std::size_t end = HEADER_LEN + 16 * axes;
    if (bytes.size() != end + (turns ? ATTITUDE_LEN : 0) || !begins(bytes, "CHPT") || bytes[6] != axes) return {};
    if (bytes[7] != (turns ? 1 : 0) || get(bytes, 20, 4) != 0 || get(bytes, 40, 8) != 0 || get(bytes, 8, 8) != session) return {};
    Sample sample{session, static_cast<std::uint32_t>(get(bytes, 16, 4)), get(bytes, 24, 8), get(bytes, 32, 8), {}, {}};
    for (std::size_t at = HEADER_LEN; at < end; at += 16) {
        const State state{get_double(bytes, at), get_double(bytes, at + 8)};
        if (!std::isfinite(state.position) || !std::isfinite(state.velocity)) return {};
        sample.states.push_back(state);
    }
    if (turns) {
        Attitude attitude;
        double norm = 0;
        for (std::size_t i = 0; i < 4; ++i) attitude.quaternion[i] = get_double(bytes, end + 8 * i), norm += attitude.quaternion[i] * attitude.quaternion[i];
        for (std::size_t i = 0; i < 3; ++i) attitude.rate[i] = get_double(bytes, end + 32 + 8 * i);
        const bool finite = std::all_of(attitude.rate.begin(), attitude.rate.end(), [](double w) { return std::isfinite(w); });
        if (!finite || !(std::abs(norm - 1) <= 0x1p-20)) return {};
        sample.attitude = attitude;
    }
    return sample;
}

// What the door tells of the session.
struct Welcome {
    std::size_t axes;
    bool turns;
    std::uint32_t peers;
    std::uint64_t tick_ns, update_ns;
};

constexpr std::size_t HANDSHAKE_LEN = 88;

// One joining in a session with a key: first the hello, then the keys of both ways.
class Joining {
  public:
    Joining(const Digest &key, std::uint64_t session, std::uint32_t place) : key_(key), session_(session), place_(place) {
        std::random_device random; // the system's generator with glibc, libc++ and MSVC
        while (nonce_.size() < NONCE_LEN) put(nonce_, random(), 4);
    }

    Joining another() const { return Joining(key_, session_, place_); }

    Bytes hello() const {
        Bytes bytes;
        put(bytes, "CHPH");
        put(bytes, 1, 2);
        put(bytes, 0, 2);
        put(bytes, session_, 8);
        put(bytes, place_, 4);
        put(bytes, 0, 4);
        put(bytes, nonce_);
        bytes.resize(HANDSHAKE_LEN - TAG_LEN);
        append_tag(key_, bytes);
        return bytes;
    }

    // The keys are there if it is a welcome for this joining.
    std::optional<Welcome> handle_welcome(Bytes bytes) {
        if (bytes.size() != HANDSHAKE_LEN || !begins(bytes, "CHPW") || !take_tag_off(key_, bytes)) return {};
        const Bytes nonce(bytes.begin() + 24, bytes.begin() + 40), server_nonce(bytes.begin() + 40, bytes.begin() + 56);
        if (get(bytes, 8, 8) != session_ || get(bytes, 16, 4) != place_ || nonce != nonce_) return {};
        to_door_ = derive("cohaptic 1 to door", server_nonce);
        to_peer_ = derive("cohaptic 1 to peer", server_nonce);
        return Welcome{bytes[6], bytes[7] == 1, static_cast<std::uint32_t>(get(bytes, 20, 4)), get(bytes, 56, 8), get(bytes, 64, 8)};
    }

    Bytes seal(Bytes sample) const {
        put(sample, nonce_);
        append_tag(to_door_, sample);
        return sample;
    }

    // The sample in it, or nothing if it was not made for this joining.
    std::optional<Bytes> open(Bytes bytes) const {
        if (bytes.size() < NONCE_LEN + TAG_LEN || !take_tag_off(to_peer_, bytes)) return {};
        if (!std::equal(nonce_.begin(), nonce_.end(), bytes.end() - NONCE_LEN)) return {};
        bytes.resize(bytes.size() - NONCE_LEN);
        return bytes;
    }

  private:
    Digest derive(const char *way, const Bytes &server_nonce) const {
        Bytes bytes;
        put(bytes, way);
        put(bytes, session_, 8);
        put(bytes, place_, 4);
        put(bytes, nonce_);
        put(bytes, server_nonce);
        return hmac(key_, bytes);
    }

    Digest key_, to_door_{}, to_peer_{};
    std::uint64_t session_;
    std::uint32_t place_;
    Bytes nonce_;
};

// --- The socket --------------------------------------------------------------------------------------------------------------------------------

// A socket that talks to the door alone: the system drops what comes from elsewhere.
class Door {
  public:
    explicit Door(const std::string &text) {
        const std::size_t colon = text.rfind(':');
        if (colon == std::string::npos) throw std::runtime_error(text + " is no HOST:PORT");
        std::string host = text.substr(0, colon);
        if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
        addrinfo hints{}, *found = nullptr;
        hints.ai_socktype = SOCK_DGRAM;
        const int error = getaddrinfo(host.c_str(), text.substr(colon + 1).c_str(), &hints, &found);
        if (error != 0) throw std::runtime_error(text + ": " + gai_strerror(error));
        socket_ = socket(found->ai_family, found->ai_socktype, found->ai_protocol);
        const bool connected = socket_ >= 0 && connect(socket_, found->ai_addr, found->ai_addrlen) == 0;
        freeaddrinfo(found);
        if (!connected) throw std::runtime_error("cannot open a socket to " + text + ": " + std::strerror(errno));
    }
    ~Door() { close(socket_); }
    Door(const Door &) = delete;
    Door &operator=(const Door &) = delete;

    // What cannot be sent is lost: the next sample says more than this one would.
    void send(const Bytes &datagram) { static_cast<void>(::send(socket_, datagram.data(), datagram.size(), 0)); }

    // Nothing if nothing has arrived.
    std::optional<Bytes> receive() {
        Bytes buffer(2048); // more than any datagram of the protocol, so that a longer one shows
        for (int tries = 0; tries < 8; ++tries) {
            const ssize_t len = recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT);
            if (len >= 0) {
                buffer.resize(static_cast<std::size_t>(len));
                return buffer;
            }
            if (errno == EAGAIN || errno == EWOULDBLOCK) return {};
            // Otherwise the system tells that an earlier datagram found nobody, or a signal came: ask again.
        }
        return {};
    }

    void wait(milliseconds at_most) {
        pollfd descriptor{socket_, POLLIN, 0};
        poll(&descriptor, 1, static_cast<int>(at_most.count()));
    }

  private:
    int socket_;
};

// --- The mechanics -----------------------------------------------------------------------------------------------------------------------------

// A damped mass on each axis. A step is exact for a force that is held over it.
class Body {
  public:
    Body(double mass, double damping, double step, std::size_t axes) : states(axes) {
        // a = b·h/m; φ1 = (1 − e^−a)/a and φ2 = (1 − φ1)/a, by their series where the quotients would lose digits.
        const double a = damping * step / mass;
        const double phi1 = a < 1e-3 ? 1 - a / 2 + a * a / 6 - a * a * a / 24 : -std::expm1(-a) / a;
        const double phi2 = a < 1e-3 ? 0.5 - a / 6 + a * a / 24 - a * a * a / 120 : (1 - phi1) / a;
        position_per_velocity_ = step * phi1, position_per_force_ = step * step / mass * phi2;
        velocity_lost_ = a * phi1, velocity_per_force_ = step / mass * phi1;
    }

    void move(std::size_t axis, double force) {
        State &state = states[axis];
        state.position += position_per_velocity_ * state.velocity + position_per_force_ * force;
        state.velocity += velocity_per_force_ * force - velocity_lost_ * state.velocity;
    }

    States states;

  private:
    double position_per_velocity_, position_per_force_, velocity_lost_, velocity_per_force_;
};

// R, which turns vectors in body axes into world axes.
Matrix matrix_of(const std::array<double, 4> &q) {
    const auto [w, x, y, z] = q;
    const double f = 2 / (w * w + x * x + y * y + z * z);
    return {{{1 - f * (y * y + z * z), f * (x * y - w * z), f * (x * z + w * y)},
             {f * (x * y + w * z), 1 - f * (x * x + z * z), f * (y * z - w * x)},
             {f * (x * z - w * y), f * (y * z + w * x), 1 - f * (x * x + y * y)}}};
}

Vector times(const Matrix &m, const Vector &v) {
    Vector result{};
    for (std::size_t i = 0; i < 3; ++i) result[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
    return result;
}

Matrix transposed(const Matrix &m) {
    return {{{m[0][0], m[1][0], m[2][0]}, {m[0][1], m[1][1], m[2][1]}, {m[0][2], m[1][2], m[2][2]}}};
}

Vector cross(const Vector &a, const Vector &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// A damped body that turns, in its principal axes: J·ω' + ω×Jω = τ − b·ω, by Runge and Kutta's fourth order.
class Turn {
  public:
    Turn(const Vector &inertia, const Vector &damping, double step) : inertia_(inertia), damping_(damping), step_(step) {}

    void move(const Vector &torque) {
        const Numbers start{attitude.quaternion[0], attitude.quaternion[1], attitude.quaternion[2], attitude.quaternion[3],
                            attitude.rate[0],       attitude.rate[1],       attitude.rate[2]};
        const auto moved = [&](const Numbers &rise, double part) {
            Numbers end = start;
            for (std::size_t i = 0; i < end.size(); ++i) end[i] += part * rise[i];
            return end;
        };
        const Numbers k1 = slope(start, torque), k2 = slope(moved(k1, step_ / 2), torque);
        const Numbers k3 = slope(moved(k2, step_ / 2), torque), k4 = slope(moved(k3, step_), torque);
        Numbers end = start;
        for (std::size_t i = 0; i < end.size(); ++i) end[i] += step_ / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
        const double norm = std::sqrt(end[0] * end[0] + end[1] * end[1] + end[2] * end[2] + end[3] * end[3]);
        for (std::size_t i = 0; i < 4; ++i) attitude.quaternion[i] = end[i] / norm;
        for (std::size_t i = 0; i < 3; ++i) attitude.rate[i] = end[4 + i];
    }

    Attitude attitude;

  private:
    using Numbers = std::array<double, 7>;

    Numbers slope(const Numbers &state, const Vector &torque) const {
        const Vector u{state[1], state[2], state[3]}, rate{state[4], state[5], state[6]};
        const Vector spun = cross(u, rate), gyration = cross(rate, {inertia_[0] * rate[0], inertia_[1] * rate[1], inertia_[2] * rate[2]});
        Numbers rise{-(u[0] * rate[0] + u[1] * rate[1] + u[2] * rate[2]) / 2};
        for (std::size_t i = 0; i < 3; ++i) {
            rise[1 + i] = (state[0] * rate[i] + spun[i]) / 2;
            rise[4 + i] = (torque[i] - gyration[i] - damping_[i] * rate[i]) / inertia_[i];
        }
        return rise;
    }

    Vector inertia_, damping_;
    double step_;
};

// What is held from another peer: the sample with the highest number; its initial state before the first.
struct Sender {
    States states;
    std::optional<std::uint64_t> newest;
    std::optional<Clock::time_point> heard;
    std::uint64_t received = 0, late = 0;
    Matrix matrix = matrix_of({1, 0, 0, 0});
    Vector world_rate{};

    // Whether it is newer than what was held.
    bool take(Sample &&sample, Clock::time_point now) {
        ++received;
        if (newest && sample.number <= *newest) {
            ++late;
            return false;
        }
        newest = sample.number, heard = now;
        states = std::move(sample.states);
        if (sample.attitude) {
            matrix = matrix_of(sample.attitude->quaternion);
            world_rate = times(matrix, sample.attitude->rate);
        }
        return true;
    }
};

// --- The peer ----------------------------------------------------------------------------------------------------------------------------------

struct Gains {
    double stiffness, damping;
};

struct Options {
    std::string door, key_file;
    std::uint64_t session = 0;
    std::uint32_t place = 0, peers = 2;
    std::size_t axes = 1;
    double tick_ms = 1, update_ms = 8, duration = 10, patience = 10;
    double force = 0, force_for = std::numeric_limits<double>::infinity();
    double object_mass = 0.45, object_damping = 0, device_mass = 0.1, device_damping = 5;
    Gains coupling{3500, 5}, coordination{300, 5};
    std::optional<Vector> inertia; // of an object that turns
    Vector grasp{};
};

constexpr milliseconds HELLO_EVERY{250};
constexpr milliseconds SILENCE{1000};    // without anything new from anybody for so long, begin anew
constexpr milliseconds STALE_AFTER{100}; // a sender not heard for so long counts as stale

class Peer {
  public:
    Peer(const Options &options, Door &door, std::optional<Joining> joining, const Welcome &session)
        : options_(options), door_(door), joining_(std::move(joining)), session_(session),
          ticks_per_update_(std::max<std::uint64_t>(1, (session.update_ns + session.tick_ns / 2) / session.tick_ns)),
          device_(options.device_mass, options.device_damping, 1e-9 * static_cast<double>(session.tick_ns), session.axes),
          copy_(options.object_mass / session.peers, options.object_damping, 1e-9 * static_cast<double>(session.tick_ns), session.axes),
          others_(session.peers, Sender{States(session.axes), {}, {}, 0, 0}), joinings_(joining_ ? 1 : 0) {
        if (!options.inertia) return;
        // Gains and damping of the turn are those of the translation times J/m: each element of the mass as if it were alone.
        Vector inertia{}, damping{};
        for (std::size_t i = 0; i < 3; ++i) {
            over_mass_[i] = (*options.inertia)[i] / options.object_mass;
            inertia[i] = (*options.inertia)[i] / session.peers, damping[i] = options.object_damping * over_mass_[i];
            device_.states[i].position = options.grasp[i];
        }
        turn_.emplace(inertia, damping, 1e-9 * static_cast<double>(session.tick_ns));
    }

    // Runs for the duration, in ticks at fixed times: one that is late is made up for, so the peer's time never falls behind for good.
    void run() {
        ticks_ = static_cast<std::uint64_t>(std::llround(options_.duration * 1e9 / static_cast<double>(session_.tick_ns)));
        const Clock::time_point began = Clock::now();
        for (std::uint64_t k = 0; k < ticks_; ++k) {
            std::this_thread::sleep_until(began + nanoseconds(k * session_.tick_ns));
            tick(k);
        }
    }

    void print_summary() const {
        const Clock::time_point now = Clock::now();
        std::printf("{\"place\": %u, \"ticks\": %llu, \"sent\": %llu", options_.place, count(ticks_), count(sent_));
        std::printf(", \"joinings\": %llu, \"ignored\": %llu", count(joinings_), count(ignored_));
        print_array("position", copy_.states, &State::position);
        print_array("velocity", copy_.states, &State::velocity);
        print_array("device", device_.states, &State::position);
        if (turn_) {
            const auto &q = turn_->attitude.quaternion;
            std::printf(", \"orientation\": [%.17g, %.17g, %.17g, %.17g]", q[0], q[1], q[2], q[3]);
        }
        std::printf(", \"others\": [");
        const char *comma = "";
        for (std::uint32_t place = 0; place < session_.peers; ++place) {
            if (place == options_.place) continue;
            const Sender &other = others_[place];
            const bool stale = !other.heard || now - *other.heard > STALE_AFTER;
            std::printf("%s{\"sender\": %u, \"received\": %llu, \"late\": %llu", comma, place, count(other.received), count(other.late));
            std::printf(", \"stale\": %s}", stale ? "true" : "false");
            comma = ", ";
        }
        std::printf("]}\n");
    }

  private:
    void tick(std::uint64_t k) {
        // 1. Sample and send.
        if (k % ticks_per_update_ == 0) {
            const std::optional<Attitude> attitude = turn_ ? std::optional(turn_->attitude) : std::nullopt;
            const Bytes sample = encode({options_.session, options_.place, sent_++, k * session_.tick_ns, copy_.states, attitude});
            door_.send(joining_ ? joining_->seal(sample) : sample);
        }
        // 2. Take in what has arrived; no more at one tick than can be new, so that a flood cannot stop the loop.
        const Clock::time_point now = Clock::now();
        for (int n = 0; n < 64; ++n) {
            std::optional<Bytes> datagram = door_.receive();
            if (!datagram) break;
            if (!handle(std::move(*datagram), now)) ++ignored_;
        }
        begin_anew_after_silence(now);
        // 3. Forces. 4. Move.
        const double seconds = 1e-9 * static_cast<double>(k * session_.tick_ns);
        // Of an object that turns the grasp point is held: xO + R·r, with the velocity vO + R·(ω×r).
        Vector arm{}, swing{}, coupling{};
        if (turn_) {
            const Matrix matrix = matrix_of(turn_->attitude.quaternion);
            arm = times(matrix, options_.grasp), swing = times(matrix, cross(turn_->attitude.rate, options_.grasp));
        }
        for (std::size_t axis = 0; axis < session_.axes; ++axis) {
            const double force_of_hand = axis == 0 && seconds < options_.force_for ? options_.force : 0;
            coupling[axis] = move(axis, force_of_hand, {arm[axis], swing[axis]});
        }
        if (turn_) turn_->move(torque(coupling));
    }

    // Gives FC. `grasp`: the motion of the grasp point relative to the centre of the copy.
    double move(std::size_t axis, double force_of_hand, State grasp) {
        const State device = device_.states[axis], copy = copy_.states[axis];
        // (9) FC = KC·(xH − xO) + BC·(vH − vO): what the device does to the copy.
        const Gains &c = options_.coupling;
        const double coupling = c.stiffness * (device.position - copy.position - grasp.position) + c.damping * (device.velocity - copy.velocity - grasp.velocity);
        // (10) FT = KT·(xO − xd) + BT·(vO − vd), towards the mean of the samples held from the others.
        const Gains &t = options_.coordination;
        double coordination = 0;
        if (session_.peers > 1) {
            State mean;
            for (std::uint32_t place = 0; place < session_.peers; ++place) {
                if (place == options_.place) continue;
                mean.position += others_[place].states[axis].position / (session_.peers - 1);
                mean.velocity += others_[place].states[axis].velocity / (session_.peers - 1);
            }
            coordination = t.stiffness * (copy.position - mean.position) + t.damping * (copy.velocity - mean.velocity);
        }
        device_.move(axis, force_of_hand - coupling);
        copy_.move(axis, coupling - coordination);
        return coupling;
    }

    // r×RᵀFC − τT in body axes, with τT = BR∘(ω − Rᵀ·w̄) − 2·vee sk(RᵀM̄·P) and P = diag(½·ΣKR − KR).
    Vector torque(const Vector &coupling) const {
        const Matrix to_body = transposed(matrix_of(turn_->attitude.quaternion));
        Vector total = cross(options_.grasp, times(to_body, coupling));
        if (session_.peers < 2) return total;
        Matrix mean{};
        Vector world_rate{};
        for (std::uint32_t place = 0; place < session_.peers; ++place) {
            if (place == options_.place) continue;
            for (std::size_t i = 0; i < 3; ++i) {
                world_rate[i] += others_[place].world_rate[i] / (session_.peers - 1);
                for (std::size_t j = 0; j < 3; ++j) mean[i][j] += others_[place].matrix[i][j] / (session_.peers - 1);
            }
        }
        const Vector rate = times(to_body, world_rate);
        const double sum = options_.coordination.stiffness * (over_mass_[0] + over_mass_[1] + over_mass_[2]);
        Matrix apart{};
        for (std::size_t j = 0; j < 3; ++j) {
            const double weight = sum / 2 - options_.coordination.stiffness * over_mass_[j];
            const Vector column = times(to_body, {mean[0][j], mean[1][j], mean[2][j]});
            for (std::size_t i = 0; i < 3; ++i) apart[i][j] = weight * column[i];
        }
        const Vector spring{apart[2][1] - apart[1][2], apart[0][2] - apart[2][0], apart[1][0] - apart[0][1]};
        for (std::size_t i = 0; i < 3; ++i) {
            total[i] += spring[i] - options_.coordination.damping * over_mass_[i] * (turn_->attitude.rate[i] - rate[i]);
        }
        return total;
    }

    bool handle(Bytes datagram, Clock::time_point now) {
        if (rejoining_ && rejoining_->handle_welcome(datagram)) {
            joining_ = std::exchange(rejoining_, std::nullopt);
            ++joinings_;
            heard_ = now;
            forget_numbers();
            return true;
        }
        const std::optional<Bytes> plain = joining_ ? joining_->open(std::move(datagram)) : std::move(datagram);
        std::optional<Sample> sample = plain ? decode(*plain, options_.session, session_.axes, session_.turns) : std::nullopt;
        if (!sample || sample->sender >= session_.peers || sample->sender == options_.place) return false;
        if (others_[sample->sender].take(std::move(*sample), now)) heard_ = now;
        return true;
    }

    // The session may have been started again: then all numbers begin at 0, and the keys of the joining are worth nothing.
    void begin_anew_after_silence(Clock::time_point now) {
        if (now - heard_ < SILENCE) {
            rejoining_.reset();
        } else if (!joining_) {
            forget_numbers();
        } else if (now >= next_hello_) {
            if (!rejoining_) rejoining_ = joining_->another();
            door_.send(rejoining_->hello());
            next_hello_ = now + HELLO_EVERY;
        }
    }

    void forget_numbers() {
        for (Sender &other : others_) other.newest.reset();
    }

    static unsigned long long count(std::uint64_t value) { return value; }

    static void print_array(const char *name, const States &states, double State::*part) {
        std::printf(", \"%s\": [", name);
        for (std::size_t axis = 0; axis < states.size(); ++axis) std::printf("%s%.17g", axis ? ", " : "", states[axis].*part);
        std::printf("]");
    }

    const Options &options_;
    Door &door_;
    std::optional<Joining> joining_, rejoining_;
    const Welcome session_;
    const std::uint64_t ticks_per_update_;
    Body device_, copy_;
    std::optional<Turn> turn_; // of an object that turns
    Vector over_mass_{};       // J/m of the whole object
    std::vector<Sender> others_; // by place; that of this peer is not used
    std::uint64_t ticks_ = 0, sent_ = 0, ignored_ = 0, joinings_;
    Clock::time_point heard_ = Clock::now(); // anything new from anybody
    Clock::time_point next_hello_{};
};

// Says hello until the door answers.
std::pair<Joining, Welcome> join(Door &door, const Digest &key, const Options &options) {
    Joining joining(key, options.session, options.place);
    const Clock::time_point until = Clock::now() + milliseconds(std::llround(1000 * options.patience));
    while (Clock::now() < until) {
        door.send(joining.hello());
        const Clock::time_point again = Clock::now() + HELLO_EVERY;
        for (Clock::time_point now = Clock::now(); now < again; now = Clock::now()) {
            door.wait(std::chrono::duration_cast<milliseconds>(again - now) + milliseconds(1));
            while (const std::optional<Bytes> datagram = door.receive()) {
                if (const std::optional<Welcome> welcome = joining.handle_welcome(*datagram)) return {joining, *welcome};
                if (Clock::now() >= until) break;
            }
        }
    }
    throw std::runtime_error("no welcome for place " + std::to_string(options.place) + " of session " + std::to_string(options.session) +
                             ": is the session up, and is the key the same?");
}

Digest read_key(const std::string &path) {
    std::ifstream file(path);
    const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    const std::size_t end = text.find_last_not_of(" \t\r\n") + 1;
    if (end != 64 || text.find_first_not_of("0123456789abcdefABCDEF") < 64) {
        throw std::runtime_error(path + " is no key file: it must hold 64 hexadecimal digits");
    }
    Digest key;
    for (std::size_t i = 0; i < key.size(); ++i) key[i] = static_cast<std::uint8_t>(std::stoul(text.substr(2 * i, 2), nullptr, 16));
    return key;
}

constexpr const char *USAGE =
    "usage: udp_peer HOST:PORT --session N --place I [option value ...]\n"
    "  --key-file FILE      64 hexadecimal digits; then axes, peers and periods are told by the door\n"
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
    "  --coordination 300,5 N/m, N·s/m\n";

Options parse(int argc, char **argv) {
    Options options;
    if (argc < 2) throw std::invalid_argument("HOST:PORT is missing");
    options.door = argv[1];
    bool session = false, place = false;
    for (int i = 2; i < argc; i += 2) {
        const std::string name = argv[i];
        if (i + 1 == argc) throw std::invalid_argument(name + " has no value");
        const std::string value = argv[i + 1];
        const auto number = [&] { return std::stod(value); };
        const auto whole = [&] { return std::stoull(value); };
        const auto gains = [&] { return Gains{std::stod(value), std::stod(value.substr(value.find(',') + 1))}; };
        const auto vector = [&] {
            Vector numbers{};
            std::size_t at = 0;
            for (double &component : numbers) {
                component = std::stod(value.substr(at));
                at = value.find(',', at) + 1;
                if (&component != &numbers.back() && at == 0) throw std::invalid_argument(name + " needs three numbers");
            }
            return numbers;
        };
        if (name == "--session") options.session = whole(), session = true;
        else if (name == "--place") options.place = static_cast<std::uint32_t>(whole()), place = true;
        else if (name == "--key-file") options.key_file = value;
        else if (name == "--axes") options.axes = static_cast<std::size_t>(whole());
        else if (name == "--peers") options.peers = static_cast<std::uint32_t>(whole());
        else if (name == "--tick-ms") options.tick_ms = number();
        else if (name == "--update-ms") options.update_ms = number();
        else if (name == "--duration") options.duration = number();
        else if (name == "--patience") options.patience = number();
        else if (name == "--force") options.force = number();
        else if (name == "--force-for") options.force_for = number();
        else if (name == "--object-mass") options.object_mass = number();
        else if (name == "--object-damping") options.object_damping = number();
        else if (name == "--device-mass") options.device_mass = number();
        else if (name == "--device-damping") options.device_damping = number();
        else if (name == "--coupling") options.coupling = gains();
        else if (name == "--coordination") options.coordination = gains();
        else if (name == "--inertia") options.inertia = vector();
        else if (name == "--grasp") options.grasp = vector();
        else throw std::invalid_argument("there is no " + name);
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
    try {
        Door door(options.door);
        std::optional<Joining> joining;
        const auto nanos = [](double millis) { return static_cast<std::uint64_t>(std::llround(1e6 * millis)); };
        Welcome session{options.axes, options.inertia.has_value(), options.peers, nanos(options.tick_ms), nanos(options.update_ms)};
        if (!options.key_file.empty()) {
            std::pair<Joining, Welcome> joined = join(door, read_key(options.key_file), options);
            joining = std::move(joined.first);
            session = joined.second;
        }
        if (session.axes < 1 || session.axes > 3 || options.place >= session.peers || session.tick_ns == 0) {
            throw std::runtime_error("place, peers, axes and periods do not fit together");
        }
        if (session.turns != options.inertia.has_value() || (session.turns && session.axes != 3)) {
            throw std::runtime_error("the object of the session turns if, and only if, --inertia is given, and it has three axes then");
        }
        Peer peer(options, door, std::move(joining), session);
        peer.run();
        peer.print_summary();
    } catch (const std::exception &error) {
        std::fprintf(stderr, "udp_peer: %s\n", error.what());
        return 1;
    }
}
