/* A peer of a live session of cohaptic, for a device or a program of your own. C99 or C++11, header only.
 *
 * The peer has its own copy of the shared object, couples your device to the copy, exchanges samples with the other peers through the session, and
 * passes each force through a gate before your device gets the force. A device is four members:
 *
 *     #include "cohaptic_peer.h"           // before other headers if the compiler is strict (-std=c99)
 *
 *     static int  my_read(void *self, cohaptic_state *state) { ...; return COHAPTIC_READ; }
 *     static void my_push(void *self, const double force[3]) { ... }
 *     static void my_stop(void *self) { ... }
 *
 *     cohaptic_options options = cohaptic_usual();
 *     options.door = "127.0.0.1:7400", options.session.number = 7, options.session.place = 2, options.session.peers = 3;
 *     cohaptic_device device = { my_read, my_push, my_stop, &mine };
 *     static cohaptic_client client;
 *     const char *error = cohaptic_open(&client, &options);
 *     if (!error) error = cohaptic_run(&client, &device, 60);
 *     cohaptic_close(&client);
 *
 * SI units: m, m/s, N, rad/s. x points to the right of the person, y up, z to the person; the origin is in the middle of the workspace.
 * docs/own-device.md explains the device, docs/live-protocol.md the datagrams, docs/model.md the equations; for an object that turns docs/rotation.md.
 *
 * Link with -lm; on Windows with ws2_32, bcrypt and winmm. The code for Windows compiles with MinGW-w64, and was never run.
 *
 * Licence: MIT or Apache-2.0, as cohaptic.
 */
#ifndef COHAPTIC_PEER_H
#define COHAPTIC_PEER_H

#if defined(__STRICT_ANSI__) && !defined(_WIN32) && !defined(_POSIX_C_SOURCE) && !defined(_GNU_SOURCE)
#define _POSIX_C_SOURCE 200809L /* A strict compiler hides clocks and sockets without this line. */
#endif

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#ifdef _WIN32
#include <winsock2.h>
#include <ws2tcpip.h>
#include <windows.h>
#include <bcrypt.h>
#include <timeapi.h>
typedef SOCKET cohaptic_socket;
typedef int cohaptic_len; /* of a buffer, as send() takes it */
#define COHAPTIC_NO_SOCKET INVALID_SOCKET
#else
#include <fcntl.h>
#include <netdb.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>
typedef int cohaptic_socket;
typedef size_t cohaptic_len; /* of a buffer, as send() takes it */
#define COHAPTIC_NO_SOCKET (-1)
#endif

/* Largest number of peers of a scene. Define a larger number before the header is included, if a scene has more. */
#ifndef COHAPTIC_MAX_PEERS
#define COHAPTIC_MAX_PEERS 64
#endif

enum {
    COHAPTIC_KEY = 32,      /* bytes of a key */
    COHAPTIC_NONCE = 16,    /* bytes of a nonce */
    COHAPTIC_TAG = 16,      /* bytes of a tag */
    COHAPTIC_HANDSHAKE = 88 /* bytes of a hello and of a welcome */
};
/* Bytes of the longest datagram: a sealed sample of an object that turns. */
#define COHAPTIC_DATAGRAM 184

/* --- SHA-256 (FIPS 180-4) and HMAC (RFC 2104) --------------------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t h[8];
    uint8_t block[64];
    uint64_t len; /* bytes taken so far */
} cohaptic_sha256;

static inline uint32_t cohaptic_rotated(uint32_t word, int by) { return word >> by | word << (32 - by); }

