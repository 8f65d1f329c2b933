/* Tests of docs/examples/cohaptic_peer.h in C99, against published vectors, the worked examples of docs/live-protocol.md and the figures of the program.
 *
 *     header docs/examples/live-protocol.txt
 */
#include "cohaptic_peer.h"

#include <ctype.h>
#include <signal.h>

static int faults = 0;

static void check(int right, const char *what, int line) {
    if (!right) fprintf(stderr, "header.c:%d: %s\n", line, what), ++faults;
}
#define CHECK(condition) check((condition) != 0, #condition, __LINE__)

static size_t from_hex(const char *text, uint8_t *out) {
    size_t len = 0;
    for (; isxdigit((unsigned char)text[0]) && isxdigit((unsigned char)text[1]); text += 2) {
        const char digits[3] = {text[0], text[1], 0};
        out[len++] = (uint8_t)strtoul(digits, NULL, 16);
    }
    return len;
}

/* --- SHA-256 and HMAC: FIPS 180-4 examples, RFC 4231 cases 1 to 4, 6 and 7 ------------------------------------------------------------------------- */

static void hash_is(const char *text, size_t repeated, const char *hex) {
    uint8_t digest[32], expected[32];
    cohaptic_sha256 hash;
    cohaptic_sha256_begin(&hash);
    while (repeated-- > 0) cohaptic_sha256_take(&hash, text, strlen(text));
    cohaptic_sha256_end(&hash, digest);
    CHECK(from_hex(hex, expected) == 32 && memcmp(digest, expected, 32) == 0);
}

static void hmac_is(const uint8_t *key, size_t key_len, const void *message, size_t len, const char *hex) {
    uint8_t digest[32], expected[32];
    cohaptic_hmac(key, key_len, message, len, digest);
    CHECK(from_hex(hex, expected) == 32 && memcmp(digest, expected, 32) == 0);
}