static inline void cohaptic_sha256_block(cohaptic_sha256 *hash) {
    static const uint32_t K[64] = {
        0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5, 0xd807aa98, 0x12835b01, 0x243185be,
        0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174, 0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa,
        0x5cb0a9dc, 0x76f988da, 0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967, 0x27b70a85,
        0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85, 0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3,
        0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070, 0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f,
        0x682e6ff3, 0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};
    uint32_t w[64], s[8];
    int i, j;
    for (i = 0; i < 16; ++i) {
        const uint8_t *at = &hash->block[4 * i];
        w[i] = (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
    }
    for (i = 16; i < 64; ++i) {
        const uint32_t s0 = cohaptic_rotated(w[i - 15], 7) ^ cohaptic_rotated(w[i - 15], 18) ^ w[i - 15] >> 3;
        const uint32_t s1 = cohaptic_rotated(w[i - 2], 17) ^ cohaptic_rotated(w[i - 2], 19) ^ w[i - 2] >> 10;
        w[i] = w[i - 16] + s0 + w[i - 7] + s1;
    }
    memcpy(s, hash->h, sizeof s);
    for (i = 0; i < 64; ++i) {
        const uint32_t choice = (s[4] & s[5]) ^ (~s[4] & s[6]), majority = (s[0] & s[1]) ^ (s[0] & s[2]) ^ (s[1] & s[2]);
        const uint32_t t1 = s[7] + (cohaptic_rotated(s[4], 6) ^ cohaptic_rotated(s[4], 11) ^ cohaptic_rotated(s[4], 25)) + choice + K[i] + w[i];
        const uint32_t t2 = (cohaptic_rotated(s[0], 2) ^ cohaptic_rotated(s[0], 13) ^ cohaptic_rotated(s[0], 22)) + majority;
        for (j = 7; j > 0; --j) s[j] = s[j - 1];
        s[4] += t1;
        s[0] = t1 + t2;
    }
    for (i = 0; i < 8; ++i) hash->h[i] += s[i];
}

static inline void cohaptic_sha256_begin(cohaptic_sha256 *hash) {
    static const uint32_t H[8] = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    memcpy(hash->h, H, sizeof H);
    hash->len = 0;
}

static inline void cohaptic_sha256_take(cohaptic_sha256 *hash, const void *bytes, size_t len) {
    const uint8_t *from = (const uint8_t *)bytes;
    size_t i;
    for (i = 0; i < len; ++i) {
        hash->block[hash->len++ % 64] = from[i];
        if (hash->len % 64 == 0) cohaptic_sha256_block(hash);
    }
}

static inline void cohaptic_sha256_end(cohaptic_sha256 *hash, uint8_t digest[32]) {
    const uint64_t bits = 8 * hash->len;
    const uint8_t one = 0x80, zero = 0;
    uint8_t length[8];
    int i;
    cohaptic_sha256_take(hash, &one, 1);
    while (hash->len % 64 != 56) cohaptic_sha256_take(hash, &zero, 1);
    for (i = 0; i < 8; ++i) length[i] = (uint8_t)(bits >> (56 - 8 * i));
    cohaptic_sha256_take(hash, length, 8);
    for (i = 0; i < 32; ++i) digest[i] = (uint8_t)(hash->h[i / 4] >> (24 - 8 * (i % 4)));
}

/* Computes HMAC-SHA256 of a message under a key of any length. */
static inline void cohaptic_hmac(const uint8_t *key, size_t key_len, const void *message, size_t len, uint8_t digest[32]) {
    uint8_t block[64] = {0}, pad[64];
    cohaptic_sha256 hash;
    int i;
    if (key_len > sizeof block) {
        /* RFC 2104: a key longer than a block is replaced by its hash. */
        cohaptic_sha256_begin(&hash);
        cohaptic_sha256_take(&hash, key, key_len);
        cohaptic_sha256_end(&hash, block);
    } else {
        memcpy(block, key, key_len);
    }
    for (i = 0; i < 64; ++i) pad[i] = (uint8_t)(block[i] ^ 0x36);
    cohaptic_sha256_begin(&hash);
    cohaptic_sha256_take(&hash, pad, sizeof pad);
    cohaptic_sha256_take(&hash, message, len);
    cohaptic_sha256_end(&hash, digest);
    for (i = 0; i < 64; ++i) pad[i] = (uint8_t)(block[i] ^ 0x5c);
    cohaptic_sha256_begin(&hash);
    cohaptic_sha256_take(&hash, pad, sizeof pad);
    cohaptic_sha256_take(&hash, digest, 32);
    cohaptic_sha256_end(&hash, digest);
}

/* Writes the tag of the first `len` bytes after these bytes, and returns the new length. */
static inline size_t cohaptic_add_tag(const uint8_t key[COHAPTIC_KEY], uint8_t *datagram, size_t len) {
    uint8_t digest[32];
    cohaptic_hmac(key, COHAPTIC_KEY, datagram, len, digest);
    memcpy(datagram + len, digest, COHAPTIC_TAG);
    return len + COHAPTIC_TAG;
}

/* Returns whether the last 16 bytes are the tag of all bytes before. The time does not depend on the place of a wrong byte. */
static inline int cohaptic_tag_is_right(const uint8_t key[COHAPTIC_KEY], const uint8_t *datagram, size_t len) {
    uint8_t digest[32];
    unsigned difference = 0;
    size_t i;
    if (len < COHAPTIC_TAG) return 0;
    cohaptic_hmac(key, COHAPTIC_KEY, datagram, len - COHAPTIC_TAG, digest);
    for (i = 0; i < COHAPTIC_TAG; ++i) difference |= (unsigned)(digest[i] ^ datagram[len - COHAPTIC_TAG + i]);
    return difference == 0;
}

/* --- States and datagrams ------------------------------------------------------------------------------------------------------------------------ */

typedef struct {
    double position[3]; /* [m] */
    double velocity[3]; /* [m/s] */
} cohaptic_state;

/* Attitude of a body: a unit quaternion w, x, y, z, and the angular velocity about the axes of the body [rad/s]. */
typedef struct {
    double quaternion[4], rate[3];
} cohaptic_attitude;

/* Facts of a session. With a key the welcome tells all but number and place. */
typedef struct {
    uint64_t number;             /* session number: the seed of the scene */
    uint32_t place;              /* place of this peer among the peers of the scene, from 0 */
    uint32_t peers;              /* number of peers of the scene, this one included */
    uint8_t axes;                /* 1 to 3 */
    uint8_t turns;               /* 1 if the object turns, which needs three axes; otherwise 0 */
    uint64_t tick_ns, update_ns; /* Tc and Tn [ns] */
} cohaptic_session;

typedef struct {
    uint32_t sender;
    uint64_t number;  /* counts the samples of the sender */
    uint64_t sent_ns; /* time of the sender's clock [ns] */
    cohaptic_state state;
    cohaptic_attitude attitude; /* meaningless unless the object turns */
} cohaptic_sample;

/* All numbers of the protocol are little-endian, on every machine. */
static inline uint8_t *cohaptic_put(uint8_t *to, uint64_t value, int bytes) {
    int i;
    for (i = 0; i < bytes; ++i) *to++ = (uint8_t)(value >> (8 * i));
    return to;
}
static inline uint8_t *cohaptic_put_double(uint8_t *to, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return cohaptic_put(to, bits, 8);
}
static inline uint64_t cohaptic_get(const uint8_t *from, int bytes) {
    uint64_t value = 0;
    while (bytes-- > 0) value = value << 8 | from[bytes];
    return value;
}
static inline double cohaptic_get_double(const uint8_t *from) {
    const uint64_t bits = cohaptic_get(from, 8);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Returns the length of a sample without a seal. */
static inline size_t cohaptic_sample_len(const cohaptic_session *session) { return 48 + 16 * (size_t)session->axes + (session->turns ? 56 : 0); }

/* Writes a sample without a seal, and returns its length. */
static inline size_t cohaptic_encode(const cohaptic_session *session, const cohaptic_sample *sample, uint8_t *out) {
    uint8_t *to = out;
    int i;
    memcpy(to, "CHPT", 4);
    to = cohaptic_put(to + 4, 1, 2);
    to = cohaptic_put(to, session->axes, 1);
    to = cohaptic_put(to, session->turns, 1);
    to = cohaptic_put(to, session->number, 8);
    to = cohaptic_put(to, sample->sender, 4);
    to = cohaptic_put(to, 0, 4);
    to = cohaptic_put(to, sample->number, 8);
    to = cohaptic_put(to, sample->sent_ns, 8);
    to = cohaptic_put(to, 0, 8);
    for (i = 0; i < session->axes; ++i) to = cohaptic_put_double(cohaptic_put_double(to, sample->state.position[i]), sample->state.velocity[i]);
    if (session->turns) {
        for (i = 0; i < 4; ++i) to = cohaptic_put_double(to, sample->attitude.quaternion[i]);
        for (i = 0; i < 3; ++i) to = cohaptic_put_double(to, sample->attitude.rate[i]);
    }
    return (size_t)(to - out);
}

/* Reads a sample without a seal. Returns 0 for everything but a valid sample of this session. */
static inline int cohaptic_decode(const cohaptic_session *session, const uint8_t *bytes, size_t len, cohaptic_sample *sample) {
    const uint8_t *at = bytes + 48;
    int i, finite = 1;
    if (len != cohaptic_sample_len(session) || memcmp(bytes, "CHPT", 4) != 0 || cohaptic_get(bytes + 4, 2) != 1) return 0;
    if (bytes[6] != session->axes || bytes[7] != session->turns || cohaptic_get(bytes + 8, 8) != session->number) return 0;
    if (cohaptic_get(bytes + 20, 4) != 0 || cohaptic_get(bytes + 40, 8) != 0) return 0;
    memset(sample, 0, sizeof *sample);
    sample->sender = (uint32_t)cohaptic_get(bytes + 16, 4);
    sample->number = cohaptic_get(bytes + 24, 8);
    sample->sent_ns = cohaptic_get(bytes + 32, 8);
    for (i = 0; i < session->axes; ++i, at += 16) {
        sample->state.position[i] = cohaptic_get_double(at), sample->state.velocity[i] = cohaptic_get_double(at + 8);
        finite &= isfinite(sample->state.position[i]) && isfinite(sample->state.velocity[i]);
    }
    if (session->turns) {
        double norm = 0;
        for (i = 0; i < 4; ++i, at += 8) {
            const double part = sample->attitude.quaternion[i] = cohaptic_get_double(at);
            norm += part * part;
        }
        for (i = 0; i < 3; ++i, at += 8) sample->attitude.rate[i] = cohaptic_get_double(at), finite &= isfinite(sample->attitude.rate[i]) != 0;
        /* A comparison with NaN is false, so the negation also refuses a quaternion that is not finite. */
        if (!(fabs(norm - 1) <= 1.0 / 1048576)) return 0;
    }
    return finite;
}

/* Joining of a session with a key: first the nonce, then the keys of both directions. */
typedef struct {
    uint8_t nonce[COHAPTIC_NONCE], to_door[COHAPTIC_KEY], to_peer[COHAPTIC_KEY];
} cohaptic_joining;

/* Writes a hello. `fingerprint`: of the scene, 0 if unknown. `label`: ASCII, at most 8 bytes, such as "chai3d"; may be empty. */
static inline void cohaptic_hello(const uint8_t key[COHAPTIC_KEY], const cohaptic_session *session, const uint8_t nonce[COHAPTIC_NONCE], uint64_t fingerprint,
                                  const char *label, uint8_t out[COHAPTIC_HANDSHAKE]) {
    size_t i;
    memset(out, 0, COHAPTIC_HANDSHAKE);
    memcpy(out, "CHPH", 4);
    cohaptic_put(out + 4, 1, 2);
    cohaptic_put(out + 8, session->number, 8);
    cohaptic_put(out + 16, session->place, 4);
    memcpy(out + 24, nonce, COHAPTIC_NONCE);
    cohaptic_put(out + 40, fingerprint, 8);
    for (i = 0; i < 8 && label[i] != 0; ++i) out[48 + i] = (uint8_t)label[i];
    cohaptic_add_tag(key, out, COHAPTIC_HANDSHAKE - COHAPTIC_TAG);
}

static inline void cohaptic_derive(const uint8_t key[COHAPTIC_KEY], const char *way, const uint8_t *welcome, uint8_t out[COHAPTIC_KEY]) {
    uint8_t message[18 + 12 + 2 * COHAPTIC_NONCE];
    memcpy(message, way, 18);
    memcpy(message + 18, welcome + 8, 12);                      /* session and place */
    memcpy(message + 30, welcome + 24, 2 * COHAPTIC_NONCE);     /* both nonces */
    cohaptic_hmac(key, COHAPTIC_KEY, message, sizeof message, out);
}

/* Reads a welcome. Returns 0 unless the datagram answers this joining; otherwise `session` has the facts, and `joining` its keys. */
static inline int cohaptic_welcome(const uint8_t key[COHAPTIC_KEY], const uint8_t *bytes, size_t len, cohaptic_session *session, cohaptic_joining *joining) {
    if (len != COHAPTIC_HANDSHAKE || memcmp(bytes, "CHPW", 4) != 0 || cohaptic_get(bytes + 4, 2) != 1 || !cohaptic_tag_is_right(key, bytes, len)) return 0;
    if (cohaptic_get(bytes + 8, 8) != session->number || cohaptic_get(bytes + 16, 4) != session->place) return 0;
    if (memcmp(bytes + 24, joining->nonce, COHAPTIC_NONCE) != 0) return 0;
    session->axes = bytes[6], session->turns = bytes[7];
    session->peers = (uint32_t)cohaptic_get(bytes + 20, 4);
    session->tick_ns = cohaptic_get(bytes + 56, 8), session->update_ns = cohaptic_get(bytes + 64, 8);
    cohaptic_derive(key, "cohaptic 1 to door", bytes, joining->to_door);
    cohaptic_derive(key, "cohaptic 1 to peer", bytes, joining->to_peer);
    return 1;
}

/* Seals the sample of `len` bytes for the session, and returns the new length. */
static inline size_t cohaptic_seal(const cohaptic_joining *joining, uint8_t *sample, size_t len) {
    memcpy(sample + len, joining->nonce, COHAPTIC_NONCE);
    return cohaptic_add_tag(joining->to_door, sample, len + COHAPTIC_NONCE);
}

/* Returns the length of the sample in a sealed datagram, or 0 if the datagram was not made for this joining. */
static inline size_t cohaptic_opened(const cohaptic_joining *joining, const uint8_t *bytes, size_t len) {
    const size_t seal = COHAPTIC_NONCE + COHAPTIC_TAG;
    if (len < seal || memcmp(bytes + len - seal, joining->nonce, COHAPTIC_NONCE) != 0 || !cohaptic_tag_is_right(joining->to_peer, bytes, len)) return 0;
    return len - seal;
}

/* --- Mechanics ----------------------------------------------------------------------------------------------------------------------------------- */

/* Step of a damped mass along one axis, exact for a force that is held over the step. */
typedef struct {
    double position_per_velocity, position_per_force, velocity_lost, velocity_per_force;
} cohaptic_step;

/* Returns the step of `h` seconds of a mass [kg] with a damping [N.s/m]. */
static inline cohaptic_step cohaptic_step_of(double mass, double damping, double h) {
    /* a = b*h/m; phi1 = (1 - e^-a)/a and phi2 = (1 - phi1)/a, by their series where the quotients would lose digits. */
    const double a = damping * h / mass;
    const double phi1 = a < 1e-3 ? 1 - a / 2 + a * a / 6 - a * a * a / 24 : -expm1(-a) / a;
    const double phi2 = a < 1e-3 ? 0.5 - a / 6 + a * a / 24 - a * a * a / 120 : (1 - phi1) / a;
    cohaptic_step step;
    step.position_per_velocity = h * phi1, step.position_per_force = h * h / mass * phi2;
    step.velocity_lost = a * phi1, step.velocity_per_force = h / mass * phi1;
    return step;
}

/* Moves a body by one step along `axis` under the held force [N]. */
static inline void cohaptic_move(const cohaptic_step *step, cohaptic_state *body, int axis, double force) {
    double *const x = &body->position[axis], *const v = &body->velocity[axis];
    *x += step->position_per_velocity * *v + step->position_per_force * force;
    *v += step->velocity_per_force * force - step->velocity_lost * *v;
}

/* R, row by row: turns vectors from the axes of the body into those of the world. */
typedef struct {
    double m[3][3];
} cohaptic_matrix;

static inline cohaptic_matrix cohaptic_matrix_of(const double quaternion[4]) {
    const double w = quaternion[0], x = quaternion[1], y = quaternion[2], z = quaternion[3];
    const double f = 2 / (w * w + x * x + y * y + z * z);
    cohaptic_matrix r;
    r.m[0][0] = 1 - f * (y * y + z * z), r.m[0][1] = f * (x * y - w * z), r.m[0][2] = f * (x * z + w * y);
    r.m[1][0] = f * (x * y + w * z), r.m[1][1] = 1 - f * (x * x + z * z), r.m[1][2] = f * (y * z - w * x);
    r.m[2][0] = f * (x * z - w * y), r.m[2][1] = f * (y * z + w * x), r.m[2][2] = 1 - f * (x * x + y * y);
    return r;
}

static inline void cohaptic_to_world(const cohaptic_matrix *r, const double v[3], double out[3]) {
    int i;
    for (i = 0; i < 3; ++i) out[i] = r->m[i][0] * v[0] + r->m[i][1] * v[1] + r->m[i][2] * v[2];
}

static inline void cohaptic_to_body(const cohaptic_matrix *r, const double v[3], double out[3]) {
    int i;
    for (i = 0; i < 3; ++i) out[i] = r->m[0][i] * v[0] + r->m[1][i] * v[1] + r->m[2][i] * v[2];
}

static inline void cohaptic_cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1], out[1] = a[2] * b[0] - a[0] * b[2], out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Slope of quaternion and angular velocity of a damped body in its principal axes: J*w' + w x J*w = torque - b*w. */
static inline void cohaptic_turn_slope(const double inertia[3], const double damping[3], const double state[7], const double torque[3], double slope[7]) {
    const double *const u = state + 1, *const rate = state + 4;
    double momentum[3], spun[3], gyration[3];
    int i;
    for (i = 0; i < 3; ++i) momentum[i] = inertia[i] * rate[i];
    cohaptic_cross(u, rate, spun);
    cohaptic_cross(rate, momentum, gyration);
    slope[0] = -(u[0] * rate[0] + u[1] * rate[1] + u[2] * rate[2]) / 2;
    for (i = 0; i < 3; ++i) {
        slope[1 + i] = (state[0] * rate[i] + spun[i]) / 2;
        slope[4 + i] = (torque[i] - gyration[i] - damping[i] * rate[i]) / inertia[i];
    }
}

/* Turns a body by one step of `h` seconds under the held torque [N.m, axes of the body], by the method of Runge and Kutta of fourth order. */
static inline void cohaptic_turn(const double inertia[3], const double damping[3], double h, cohaptic_attitude *body, const double torque[3]) {
    static const double PART[4] = {0, 0.5, 0.5, 1}, WEIGHT[4] = {1, 2, 2, 1};
    double start[7], at[7], slope[7] = {0}, sum[7] = {0}, norm = 0;
    int i, stage;
    memcpy(start, body->quaternion, sizeof body->quaternion);
    memcpy(start + 4, body->rate, sizeof body->rate);
    for (stage = 0; stage < 4; ++stage) {
        for (i = 0; i < 7; ++i) at[i] = start[i] + PART[stage] * h * slope[i];
        cohaptic_turn_slope(inertia, damping, at, torque, slope);
        for (i = 0; i < 7; ++i) sum[i] += WEIGHT[stage] * slope[i];
    }
    for (i = 0; i < 7; ++i) start[i] += h / 6 * sum[i];
    for (i = 0; i < 4; ++i) norm += start[i] * start[i];
    for (i = 0; i < 4; ++i) body->quaternion[i] = start[i] / sqrt(norm);
    for (i = 0; i < 3; ++i) body->rate[i] = start[4 + i];
}

/* --- The peer: no socket, no clock --------------------------------------------------------------------------------------------------------------- */

typedef struct {
    double stiffness, damping; /* [N/m, N.s/m] */
} cohaptic_gains;

typedef enum { COHAPTIC_AVERAGE_POSITION, COHAPTIC_PROPORTIONAL_DERIVATIVE } cohaptic_law;

/* Keys of the scene that a peer needs. The values must be those of the scene that the session runs. */
typedef struct {
    cohaptic_gains coupling;       /* KC, BC; both 0 if no device holds the copy */
    cohaptic_gains coordination;   /* KT, BT */
    cohaptic_law law;
    double object_mass;            /* of the whole object [kg]; each copy has its share */
    double object_damping;         /* of each copy [N.s/m] */
    double inertia[3], grasp[3];   /* of the whole object [kg.m2] and of the grasp point [m]; used if the object turns */
    cohaptic_state start;          /* of the copy; the device is taken to begin there too */
    uint32_t exchange_every;       /* E: the device is read and pushed at each E-th tick */
    uint8_t exchange_age;          /* a: 0 if the force comes from the reading of the exchange, 1 if from the one before */
} cohaptic_scene;

enum {
    COHAPTIC_HELLO_EVERY = 250000000, /* [ns] */
    COHAPTIC_SILENCE = 1000000000     /* without anything new from anybody for so long, the peer begins anew [ns] */
};

/* Sample held from another peer: the sample with the highest number, or the initial state before the first sample. */
typedef struct {
    cohaptic_state state;
    cohaptic_matrix matrix; /* of its attitude */
    double world_rate[3];   /* angular velocity in the axes of the world */
    uint64_t newest, received, late;
    int64_t heard_at; /* [ns]; -1 before the first sample */
    uint8_t has_newest;
} cohaptic_sender;

typedef struct {
    cohaptic_session session;
    cohaptic_scene scene;
    double h;                  /* Tc [s] */
    uint64_t ticks_per_update; /* M */
    cohaptic_step step;        /* of the copy */
    cohaptic_state copy;
    cohaptic_attitude attitude;
    cohaptic_state reading, read_before; /* r of docs/model.md, and the state that was read at the latest exchange */
    double weight;            /* share of FC that is in force, 0 to 1 */
    double coupling[3];       /* FC on the copy at the latest tick [N] */
    double on_hand[3];        /* -G, the force on the device until the next exchange [N] */
    cohaptic_sender others[COHAPTIC_MAX_PEERS]; /* by place; that of this peer is not used */
    uint64_t sent, ignored, joinings;
    int64_t heard_at, hello_at; /* anything new from anybody; next hello [ns] */
    uint8_t keyed, rejoining, other_session;
    uint8_t key[COHAPTIC_KEY];
    uint64_t fingerprint;
    char label[9];
    cohaptic_joining joined, asked;
} cohaptic_peer;

/* Makes a peer at the time `now` [ns]. Returns NULL, or what does not fit together. Without a key nothing else is needed; with one, set `keyed`, `key`,
 * `joined` and `joinings` = 1 afterwards, as cohaptic_open() does. */
static inline const char *cohaptic_peer_begin(cohaptic_peer *peer, const cohaptic_session *session, const cohaptic_scene *scene, int64_t now) {
    static const double UPRIGHT[4] = {1, 0, 0, 0};
    uint32_t i;
    if (session->axes < 1 || session->axes > 3 || session->turns > 1 || session->place >= session->peers || session->tick_ns == 0 ||
        session->tick_ns > 1000000000)
        return "place, peers, axes and periods do not fit together";
    if (session->peers > COHAPTIC_MAX_PEERS)
        return "the scene has more peers than COHAPTIC_MAX_PEERS: define a larger number before cohaptic_peer.h is included";
    if (session->turns && (session->axes != 3 || !(scene->inertia[0] > 0 && scene->inertia[1] > 0 && scene->inertia[2] > 0)))
        return "the object of the session turns: the scene needs its inertia, and three axes";
    if (!session->turns && (scene->inertia[0] != 0 || scene->inertia[1] != 0 || scene->inertia[2] != 0))
        return "the scene has an inertia, and the object of the session does not turn";
    if (!(scene->object_mass > 0) || scene->exchange_every < 1 || scene->exchange_age > 1)
        return "mass and exchange-every must be above 0, and exchange-age 0 or 1";
    memset(peer, 0, sizeof *peer);
    peer->session = *session, peer->scene = *scene;
    peer->h = 1e-9 * (double)session->tick_ns;
    peer->ticks_per_update = (session->update_ns + session->tick_ns / 2) / session->tick_ns;
    if (peer->ticks_per_update < 1) peer->ticks_per_update = 1;
    peer->step = cohaptic_step_of(scene->object_mass / session->peers, scene->object_damping, peer->h);
    peer->copy = scene->start;
    peer->attitude.quaternion[0] = 1;
    peer->reading = scene->start;
    for (i = 0; session->turns && i < 3; ++i) peer->reading.position[i] += scene->grasp[i];
    peer->read_before = peer->reading;
    peer->weight = 1;
    peer->heard_at = now;
    for (i = 0; i < session->peers; ++i) {
        peer->others[i].state = scene->start;
        peer->others[i].matrix = cohaptic_matrix_of(UPRIGHT);
        peer->others[i].heard_at = -1;
    }
    return NULL;
}

/* Writes the sample that is due at tick `k`, sealed if the session has a key. Returns its length, or 0 if no sample is due. */
static inline size_t cohaptic_peer_sample(cohaptic_peer *peer, uint64_t k, uint8_t out[COHAPTIC_DATAGRAM]) {
    cohaptic_sample sample;
    size_t len;
    if (k % peer->ticks_per_update != 0) return 0;
    sample.sender = peer->session.place, sample.number = peer->sent++, sample.sent_ns = k * peer->session.tick_ns;
    sample.state = peer->copy, sample.attitude = peer->attitude;
    len = cohaptic_encode(&peer->session, &sample, out);
    return peer->keyed ? cohaptic_seal(&peer->joined, out, len) : len;
}

static inline void cohaptic_forget_numbers(cohaptic_peer *peer) {
    uint32_t i;
    for (i = 0; i < peer->session.peers; ++i) peer->others[i].has_newest = 0;
}

/* Takes in a datagram that arrived at `now` [ns]. Returns 0, counts and changes nothing else if the datagram is nothing that this peer may believe. */
static inline int cohaptic_peer_take(cohaptic_peer *peer, const uint8_t *bytes, size_t len, int64_t now) {
    cohaptic_session told = peer->session;
    cohaptic_sample sample;
    cohaptic_sender *other;
    size_t plain;
    if (peer->rejoining && cohaptic_welcome(peer->key, bytes, len, &told, &peer->asked)) {
        /* The session was started again. Another scene under the same number would make every force wrong: the loop ends then. */
        peer->other_session = (uint8_t)(told.axes != peer->session.axes || told.turns != peer->session.turns || told.peers != peer->session.peers ||
                                        told.tick_ns != peer->session.tick_ns || told.update_ns != peer->session.update_ns);
        peer->joined = peer->asked, peer->rejoining = 0, peer->heard_at = now;
        ++peer->joinings;
        cohaptic_forget_numbers(peer);
        return 1;
    }
    plain = peer->keyed ? cohaptic_opened(&peer->joined, bytes, len) : len;
    if (plain == 0 || !cohaptic_decode(&peer->session, bytes, plain, &sample) || sample.sender >= peer->session.peers ||
        sample.sender == peer->session.place) {
        ++peer->ignored;
        return 0;
    }
    other = &peer->others[sample.sender];
    ++other->received;
    if (other->has_newest && sample.number <= other->newest) {
        ++other->late;
        return 1;
    }
    other->newest = sample.number, other->has_newest = 1, other->heard_at = now, other->state = sample.state;
    if (peer->session.turns) {
        other->matrix = cohaptic_matrix_of(sample.attitude.quaternion);
        cohaptic_to_world(&other->matrix, sample.attitude.rate, other->world_rate);
    }
    peer->heard_at = now;
    return 1;
}

/* Returns whether nothing new was heard from anybody for a second. A scene of one peer has nobody to hear. */
static inline int cohaptic_peer_is_in_silence(const cohaptic_peer *peer, int64_t now) {
    return peer->session.peers > 1 && now - peer->heard_at >= COHAPTIC_SILENCE;
}

/* Begins anew after silence, because the session may have been started again: its numbers begin at 0 then, and the keys of the joining are worth nothing.
 * `nonce`: fresh random bytes. Writes a hello and returns its length if a hello is due, otherwise 0. */
static inline size_t cohaptic_peer_begin_anew(cohaptic_peer *peer, int64_t now, const uint8_t nonce[COHAPTIC_NONCE], uint8_t out[COHAPTIC_DATAGRAM]) {
    if (!cohaptic_peer_is_in_silence(peer, now)) {
        peer->rejoining = 0;
        return 0;
    }
    if (!peer->keyed) {
        cohaptic_forget_numbers(peer);
        return 0;
    }
    if (now < peer->hello_at) return 0;
    if (!peer->rejoining) memcpy(peer->asked.nonce, nonce, COHAPTIC_NONCE);
    peer->rejoining = 1, peer->hello_at = now + COHAPTIC_HELLO_EVERY;
    cohaptic_hello(peer->key, &peer->session, peer->asked.nonce, peer->fingerprint, peer->label, out);
    return COHAPTIC_HANDSHAKE;
}

/* Computes the torque on the copy in its own axes [N.m]: r x R'FC - t with t = BR.(w - R'w_mean) - 2*vee sk(R'M_mean*P), P = diag(sum(KR)/2 - KR). */
static inline void cohaptic_peer_torque(const cohaptic_peer *peer, const cohaptic_matrix *r, const double over_mass[3], cohaptic_gains gains,
                                        double torque[3]) {
    const double others = peer->session.peers - 1.0, sum = gains.stiffness * (over_mass[0] + over_mass[1] + over_mass[2]);
    double apart[3][3], lever[3], world_rate[3] = {0}, rate[3], column[3], out[3];
    cohaptic_matrix mean;
    uint32_t place;
    int i, j;
    cohaptic_to_body(r, peer->coupling, lever);
    cohaptic_cross(peer->scene.grasp, lever, torque);
    if (peer->session.peers < 2) return;
    memset(&mean, 0, sizeof mean);
    for (place = 0; place < peer->session.peers; ++place) {
        if (place == peer->session.place) continue;
        for (i = 0; i < 3; ++i) {
            world_rate[i] += peer->others[place].world_rate[i] / others;
            for (j = 0; j < 3; ++j) mean.m[i][j] += peer->others[place].matrix.m[i][j] / others;
        }
    }
    cohaptic_to_body(r, world_rate, rate);
    for (j = 0; j < 3; ++j) {
        for (i = 0; i < 3; ++i) column[i] = mean.m[i][j];
        cohaptic_to_body(r, column, out);
        for (i = 0; i < 3; ++i) apart[i][j] = (sum / 2 - gains.stiffness * over_mass[j]) * out[i];
    }
    for (i = 0; i < 3; ++i) {
        const int a = (i + 1) % 3, b = (i + 2) % 3;
        torque[i] += apart[b][a] - apart[a][b] - gains.damping * over_mass[i] * (peer->attitude.rate[i] - rate[i]);
    }
}

/* Returns whether the device is read and pushed at tick `k`. */
static inline int cohaptic_peer_exchanges(const cohaptic_peer *peer, uint64_t k) { return k % peer->scene.exchange_every == 0; }

/* Computes the forces of tick `k` and moves the copy to the next tick. At an exchange `device` is the state read now, or NULL if nothing could be read, and
 * `on_hand` becomes the new force. `push`: a force on the copy beside that of the device [N], or NULL. */
static inline void cohaptic_peer_tick(cohaptic_peer *peer, uint64_t k, const cohaptic_state *device, const double *push) {
    const cohaptic_scene *const scene = &peer->scene;
    cohaptic_gains gains = scene->coordination;
    cohaptic_matrix r;
    double arm[3] = {0}, swing[3] = {0}, spin[3], over_mass[3], inertia[3], damping[3], torque[3];
    uint32_t place;
    int i;
    if (cohaptic_peer_exchanges(peer, k) && device) {
        peer->reading = scene->exchange_age ? peer->read_before : *device;
        peer->read_before = *device;
    }
    if (scene->law == COHAPTIC_PROPORTIONAL_DERIVATIVE) {
        /* PD(K, B) = AP((N-1)*K, (N-1)*B), as docs/model.md shows. */
        gains.stiffness *= peer->session.peers - 1.0, gains.damping *= peer->session.peers - 1.0;
    }
    if (peer->session.turns) {
        /* The device holds the grasp point: xO + R*r with the velocity vO + R*(w x r). */
        r = cohaptic_matrix_of(peer->attitude.quaternion);
        cohaptic_cross(peer->attitude.rate, scene->grasp, spin);
        cohaptic_to_world(&r, scene->grasp, arm);
        cohaptic_to_world(&r, spin, swing);
    }
    for (i = 0; i < peer->session.axes; ++i) {
        const double x = peer->copy.position[i], v = peer->copy.velocity[i], others = peer->session.peers - 1.0;
        /* (9) FC = KC*(xH - xO) + BC*(vH - vO), the force of the device on the copy. */
        const double stretch = peer->reading.position[i] - x - arm[i], speed = peer->reading.velocity[i] - v - swing[i];
        /* (10) FT = KT*(xO - xd) + BT*(vO - vd), towards the mean of the samples held from the others. */
        double target = 0, target_speed = 0, coordination = 0;
        peer->coupling[i] = peer->weight * (scene->coupling.stiffness * stretch + scene->coupling.damping * speed);
        if (peer->session.peers > 1) {
            for (place = 0; place < peer->session.peers; ++place) {
                if (place == peer->session.place) continue;
                target += peer->others[place].state.position[i] / others;
                target_speed += peer->others[place].state.velocity[i] / others;
            }
            coordination = gains.stiffness * (x - target) + gains.damping * (v - target_speed);
        }
        if (cohaptic_peer_exchanges(peer, k)) peer->on_hand[i] = -peer->coupling[i];
        cohaptic_move(&peer->step, &peer->copy, i, peer->coupling[i] - coordination + (push ? push[i] : 0));
    }
    if (peer->session.turns) {
        /* Gains and damping of the turn are those of the translation times J/m, as if each element of the mass were alone. */
        for (i = 0; i < 3; ++i) {
            over_mass[i] = scene->inertia[i] / scene->object_mass;
            inertia[i] = scene->inertia[i] / peer->session.peers;
            damping[i] = scene->object_damping * over_mass[i];
        }
        cohaptic_peer_torque(peer, &r, over_mass, gains, torque);
        cohaptic_turn(inertia, damping, peer->h, &peer->attitude, torque);
    }
}

/* Returns whether the copy is still at a place that a number can tell. */
static inline int cohaptic_peer_is_finite(const cohaptic_peer *peer) {
    int i, finite = 1;
    for (i = 0; i < 3; ++i) finite &= isfinite(peer->copy.position[i]) && isfinite(peer->copy.velocity[i]);
    return finite;
}

/* --- The gate ------------------------------------------------------------------------------------------------------------------------------------ */

/* Flag that a signal handler and any thread may set. */
typedef volatile int cohaptic_flag;
#if defined(__GNUC__) || defined(__clang__)
#define COHAPTIC_SET(flag) __atomic_store_n(&(flag), 1, __ATOMIC_SEQ_CST)
#define COHAPTIC_IS_SET(flag) (__atomic_load_n(&(flag), __ATOMIC_SEQ_CST) != 0)
#else
#define COHAPTIC_SET(flag) ((flag) = 1)
#define COHAPTIC_IS_SET(flag) ((flag) != 0)
#endif

/* Causes of zero force, in the order of the checks. */
typedef enum {
    COHAPTIC_STOPPED,                /* for good */
    COHAPTIC_NOT_READY,              /* the device is not ready, so its position means nothing */
    COHAPTIC_NOT_ARMED,              /* the person has not switched forces on */
    COHAPTIC_STALE_READING,          /* nothing was read for longer than `reading_age_ns` */
    COHAPTIC_STALE_SETPOINT,         /* no force was asked for within `setpoint_age_ns` */
    COHAPTIC_LOOP_LATE,              /* the loop has paused for longer than `gap_ns` */
    COHAPTIC_NOT_FINITE,             /* a component is infinite or NaN */
    COHAPTIC_CAUSES,                 /* number of causes */
    COHAPTIC_FORCE = COHAPTIC_CAUSES /* no cause: a force passed */
} cohaptic_cause;

static inline const char *cohaptic_cause_name(int cause) {
    static const char *const NAMES[] = {"stopped", "not ready", "not armed", "stale reading", "stale setpoint", "loop late", "not finite", "force"};
    return cause >= 0 && cause <= COHAPTIC_FORCE ? NAMES[cause] : "unknown";
}

typedef struct {
    double force;          /* largest force [N] */
    double slew;           /* fastest change of a force [N/s] */
    int64_t reading_age_ns, setpoint_age_ns, gap_ns;
} cohaptic_limits;

/* Returns the usual limits: 3 N, 1000 N/s, readings of 10 ms or 3 exchanges, setpoints of 50 ms, pauses of 20 ms. */
static inline cohaptic_limits cohaptic_usual_limits(uint32_t exchange_every, uint64_t tick_ns) {
    cohaptic_limits limits = {3, 1000, 10000000, 50000000, 20000000};
    const int64_t three = 3 * (int64_t)exchange_every * (int64_t)tick_ns;
    if (three > limits.reading_age_ns) limits.reading_age_ns = three;
    return limits;
}

#define COHAPTIC_NEVER INT64_MIN

typedef struct {
    int64_t now;                    /* [ns] */
    int ready, armed;
    int64_t reading_at, setpoint_at; /* [ns], or COHAPTIC_NEVER */
} cohaptic_moment;

/* Gate, which every force to a device passes. After zero, a force grows from zero at most as fast as `slew` allows. */
typedef struct {
    cohaptic_limits limits;
    double last[3];
    int64_t last_at;
    cohaptic_flag stopped;
    uint64_t counts[COHAPTIC_CAUSES + 1]; /* by cause, then of forces that passed */
} cohaptic_gate;

static inline void cohaptic_gate_begin(cohaptic_gate *gate, const cohaptic_limits *limits) {
    memset(gate, 0, sizeof *gate);
    gate->limits = *limits, gate->last_at = COHAPTIC_NEVER;
}

/* Makes every later force zero, for good. May be called from any thread and from a signal handler, as often as one likes. */
static inline void cohaptic_gate_stop(cohaptic_gate *gate) { COHAPTIC_SET(gate->stopped); }

/* Shortens a vector of finite components to the length `longest` if it is longer. */
static inline void cohaptic_shorten(double v[3], double longest) {
    /* Squares and even the length of finite components can overflow, so a vector is first scaled to components of at most 1. */
    const double largest = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
    double length;
    int i;
    if (largest == 0) return;
    length = sqrt((v[0] / largest) * (v[0] / largest) + (v[1] / largest) * (v[1] / largest) + (v[2] / largest) * (v[2] / largest));
    if (largest <= longest / length) return;
    for (i = 0; i < 3; ++i) v[i] = v[i] / largest / length * longest;
}

/* Returns whether `at` is at most `age` before `now`. An instant in the future is not fresh either: a clock that jumps back must not keep an old force. */
static inline int cohaptic_is_fresh(int64_t now, int64_t at, int64_t age) { return at != COHAPTIC_NEVER && at <= now && now - at <= age; }

/* Writes the force that may go to the device, and returns COHAPTIC_FORCE or why the force is zero. Must be called once for each push, because the calls
 * measure the time between pushes. */
static inline cohaptic_cause cohaptic_gate_admit(cohaptic_gate *gate, const double wanted[3], const cohaptic_moment *moment, double out[3]) {
    const int64_t passed = gate->last_at == COHAPTIC_NEVER ? 0 : moment->now - gate->last_at;
    const int read = cohaptic_is_fresh(moment->now, moment->reading_at, gate->limits.reading_age_ns);
    const int asked = cohaptic_is_fresh(moment->now, moment->setpoint_at, gate->limits.setpoint_age_ns);
    cohaptic_cause cause = COHAPTIC_FORCE;
    double change[3];
    int i;
    gate->last_at = moment->now;
    if (COHAPTIC_IS_SET(gate->stopped)) cause = COHAPTIC_STOPPED;
    else if (!moment->ready) cause = COHAPTIC_NOT_READY;
    else if (!moment->armed) cause = COHAPTIC_NOT_ARMED;
    else if (!read) cause = COHAPTIC_STALE_READING;
    else if (!asked) cause = COHAPTIC_STALE_SETPOINT;
    else if (passed < 0 || passed > gate->limits.gap_ns) cause = COHAPTIC_LOOP_LATE;
    else if (!isfinite(wanted[0]) || !isfinite(wanted[1]) || !isfinite(wanted[2])) cause = COHAPTIC_NOT_FINITE;
    ++gate->counts[cause];
    if (cause != COHAPTIC_FORCE) {
        memset(gate->last, 0, sizeof gate->last);
        memset(out, 0, sizeof gate->last);
        return cause;
    }
    memcpy(out, wanted, sizeof gate->last);
    cohaptic_shorten(out, gate->limits.force);
    /* Both ends of the change are within the limit of force, and so are all points between the ends. */
    for (i = 0; i < 3; ++i) change[i] = out[i] - gate->last[i];
    cohaptic_shorten(change, gate->limits.slew * ((double)passed / 1e9));
    for (i = 0; i < 3; ++i) out[i] = gate->last[i] += change[i];
    return COHAPTIC_FORCE;
}

/* --- The device ---------------------------------------------------------------------------------------------------------------------------------- */

typedef enum {
    COHAPTIC_READ_NOTHING,   /* no reading: `state` was not written, and the reading before grows old */
    COHAPTIC_READ_NOT_READY, /* the device is not calibrated or not powered: `state` means nothing */
    COHAPTIC_READ_NOT_ARMED, /* `state` is valid, and the person has not switched forces on: the hand feels and moves nothing */
    COHAPTIC_READ            /* `state` is valid, and forces may come */
} cohaptic_reading;

/* A device. `read` and `push` are called by the loop at each exchange and must not block: together 50 us at most, so that input and output belong to a
 * thread of the device. In C++ none of the functions may throw. */
typedef struct {
    /* Writes the newest state. Returns a cohaptic_reading. */
    int (*read)(void *self, cohaptic_state *state);
    /* Takes the force on the hand [N], which has passed the gate. Zero when nothing may be felt. */
    void (*push)(void *self, const double force[3]);
    /* Switches all forces off, for good. The loop calls stop at its end, whatever ended the loop. Must be harmless when called twice and from any thread:
     * after stop, push must do nothing. */
    void (*stop)(void *self);
    void *self;
} cohaptic_device;

/* --- The client: a peer with a socket and a clock ------------------------------------------------------------------------------------------------ */

typedef struct {
    const char *door;         /* HOST:PORT of the session; an IPv6 address in brackets */
    const char *key_file;     /* file of 64 hexadecimal digits that only its owner may read, or NULL for a session without a key */
    cohaptic_session session; /* number and place; without a key everything */
    cohaptic_scene scene;
    uint64_t fingerprint;     /* of the scene, which the session prints and compares; 0 if unknown */
    const char *label;        /* of the device, for displays: at most 8 printable ASCII characters without a space; NULL for none */
    double patience;          /* how long a welcome may take [s] */
    double fade;              /* time in which the pull of the device comes and goes [s] */
    double force_limit;       /* [N] */
} cohaptic_options;

/* Returns options with the usual values: axes 1, ticks of 1 ms, updates of 8 ms, an object of 0.45 kg, KC 3500, BC 5, KT 300, BT 5, 3 N. */
static inline cohaptic_options cohaptic_usual(void) {
    cohaptic_options options;
    memset(&options, 0, sizeof options);
    options.session.axes = 1, options.session.peers = 2;
    options.session.tick_ns = 1000000, options.session.update_ns = 8000000;
    options.scene.coupling.stiffness = 3500, options.scene.coupling.damping = 5;
    options.scene.coordination.stiffness = 300, options.scene.coordination.damping = 5;
    options.scene.object_mass = 0.45, options.scene.exchange_every = 1;
    options.patience = 10, options.fade = 0.25, options.force_limit = 3;
    return options;
}

typedef struct {
    cohaptic_peer peer;
    cohaptic_gate gate;
    cohaptic_options options;
    cohaptic_socket socket;
    int has_socket;
    uint64_t ticks; /* made so far */
    char error[256];
} cohaptic_client;

/* Returns the time of a clock that never goes back [ns]. */
static inline int64_t cohaptic_now(void) {
#ifdef _WIN32
    LARGE_INTEGER count, rate;
    QueryPerformanceCounter(&count);
    QueryPerformanceFrequency(&rate);
    return (int64_t)(count.QuadPart / rate.QuadPart) * 1000000000 + (int64_t)(count.QuadPart % rate.QuadPart) * 1000000000 / (int64_t)rate.QuadPart;
#else
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
#endif
}

/* Waits until the time `at` [ns], or until a signal comes. */
static inline void cohaptic_wait_until(int64_t at) {
    const int64_t left = at - cohaptic_now();
#ifdef _WIN32
    /* Sleep() wakes up to a millisecond late, even with timeBeginPeriod(1): the last two milliseconds are spent in a loop. */
    if (left > 3000000) Sleep((DWORD)(left / 1000000 - 2));
    while (cohaptic_now() < at) YieldProcessor();
#else
    struct timespec span;
    if (left <= 0) return;
    span.tv_sec = (time_t)(left / 1000000000), span.tv_nsec = (long)(left % 1000000000);
    nanosleep(&span, NULL);
#endif
}

/* Fills `out` with random bytes of the system. Returns 0 if the system has none. */
static inline int cohaptic_random(uint8_t *out, size_t len) {
#ifdef _WIN32
    return BCryptGenRandom(NULL, out, (ULONG)len, BCRYPT_USE_SYSTEM_PREFERRED_RNG) == 0;
#else
    FILE *const file = fopen("/dev/urandom", "rb");
    const int read = file != NULL && fread(out, 1, len, file) == len;
    if (file) fclose(file);
    return read;
#endif
}

/* Reads a key file. Returns NULL, or why the file is no key file. */
static inline const char *cohaptic_read_key(const char *path, uint8_t key[COHAPTIC_KEY]) {
    char text[80] = {0};
    size_t i, len;
    FILE *const file = fopen(path, "rb");
    if (!file) return "the key file cannot be opened";
#ifndef _WIN32
    {
        struct stat facts;
        if (fstat(fileno(file), &facts) != 0 || (facts.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
            fclose(file);
            return "others than the owner may read the key file: chmod 600 makes it private";
        }
    }
#endif
    len = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    while (len > 0 && strchr(" \t\r\n", text[len - 1]) != NULL) text[--len] = 0;
    if (len != 2 * COHAPTIC_KEY || strspn(text, "0123456789abcdefABCDEF") != len) return "the key file must hold 64 hexadecimal digits";
    for (i = 0; i < COHAPTIC_KEY; ++i) {
        char digits[3] = {0};
        memcpy(digits, text + 2 * i, 2);
        key[i] = (uint8_t)strtoul(digits, NULL, 16);
    }
    return NULL;
}

/* Sends a datagram. A datagram that cannot be sent is lost: the next sample says more. */
static inline void cohaptic_send(cohaptic_client *client, const uint8_t *bytes, size_t len) {
    if (len > 0 && send(client->socket, (const char *)bytes, (cohaptic_len)len, 0) < 0) return;
}

/* Receives a datagram into a buffer larger than any datagram of the protocol, so that a longer datagram is not cut to a valid datagram. Returns the length
 * of the datagram, or -1 if no datagram is there. */
static inline long cohaptic_receive(cohaptic_client *client, uint8_t out[2048]) {
    int tries;
    for (tries = 0; tries < 8; ++tries) {
        const long len = (long)recv(client->socket, (char *)out, 2048, 0);
        if (len >= 0) return len;
#ifdef _WIN32
        if (WSAGetLastError() == WSAEWOULDBLOCK) return -1;
#else
        if (errno == EAGAIN || errno == EWOULDBLOCK) return -1;
#endif
        /* Any other error reports an earlier datagram that found nobody, or a signal: ask again. */
    }
    return -1;
}

/* Closes the socket. Harmless for a client of zeros, and when called twice. */
static inline void cohaptic_close(cohaptic_client *client) {
    if (!client->has_socket) return;
#ifdef _WIN32
    closesocket(client->socket);
    timeEndPeriod(1);
    WSACleanup();
#else
    close(client->socket);
#endif
    client->has_socket = 0;
}

/* Opens a socket that talks to the session alone: the system drops what comes from elsewhere. Returns NULL or an error. */
static inline const char *cohaptic_connect(cohaptic_client *client, const char *door) {
    char host[128];
    const char *const colon = strrchr(door, ':');
    const char *first = door;
    struct addrinfo hints, *found = NULL;
    size_t len = colon ? (size_t)(colon - door) : 0;
    int fault;
    if (len > 2 && door[0] == '[' && door[len - 1] == ']') ++first, len -= 2;
    if (len == 0 || len >= sizeof host) {
        snprintf(client->error, sizeof client->error, "%.100s is no HOST:PORT", door);
        return client->error;
    }
    memcpy(host, first, len);
    host[len] = 0;
#ifdef _WIN32
    {
        WSADATA data;
        if (WSAStartup(MAKEWORD(2, 2), &data) != 0) return "Winsock cannot be started";
        timeBeginPeriod(1);
    }
#endif
    memset(&hints, 0, sizeof hints);
    hints.ai_socktype = SOCK_DGRAM;
    fault = getaddrinfo(host, colon + 1, &hints, &found);
    if (fault != 0) {
        snprintf(client->error, sizeof client->error, "%.100s: %s", door, gai_strerror(fault));
        return client->error;
    }
    client->socket = socket(found->ai_family, found->ai_socktype, found->ai_protocol);
    client->has_socket = client->socket != COHAPTIC_NO_SOCKET;
    fault = !client->has_socket || connect(client->socket, found->ai_addr, (socklen_t)found->ai_addrlen) != 0;
    freeaddrinfo(found);
    if (!fault) {
#ifdef _WIN32
        u_long on = 1;
        fault = ioctlsocket(client->socket, FIONBIO, &on) != 0;
#else
        fault = fcntl(client->socket, F_SETFL, O_NONBLOCK) != 0;
#endif
    }
    if (fault) {
        snprintf(client->error, sizeof client->error, "no socket can be opened to %.100s: %s", door, strerror(errno));
        cohaptic_close(client);
        return client->error;
    }
    return NULL;
}

/* Says hello until the session answers, or for `patience` seconds. Returns NULL or an error. */
static inline const char *cohaptic_say_hello(cohaptic_client *client, const uint8_t key[COHAPTIC_KEY], cohaptic_session *session, cohaptic_joining *joining) {
    const cohaptic_options *const options = &client->options;
    const char *const label = options->label ? options->label : "";
    const int64_t until = cohaptic_now() + (int64_t)(1e9 * options->patience);
    int64_t next = cohaptic_now();
    uint8_t hello[COHAPTIC_HANDSHAKE], in[2048];
    cohaptic_hello(key, session, joining->nonce, options->fingerprint, label, hello);
    for (;;) {
        const int64_t now = cohaptic_now();
        long len;
        if (now >= until || COHAPTIC_IS_SET(client->gate.stopped)) break;
        if (now >= next) cohaptic_send(client, hello, sizeof hello), next = now + COHAPTIC_HELLO_EVERY;
        while ((len = cohaptic_receive(client, in)) >= 0) {
            if (cohaptic_welcome(key, in, (size_t)len, session, joining)) return NULL;
        }
        cohaptic_wait_until(now + 1000000);
    }
    snprintf(client->error, sizeof client->error, "no welcome for place %lu of session %llu within %g s: is the session up, and is the key the same?%s",
             (unsigned long)session->place, (unsigned long long)session->number, options->patience,
             options->fingerprint ? " Does the session print another fingerprint?" : "");
    return client->error;
}

static inline int cohaptic_is_label(const char *label) {
    size_t len = 0;
    while (label[len] > ' ' && label[len] < 0x7f) ++len;
    return label[len] == 0 && len <= 8;
}

/* Joins a session. Returns NULL, or a sentence that says what is wrong; cohaptic_close() is harmless then. */
static inline const char *cohaptic_open(cohaptic_client *client, const cohaptic_options *options) {
    const char *const label = options->label ? options->label : "";
    cohaptic_session session = options->session;
    cohaptic_joining joining;
    cohaptic_limits limits;
    uint8_t key[COHAPTIC_KEY];
    const char *error;
    memset(client, 0, sizeof *client);
    client->options = *options;
    /* Before the handshake, so that a stop during the handshake is not lost. */
    limits = cohaptic_usual_limits(options->scene.exchange_every, 0);
    cohaptic_gate_begin(&client->gate, &limits);
    if (!cohaptic_is_label(label)) return "a label has at most 8 printable ASCII characters, and no space";
    if (!(options->force_limit >= 0 && options->force_limit <= 20)) return "the limit of force must be within 0 to 20 N";
    if (options->key_file && (error = cohaptic_read_key(options->key_file, key)) != NULL) {
        snprintf(client->error, sizeof client->error, "%.128s: %s", options->key_file, error);
        return client->error;
    }
    if ((error = cohaptic_connect(client, options->door)) != NULL) return error;
    if (options->key_file) {
        if (!cohaptic_random(joining.nonce, sizeof joining.nonce)) return "the system gives no random bytes";
        if ((error = cohaptic_say_hello(client, key, &session, &joining)) != NULL) return error;
    }
    if ((error = cohaptic_peer_begin(&client->peer, &session, &options->scene, cohaptic_now())) != NULL) return error;
    if (options->key_file) {
        client->peer.keyed = 1, client->peer.joinings = 1, client->peer.joined = joining;
        memcpy(client->peer.key, key, sizeof key);
        client->peer.fingerprint = options->fingerprint;
        memcpy(client->peer.label, label, strlen(label));
    }
    limits = cohaptic_usual_limits(options->scene.exchange_every, session.tick_ns);
    limits.force = options->force_limit;
    client->gate.limits = limits;
    return NULL;
}

/* Ends cohaptic_run(), and with it every force, within a tick. May be called from any thread and from a signal handler, as often as one likes. */
static inline void cohaptic_stop(cohaptic_client *client) { cohaptic_gate_stop(&client->gate); }

/* Steps 1 and 2 of tick `k`: sends the sample that is due, takes in what has arrived, and begins anew after silence. */
static inline void cohaptic_exchange(cohaptic_client *client, uint64_t k) {
    uint8_t out[COHAPTIC_DATAGRAM], in[2048], nonce[COHAPTIC_NONCE] = {0};
    cohaptic_peer *const peer = &client->peer;
    const int64_t now = cohaptic_now();
    int n;
    cohaptic_send(client, out, cohaptic_peer_sample(peer, k, out));
    /* No more datagrams at one tick than can be new, so that a flood cannot stop the loop. */
    for (n = 0; n < COHAPTIC_MAX_PEERS; ++n) {
        const long len = cohaptic_receive(client, in);
        if (len < 0) break;
        cohaptic_peer_take(peer, in, (size_t)len, now);
    }
    /* Random bytes are read only if a hello with a new nonce may be due. */
    if (peer->keyed && !peer->rejoining && cohaptic_peer_is_in_silence(peer, now) && !cohaptic_random(nonce, sizeof nonce)) return;
    cohaptic_send(client, out, cohaptic_peer_begin_anew(peer, now, nonce, out));
}

/* Returns NULL, or why the loop cannot go on. */
static inline const char *cohaptic_fault(const cohaptic_client *client) {
    if (client->peer.other_session) return "the session was started again with another scene";
    if (!cohaptic_peer_is_finite(&client->peer)) return "the copy has diverged: the scene is unstable with this device";
    return NULL;
}

static inline void cohaptic_print_numbers(const char *name, const double *numbers, int count) {
    int i;
    printf(", \"%s\": [", name);
    for (i = 0; i < count; ++i) printf("%s%.17g", i ? ", " : "", numbers[i]);
    printf("]");
}

/* Prints what happened as one line of JSON. `device`: the state of a simulated device at the end, or NULL. */
static inline void cohaptic_print_summary(const cohaptic_client *client, const cohaptic_state *device) {
    const cohaptic_peer *const peer = &client->peer;
    const int axes = peer->session.axes;
    const int64_t now = cohaptic_now(), stale_after = 100000000;
    const char *comma = "";
    uint32_t place;
    int cause;
    printf("{\"place\": %lu, \"ticks\": %llu", (unsigned long)peer->session.place, (unsigned long long)client->ticks);
    printf(", \"sent\": %llu", (unsigned long long)peer->sent);
    printf(", \"joinings\": %llu, \"ignored\": %llu", (unsigned long long)peer->joinings, (unsigned long long)peer->ignored);
    cohaptic_print_numbers("position", peer->copy.position, axes);
    cohaptic_print_numbers("velocity", peer->copy.velocity, axes);
    if (device) cohaptic_print_numbers("device", device->position, axes), cohaptic_print_numbers("device_velocity", device->velocity, axes);
    if (peer->session.turns) cohaptic_print_numbers("orientation", peer->attitude.quaternion, 4);
    /* Pushes by the cause of zero force. */
    printf(", \"pushes\": {");
    for (cause = 0; cause <= COHAPTIC_FORCE; ++cause) {
        if (client->gate.counts[cause] == 0) continue;
        printf("%s\"%s\": %llu", comma, cohaptic_cause_name(cause), (unsigned long long)client->gate.counts[cause]);
        comma = ", ";
    }
    printf("}, \"others\": [");
    comma = "";
    for (place = 0; place < peer->session.peers; ++place) {
        const cohaptic_sender *const other = &peer->others[place];
        const int stale = other->heard_at < 0 || now - other->heard_at > stale_after;
        if (place == peer->session.place) continue;
        printf("%s{\"sender\": %lu, \"received\": %llu", comma, (unsigned long)place, (unsigned long long)other->received);
        printf(", \"late\": %llu, \"stale\": %s}", (unsigned long long)other->late, stale ? "true" : "false");
        comma = ", ";
    }
    printf("]}\n");
}

/* The loop: holds the device for `seconds` (INFINITY: until cohaptic_stop()), in ticks at fixed times. A late tick is made up for, so that the time of the
 * peer never falls behind for good. Stops the device at the end. Returns NULL, or what ended the loop early. */
static inline const char *cohaptic_run(cohaptic_client *client, const cohaptic_device *device, double seconds) {
    static const double NOTHING[3] = {0, 0, 0};
    cohaptic_peer *const peer = &client->peer;
    cohaptic_moment moment = {0, 0, 0, COHAPTIC_NEVER, COHAPTIC_NEVER};
    const int64_t tick_ns = (int64_t)peer->session.tick_ns, began = cohaptic_now();
    const double ticks = floor(seconds * 1e9 / (double)tick_ns + 0.5), per_tick = client->options.fade > 0 ? peer->h / client->options.fade : 1;
    const char *error = NULL;
    cohaptic_state state = peer->reading;
    double force[3];
    int device_is_felt = 0;
    uint64_t k;
    if (peer->scene.exchange_every * (double)tick_ns > (double)client->gate.limits.gap_ns) error = "exchange-every ticks must be at most 20 ms";
    peer->weight = 0;
    for (k = 0; !error && (double)k < ticks && !COHAPTIC_IS_SET(client->gate.stopped); ++k) {
        const int exchanges = cohaptic_peer_exchanges(peer, k);
        cohaptic_wait_until(began + (int64_t)k * tick_ns);
        cohaptic_exchange(client, k);
        moment.now = cohaptic_now();
        if (exchanges) {
            const int read = device->read(device->self, &state);
            const int finite = isfinite(state.position[0]) && isfinite(state.position[1]) && isfinite(state.position[2]) && isfinite(state.velocity[0]) &&
                               isfinite(state.velocity[1]) && isfinite(state.velocity[2]);
            if (read != COHAPTIC_READ_NOTHING) moment.ready = read != COHAPTIC_READ_NOT_READY, moment.armed = read == COHAPTIC_READ;
            /* A reading that cannot be used has no effect: the reading before stays, and grows old. */
            if (read != COHAPTIC_READ_NOTHING && moment.ready && finite) moment.reading_at = moment.now;
            else state = peer->read_before;
            device_is_felt = moment.ready && moment.armed && cohaptic_is_fresh(moment.now, moment.reading_at, client->gate.limits.reading_age_ns);
        }
        /* A device that cannot be read, or may not be felt, fades out of the copy and comes back as slowly, so that the others feel no jump. */
        peer->weight = device_is_felt ? fmin(1, peer->weight + per_tick) : fmax(0, peer->weight - per_tick);
        cohaptic_peer_tick(peer, k, &state, NULL);
        client->ticks = k + 1;
        /* In a silent session no force is asked for, because no other peer can be felt. */
        if (!cohaptic_peer_is_in_silence(peer, moment.now)) moment.setpoint_at = moment.now;
        if (exchanges) {
            cohaptic_gate_admit(&client->gate, peer->on_hand, &moment, force);
            device->push(device->self, force);
        }
        error = cohaptic_fault(client);
    }
    cohaptic_gate_stop(&client->gate);
    device->push(device->self, NOTHING);
    device->stop(device->self);
    return error;
}

#endif