static void published_vectors(void) {
    static const char *const LONG_KEY = "Test Using Larger Than Block-Size Key - Hash Key First";
    static const char *const LONG_BOTH = "This is a test using a larger than block-size key and a larger than block-size data. The key needs to "
                                         "be hashed before being used by the HMAC algorithm.";
    uint8_t key[131], data[50];
    int i;
    hash_is("", 1, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    hash_is("abc", 1, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    hash_is("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq", 1, "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    hash_is("a", 1000000, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
    memset(key, 0x0b, 20);
    hmac_is(key, 20, "Hi There", 8, "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7");
    hmac_is((const uint8_t *)"Jefe", 4, "what do ya want for nothing?", 28, "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
    memset(key, 0xaa, sizeof key);
    memset(data, 0xdd, sizeof data);
    hmac_is(key, 20, data, 50, "773ea91e36800e46854db8ebd09181a72959098b3ef8c122d9635514ced565fe");
    hmac_is(key, 131, LONG_KEY, strlen(LONG_KEY), "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54");
    hmac_is(key, 131, LONG_BOTH, strlen(LONG_BOTH), "9b09ffa71b942fcb27635fbcd5b0e944bfdc63644f0713938a7f51535c3a35e2");
    memset(data, 0xcd, sizeof data);
    for (i = 0; i < 25; ++i) key[i] = (uint8_t)(i + 1);
    hmac_is(key, 25, data, 50, "82558a389a443c0ea4cc819899f2083a85f0faa3e578f8077a2e3ff46729665b");
}

/* --- docs/examples/live-protocol.txt, byte by byte ------------------------------------------------------------------------------------------------- */

static size_t block(const char *path, const char *title, uint8_t *out) {
    char line[256];
    size_t len = 0;
    int inside = 0;
    FILE *const file = fopen(path, "r");
    CHECK(file != NULL);
    while (file && fgets(line, sizeof line, file)) {
        if (line[0] == '[') inside = strncmp(line + 1, title, strlen(title)) == 0 && line[1 + strlen(title)] == ']';
        else if (inside && isxdigit((unsigned char)line[0])) {
            /* An offset of four digits, two spaces, and up to 16 bytes with a space after each. */
            size_t at;
            for (at = 6; at < 6 + 48 && isxdigit((unsigned char)line[at]); at += 3) len += from_hex(line + at, out + len);
        }
    }
    if (file) fclose(file);
    return len;
}

static void worked_examples(const char *path) {
    cohaptic_session session, told;
    cohaptic_joining joining;
    cohaptic_sample sample;
    uint8_t key[32], expected[256], out[COHAPTIC_DATAGRAM];
    size_t len;
    int i;
    memset(&session, 0, sizeof session);
    memset(&joining, 0, sizeof joining);
    memset(&sample, 0, sizeof sample);
    session.number = 0x0123456789abcdefu, session.place = 1;
    for (i = 0; i < 32; ++i) key[i] = (uint8_t)i;
    for (i = 0; i < 16; ++i) joining.nonce[i] = (uint8_t)(0x40 + i);

    CHECK(block(path, "hello", expected) == COHAPTIC_HANDSHAKE);
    cohaptic_hello(key, &session, joining.nonce, 0, "", out);
    CHECK(memcmp(out, expected, COHAPTIC_HANDSHAKE) == 0);
    /* Fingerprint and label have their places, and the tag covers both. */
    cohaptic_hello(key, &session, joining.nonce, 0x1122334455667788u, "inverse3", out);
    CHECK(memcmp(out, expected, 40) == 0 && memcmp(out + 40, "\x88\x77\x66\x55\x44\x33\x22\x11inverse3", 16) == 0 && memcmp(out + 56, expected + 56, 16) == 0);
    CHECK(cohaptic_tag_is_right(key, out, COHAPTIC_HANDSHAKE) && memcmp(out + 72, expected + 72, 16) != 0);

    len = block(path, "welcome", expected);
    told = session;
    CHECK(cohaptic_welcome(key, expected, len, &told, &joining));
    CHECK(told.axes == 1 && told.turns == 0 && told.peers == 3 && told.tick_ns == 1000000 && told.update_ns == 8000000);
    CHECK(block(path, "key to the session", expected) == 32 && memcmp(joining.to_door, expected, 32) == 0);
    CHECK(block(path, "key to the peer", expected) == 32 && memcmp(joining.to_peer, expected, 32) == 0);

    sample.sender = 1, sample.number = 5, sample.sent_ns = 40000000, sample.state.position[0] = 0.025, sample.state.velocity[0] = -1.5;
    len = cohaptic_seal(&joining, out, cohaptic_encode(&told, &sample, out));
    CHECK(len == block(path, "to the session", expected) && memcmp(out, expected, len) == 0);
    /* The door's key does not open what was sent to the door: no reflection. */
    CHECK(cohaptic_opened(&joining, expected, len) == 0);

    len = block(path, "to the peer", expected);
    CHECK(cohaptic_opened(&joining, expected, len) == 64 && cohaptic_decode(&told, expected, 64, &sample));
    CHECK(sample.sender == 0 && sample.number == 7 && sample.sent_ns == 56000000 && sample.state.position[0] == -0.5 && sample.state.velocity[0] == 0.125);

    len = block(path, "welcome", expected);
    for (i = 0; (size_t)i < len; ++i) {
        /* No byte of a welcome may change, and none be missing. */
        cohaptic_joining other = joining;
        expected[i] ^= 0x10;
        CHECK(!cohaptic_welcome(key, expected, len, &told, &other));
        expected[i] ^= 0x10;
        CHECK(!cohaptic_welcome(key, expected, (size_t)i, &told, &other));
    }
}

/* --- The gate -------------------------------------------------------------------------------------------------------------------------------------- */

#define MS INT64_C(1000000)

static cohaptic_gate gate_of(double force, double slew) {
    cohaptic_limits limits = cohaptic_usual_limits(1, 1000000);
    cohaptic_gate gate;
    limits.force = force, limits.slew = slew;
    cohaptic_gate_begin(&gate, &limits);
    return gate;
}

static cohaptic_moment well(int64_t now) {
    cohaptic_moment moment;
    moment.now = moment.reading_at = moment.setpoint_at = now, moment.ready = moment.armed = 1;
    return moment;
}

static int is_zero(const double force[3]) { return force[0] == 0 && force[1] == 0 && force[2] == 0; }

/* Brings a gate to 2 N along y at 1 ms, then asks at `moment`. Returns the cause, after the checks that all causes share. */
static cohaptic_cause cause_of(cohaptic_moment moment, const double wanted[3], int stopped) {
    static const double STRONG[3] = {0, 2, 0};
    cohaptic_gate gate = gate_of(4, 1e6);
    cohaptic_moment early = well(0), later = well(1 * MS);
    double out[3];
    cohaptic_cause cause, again;
    cohaptic_gate_admit(&gate, STRONG, &early, out);
    CHECK(cohaptic_gate_admit(&gate, STRONG, &later, out) == COHAPTIC_FORCE && out[1] == 2);
    if (stopped) cohaptic_gate_stop(&gate), cohaptic_gate_stop(&gate);
    cause = cohaptic_gate_admit(&gate, wanted, &moment, out);
    CHECK(is_zero(out) && gate.counts[cause] == 1);
    /* After zero the force grows from zero, or stays zero after a stop. */
    later = well(moment.now);
    again = cohaptic_gate_admit(&gate, STRONG, &later, out);
    CHECK(again == (stopped ? COHAPTIC_STOPPED : COHAPTIC_FORCE) && is_zero(out));
    later = well(moment.now + 1 * MS);
    again = cohaptic_gate_admit(&gate, STRONG, &later, out);
    CHECK(again == (stopped ? COHAPTIC_STOPPED : COHAPTIC_FORCE) && out[1] == (stopped ? 0 : 2));
    return cause;
}

static void gate(void) {
    static const double EXPECTED[5] = {0, 1, 2, 3, 3}, WANTED[3] = {0, 0, 8}, STRONG[3] = {0, 2, 0};
    cohaptic_gate slow = gate_of(3, 1000);
    cohaptic_moment moment;
    double out[3], odd[3] = {0, 2, 0};
    int i, part;
    for (i = 0; i < 5; ++i) {
        moment = well(i * MS);
        CHECK(cohaptic_gate_admit(&slow, WANTED, &moment, out) == COHAPTIC_FORCE);
        CHECK(out[0] == 0 && out[1] == 0 && out[2] == EXPECTED[i]);
    }
    CHECK(cause_of(well(2 * MS), STRONG, 1) == COHAPTIC_STOPPED);
    moment = well(2 * MS), moment.ready = 0;
    CHECK(cause_of(moment, STRONG, 0) == COHAPTIC_NOT_READY);
    moment = well(2 * MS), moment.armed = 0;
    CHECK(cause_of(moment, STRONG, 0) == COHAPTIC_NOT_ARMED);
    moment = well(2 * MS), moment.reading_at = COHAPTIC_NEVER;
    CHECK(cause_of(moment, STRONG, 0) == COHAPTIC_STALE_READING);
    moment = well(13 * MS), moment.reading_at = 3 * MS - 1;
    CHECK(cause_of(moment, STRONG, 0) == COHAPTIC_STALE_READING);
    moment = well(2 * MS), moment.reading_at = 3 * MS;
    CHECK(cause_of(moment, STRONG, 0) == COHAPTIC_STALE_READING);
    moment = well(2 * MS), moment.setpoint_at = COHAPTIC_NEVER;
    CHECK(cause_of(moment, STRONG, 0) == COHAPTIC_STALE_SETPOINT);
    moment = well(20 * MS), moment.setpoint_at = -30 * MS - 1;
    CHECK(cause_of(moment, STRONG, 0) == COHAPTIC_STALE_SETPOINT);
    CHECK(cause_of(well(21 * MS + 1), STRONG, 0) == COHAPTIC_LOOP_LATE);
    for (part = 0; part < 3; ++part) {
        odd[0] = 0, odd[1] = 2, odd[2] = 0, odd[part] = NAN;
        CHECK(cause_of(well(2 * MS), odd, 0) == COHAPTIC_NOT_FINITE);
        odd[part] = -INFINITY;
        CHECK(cause_of(well(2 * MS), odd, 0) == COHAPTIC_NOT_FINITE);
    }
    /* The largest numbers keep their direction, and pass the limit of force as any other force. */
    slow = gate_of(3, 1e6);
    odd[0] = -1e308, odd[1] = 1e308, odd[2] = 1e308;
    moment = well(0), cohaptic_gate_admit(&slow, odd, &moment, out);
    moment = well(1 * MS), cohaptic_gate_admit(&slow, odd, &moment, out);
    CHECK(fabs(out[0] + sqrt(3)) < 1e-12 && fabs(out[1] - sqrt(3)) < 1e-12 && fabs(out[2] - sqrt(3)) < 1e-12);
    /* At the edge of each age the force still passes. */
    slow = gate_of(3, 1e6);
    moment = well(0), cohaptic_gate_admit(&slow, STRONG, &moment, out);
    moment = well(20 * MS), moment.reading_at = 10 * MS, moment.setpoint_at = -30 * MS;
    CHECK(cohaptic_gate_admit(&slow, STRONG, &moment, out) == COHAPTIC_FORCE && out[1] == 2);
}

/* --- The peer, beside figures of the program ------------------------------------------------------------------------------------------------------- */

static cohaptic_options two_peers(void) {
    cohaptic_options options = cohaptic_usual();
    options.scene.coordination.stiffness = 500;
    return options;
}

/* A device of 0.1 kg and 5 N.s/m under 1.5 N for 100 ticks, with the other copy at rest. */
static void moves_to(const cohaptic_scene *scene, double xh, double vh, double xo, double vo) {
    static cohaptic_peer peer;
    cohaptic_session session = cohaptic_usual().session;
    cohaptic_state device;
    const cohaptic_step step = cohaptic_step_of(0.1, 5, 0.001);
    uint64_t k;
    CHECK(cohaptic_peer_begin(&peer, &session, scene, 0) == NULL);
    device = peer.reading;
    for (k = 0; k < 100; ++k) {
        cohaptic_peer_tick(&peer, k, &device, NULL);
        cohaptic_move(&step, &device, 0, 1.5 + peer.on_hand[0]);
    }
    CHECK(fabs(device.position[0] - xh) < 1e-12 && fabs(device.velocity[0] - vh) < 1e-12);
    CHECK(fabs(peer.copy.position[0] - xo) < 1e-12 && fabs(peer.copy.velocity[0] - vo) < 1e-12);
}

static void figures(void) {
    cohaptic_scene scene = two_peers().scene;
    moves_to(&scene, 0.00418909868044695, -0.0126283653899512, 0.003717446243695, -0.0121602475770235);
    /* With two peers PD is AP. */
    scene.law = COHAPTIC_PROPORTIONAL_DERIVATIVE;
    moves_to(&scene, 0.00418909868044695, -0.0126283653899512, 0.003717446243695, -0.0121602475770235);
    scene.law = COHAPTIC_AVERAGE_POSITION;
    scene.coupling.stiffness = 1000, scene.coupling.damping = 2, scene.exchange_every = 2, scene.exchange_age = 1;
    moves_to(&scene, 0.00524952463767579, -0.0111540648355197, 0.00377446409899885, -0.00545479030280096);
}

/* PD(K, B) of four peers is AP(3K, 3B): two ways to ask for one force. */
static void laws(void) {
    static cohaptic_peer ap, pd;
    cohaptic_session session = cohaptic_usual().session;
    cohaptic_scene scene = two_peers().scene;
    cohaptic_state device;
    uint64_t k;
    session.peers = 4;
    memset(&device, 0, sizeof device);
    device.position[0] = 0.01;
    scene.law = COHAPTIC_PROPORTIONAL_DERIVATIVE;
    CHECK(cohaptic_peer_begin(&pd, &session, &scene, 0) == NULL);
    scene.law = COHAPTIC_AVERAGE_POSITION, scene.coordination.stiffness *= 3, scene.coordination.damping *= 3;
    CHECK(cohaptic_peer_begin(&ap, &session, &scene, 0) == NULL);
    for (k = 0; k < 50; ++k) cohaptic_peer_tick(&ap, k, &device, NULL), cohaptic_peer_tick(&pd, k, &device, NULL);
    CHECK(ap.copy.position[0] > 1e-3 && memcmp(&ap.copy, &pd.copy, sizeof ap.copy) == 0);
}

/* A program that pushes the copy: without coordination the copy has the velocity F*t/M, and the position half of F*t*t/M. */
static void pushed(void) {
    static const double PUSH[3] = {0.5, 0, 0};
    static cohaptic_peer peer;
    cohaptic_session session = cohaptic_usual().session;
    cohaptic_scene scene = cohaptic_usual().scene;
    uint64_t k;
    scene.coupling.stiffness = scene.coupling.damping = scene.coordination.stiffness = scene.coordination.damping = 0;
    CHECK(cohaptic_peer_begin(&peer, &session, &scene, 0) == NULL);
    for (k = 0; k < 100; ++k) cohaptic_peer_tick(&peer, k, NULL, PUSH);
    CHECK(fabs(peer.copy.velocity[0] - 0.5 * 0.1 / 0.225) < 1e-12 && fabs(peer.copy.position[0] - 0.5 * 0.5 * 0.01 / 0.225) < 1e-12);
}

/* Writes the welcome to the hello `asked` of a session with these facts. */
static size_t welcome(const uint8_t key[COHAPTIC_KEY], const cohaptic_session *told, const uint8_t *asked, uint8_t *out) {
    memset(out, 0, COHAPTIC_HANDSHAKE);
    memcpy(out, "CHPW\1", 5);
    out[6] = told->axes, out[7] = told->turns;
    cohaptic_put(out + 8, told->number, 8);
    cohaptic_put(out + 16, told->place, 4);
    cohaptic_put(out + 20, told->peers, 4);
    memcpy(out + 24, asked + 24, COHAPTIC_NONCE);
    memset(out + 40, 0x77, COHAPTIC_NONCE);
    cohaptic_put(out + 56, told->tick_ns, 8);
    cohaptic_put(out + 64, told->update_ns, 8);
    return cohaptic_add_tag(key, out, COHAPTIC_HANDSHAKE - COHAPTIC_TAG);
}

/* After a second of silence the peer says hello every 250 ms with one new nonce, and believes the welcome. Numbers then begin anew. */
static void silence(void) {
    static const int64_t S = 1000 * MS;
    uint8_t first[COHAPTIC_NONCE], second[COHAPTIC_NONCE], out[COHAPTIC_DATAGRAM], hello[COHAPTIC_DATAGRAM], in[COHAPTIC_DATAGRAM];
    static cohaptic_peer peer;
    cohaptic_session session = cohaptic_usual().session;
    cohaptic_scene scene = cohaptic_usual().scene;
    int changed;
    memset(first, 1, sizeof first);
    memset(second, 2, sizeof second);
    for (changed = 0; changed < 2; ++changed) {
        cohaptic_session told = session;
        CHECK(cohaptic_peer_begin(&peer, &session, &scene, 5 * S) == NULL);
        memset(peer.key, 9, sizeof peer.key);
        peer.keyed = 1, peer.joinings = 1;
        peer.others[1].has_newest = 1, peer.others[1].newest = 900;
        CHECK(cohaptic_peer_begin_anew(&peer, 6 * S - 1, first, out) == 0 && !cohaptic_peer_is_in_silence(&peer, 6 * S - 1));
        CHECK(cohaptic_peer_begin_anew(&peer, 6 * S, first, hello) == COHAPTIC_HANDSHAKE && cohaptic_peer_is_in_silence(&peer, 6 * S));
        CHECK(memcmp(hello + 24, first, COHAPTIC_NONCE) == 0);
        CHECK(cohaptic_peer_begin_anew(&peer, 6 * S + 249 * MS, second, out) == 0);
        CHECK(cohaptic_peer_begin_anew(&peer, 6 * S + 250 * MS, second, out) == COHAPTIC_HANDSHAKE && memcmp(out, hello, COHAPTIC_HANDSHAKE) == 0);
        if (changed) told.update_ns *= 2;
        CHECK(cohaptic_peer_take(&peer, in, welcome(peer.key, &told, hello, in), 7 * S));
        CHECK(peer.joinings == 2 && !peer.others[1].has_newest && !cohaptic_peer_is_in_silence(&peer, 7 * S) && peer.other_session == changed);
        /* The same welcome again is nothing new. */
        CHECK(!cohaptic_peer_take(&peer, in, COHAPTIC_HANDSHAKE, 7 * S) && peer.ignored == 1);
    }
    /* Without a key only the numbers are forgotten. */
    CHECK(cohaptic_peer_begin(&peer, &session, &scene, 0) == NULL);
    peer.others[1].has_newest = 1;
    CHECK(cohaptic_peer_begin_anew(&peer, S, first, out) == 0 && !peer.others[1].has_newest);
    /* A scene of one peer has nobody to hear. */
    session.peers = 1;
    CHECK(cohaptic_peer_begin(&peer, &session, &scene, 0) == NULL && !cohaptic_peer_is_in_silence(&peer, 9 * S));
}

static void refused(void) {
    static cohaptic_peer peer;
    cohaptic_session session = cohaptic_usual().session;
    cohaptic_scene scene = cohaptic_usual().scene;
    session.place = 2;
    CHECK(cohaptic_peer_begin(&peer, &session, &scene, 0) != NULL);
    session.place = 0, session.peers = COHAPTIC_MAX_PEERS + 1;
    CHECK(strstr(cohaptic_peer_begin(&peer, &session, &scene, 0), "COHAPTIC_MAX_PEERS") != NULL);
    session.peers = 2, session.axes = 4;
    CHECK(cohaptic_peer_begin(&peer, &session, &scene, 0) != NULL);
    session.axes = 3, session.turns = 1;
    CHECK(strstr(cohaptic_peer_begin(&peer, &session, &scene, 0), "inertia") != NULL);
    session.turns = 0, scene.exchange_every = 0;
    CHECK(cohaptic_peer_begin(&peer, &session, &scene, 0) != NULL);
}

/* --- The loop -------------------------------------------------------------------------------------------------------------------------------------- */

static cohaptic_client client;

/* A device that stands 50 mm away from the copy, so that KC asks for 175 N, and that ends the session itself. */
typedef struct {
    int reads, pushes, stops, end_after, by_signal, state;
    double last, largest;
} still;

static int still_read(void *self, cohaptic_state *state) {
    still *const device = (still *)self;
    ++device->reads;
    memset(state, 0, sizeof *state);
    state->position[0] = 0.05;
    return device->state;
}

static void still_push(void *self, const double force[3]) {
    still *const device = (still *)self;
    device->last = force[0];
    if (fabs(force[0]) > device->largest) device->largest = fabs(force[0]);
    CHECK(force[0] <= 0 && force[1] == 0 && force[2] == 0);
    if (++device->pushes == device->end_after) {
        if (device->by_signal) raise(SIGTERM);
        else cohaptic_stop(&client), cohaptic_stop(&client);
    }
}

static void still_stop(void *self) { ++((still *)self)->stops; }

static void on_signal(int number) {
    (void)number;
    cohaptic_stop(&client);
}

static still held(int state, int by_signal, double seconds) {
    still mine;
    cohaptic_options options = two_peers();
    cohaptic_device device;
    memset(&mine, 0, sizeof mine);
    mine.end_after = 200, mine.by_signal = by_signal, mine.state = state;
    device.read = still_read, device.push = still_push, device.stop = still_stop, device.self = &mine;
    options.door = "127.0.0.1:9", options.session.number = 1;
    CHECK(cohaptic_open(&client, &options) == NULL);
    signal(SIGTERM, on_signal);
    CHECK(cohaptic_run(&client, &device, seconds) == NULL);
    cohaptic_close(&client);
    cohaptic_close(&client);
    CHECK(mine.stops == 1 && mine.last == 0);
    return mine;
}

static void loop(void) {
    still device = held(COHAPTIC_READ, 0, INFINITY);
    /* The loop pushes once more after its end: zero. */
    CHECK(device.pushes == 201 && device.reads == 200 && client.ticks == 200);
    CHECK(device.largest > 0 && device.largest <= 3 && client.gate.counts[COHAPTIC_FORCE] > 0);
    device = held(COHAPTIC_READ, 1, INFINITY);
    CHECK(device.pushes == 201);
    /* The end of the time, and devices that may not be felt. */
    device = held(COHAPTIC_READ_NOT_ARMED, 0, 0.1);
    CHECK(device.pushes == 101 && device.largest == 0 && client.gate.counts[COHAPTIC_NOT_ARMED] == 100 && client.peer.copy.position[0] == 0);
    device = held(COHAPTIC_READ_NOT_READY, 0, 0.05);
    CHECK(device.largest == 0 && client.gate.counts[COHAPTIC_NOT_READY] == 50 && client.peer.copy.position[0] == 0);
    device = held(COHAPTIC_READ_NOTHING, 0, 0.05);
    CHECK(device.largest == 0 && client.peer.copy.position[0] == 0);
}

static void refusals_of_open(void) {
    cohaptic_options options = two_peers();
    options.door = "nowhere";
    CHECK(strstr(cohaptic_open(&client, &options), "HOST:PORT") != NULL);
    options.door = "127.0.0.1:9", options.label = "much too long";
    CHECK(strstr(cohaptic_open(&client, &options), "label") != NULL);
    options.label = "a b";
    CHECK(strstr(cohaptic_open(&client, &options), "label") != NULL);
    options.label = "\xc3\xa9";
    CHECK(strstr(cohaptic_open(&client, &options), "label") != NULL);
    options.label = NULL, options.force_limit = NAN;
    CHECK(strstr(cohaptic_open(&client, &options), "20 N") != NULL);
    options.force_limit = 3, options.key_file = "/there/is/no/such.key";
    CHECK(strstr(cohaptic_open(&client, &options), "no/such.key: the key file cannot be opened") != NULL);
    cohaptic_close(&client);
}

int main(int argc, char **argv) {
    if (argc != 2) return 2;
    published_vectors();
    worked_examples(argv[1]);
    gate();
    figures();
    laws();
    pushed();
    silence();
    refused();
    loop();
    refusals_of_open();
    return faults != 0;
}
