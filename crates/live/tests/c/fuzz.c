/* Random and mutated datagrams for the parser of docs/examples/cohaptic_peer.h, without and with a key. Built with the sanitizers of addresses and of
 * undefined behaviour where the compiler has these.
 *
 *     fuzz ROUNDS SEED
 */
#include "cohaptic_peer.h"

static uint64_t state;

/* Returns the next word of SplitMix64 (Steele, Lea & Flood 2014). */
static uint64_t word(void) {
    uint64_t z = state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

static cohaptic_peer peer, before;

/* Gives the peer a datagram in memory of exactly its length, so that a sanitizer sees each byte read beyond the end. */
static int take(const uint8_t *bytes, size_t len) {
    uint8_t *const exact = (uint8_t *)malloc(len + (len == 0));
    int taken;
    if (!exact) exit(3);
    memcpy(exact, bytes, len);
    taken = cohaptic_peer_take(&peer, exact, len, 1);
    free(exact);
    return taken;
}

/* Returns whether every number that the peer holds from the others is finite. */
static int holds_finite_numbers(void) {
    uint32_t place;
    int i, finite = 1;
    for (place = 0; place < peer.session.peers; ++place) {
        const cohaptic_sender *const other = &peer.others[place];
        for (i = 0; i < 3; ++i) finite &= isfinite(other->state.position[i]) && isfinite(other->state.velocity[i]) && isfinite(other->world_rate[i]);
        for (i = 0; i < 9; ++i) finite &= isfinite(other->matrix.m[i / 3][i % 3]) != 0;
    }
    return finite;
}

static void fail(const char *what) {
    fprintf(stderr, "fuzz: %s\n", what);
    exit(1);
}

int main(int argc, char **argv) {
    cohaptic_scene scene = cohaptic_usual().scene;
    uint64_t rounds, taken = 0, refused = 0, round;
    if (argc != 3) return 2;
    rounds = strtoull(argv[1], NULL, 10), state = strtoull(argv[2], NULL, 10);
    for (round = 0; round < rounds; ++round) {
        cohaptic_session session = cohaptic_usual().session;
        uint8_t bytes[300];
        size_t len, i;
        const int keyed = (int)(word() % 2), rejoins = keyed && word() % 4 == 0, kind = (int)(word() % 4);
        int whole = 0, sender_is_another;
        session.axes = (uint8_t)(1 + word() % 3), session.turns = session.axes == 3 && word() % 2;
        session.peers = (uint32_t)(2 + word() % 3), session.place = 1;
        for (i = 0; i < 3; ++i) scene.inertia[i] = session.turns ? 0.001 : 0;
        if (cohaptic_peer_begin(&peer, &session, &scene, 0)) fail("the peer was refused");
        for (i = 0; i < COHAPTIC_KEY; ++i) peer.key[i] = (uint8_t)word(), peer.joined.to_peer[i] = (uint8_t)word();
        for (i = 0; i < COHAPTIC_NONCE; ++i) peer.joined.nonce[i] = (uint8_t)word(), peer.asked.nonce[i] = (uint8_t)word();
        peer.keyed = (uint8_t)keyed, peer.rejoining = (uint8_t)rejoins;
        memset(bytes, 0, sizeof bytes);
        if (kind == 0) {
            /* Noise, of which a half begins as a sample or as a welcome. */
            for (i = 0; i < sizeof bytes; ++i) bytes[i] = (uint8_t)word();
            len = word() % sizeof bytes;
            if (word() % 2) memcpy(bytes, word() % 2 ? "CHPT\1" : "CHPW\1", 6);
        } else if (rejoins && word() % 2) {
            memcpy(bytes, "CHPW\1", 6);
            bytes[6] = session.axes, bytes[7] = session.turns;
            cohaptic_put(bytes + 16, session.place, 4);
            cohaptic_put(bytes + 20, session.peers, 4);
            memcpy(bytes + 24, peer.asked.nonce, COHAPTIC_NONCE);
            cohaptic_put(bytes + 56, session.tick_ns, 8);
            cohaptic_put(bytes + 64, session.update_ns, 8);
            len = cohaptic_add_tag(peer.key, bytes, COHAPTIC_HANDSHAKE - COHAPTIC_TAG);
            whole = 1;
        } else {
            cohaptic_sample sample;
            memset(&sample, 0, sizeof sample);
            sample.sender = (uint32_t)(word() % 5), sample.number = word(), sample.attitude.quaternion[word() % 4] = 1;
            for (i = 0; i < 3; ++i) sample.state.position[i] = (double)(word() % 1000) / 1e5, sample.state.velocity[i] = -0.5, sample.attitude.rate[i] = 3;
            sender_is_another = sample.sender < session.peers && sample.sender != session.place;
            len = cohaptic_encode(&session, &sample, bytes);
            if (keyed) {
                memcpy(bytes + len, peer.joined.nonce, COHAPTIC_NONCE);
                len = cohaptic_add_tag(peer.joined.to_peer, bytes, len + COHAPTIC_NONCE);
            }
            whole = sender_is_another;
        }
        if (kind > 1) {
            /* Mutations: bits, bytes, numbers that are not finite, another length. */
            uint64_t times = 1 + word() % 3;
            while (times-- > 0 && len > 8) {
                static const double ODD[4] = {INFINITY, -INFINITY, NAN, 1.7976931348623157e308};
                const uint64_t dice = word() % 4;
                if (dice == 0) bytes[word() % len] ^= (uint8_t)(1u << word() % 8);
                else if (dice == 1) bytes[word() % len] = (uint8_t)word();
                else if (dice == 2) len = word() % 2 ? word() % (len + 1) : (len + word() % 40) % sizeof bytes;
                else cohaptic_put_double(bytes + word() % (len - 7), ODD[word() % 4]);
            }
        }
        memcpy(&before, &peer, sizeof peer);
        if (take(bytes, len)) {
            ++taken;
        } else {
            ++refused;
            if (kind == 1 && whole) fail("a valid datagram was refused");
            /* A refusal changes nothing but the count. Keys of a welcome that was refused are worth nothing and may have been written. */
            ++before.ignored;
            before.asked = peer.asked;
            if (memcmp(&before, &peer, sizeof peer) != 0) fail("a refused datagram changed the peer");
        }
        if (kind == 1 && !whole && memcmp(&before, &peer, sizeof peer) != 0) fail("a sample of nobody was taken");
        if (!keyed && !session.turns && !holds_finite_numbers()) fail("a number that is not finite was taken");
        cohaptic_peer_tick(&peer, 0, NULL, NULL);
        /* Numbers near the largest one can make the copy infinite. The session refuses these (beyond 10 m), and seals none. */
        if (keyed && !cohaptic_peer_is_finite(&peer)) fail("a sealed datagram made the copy infinite");
    }
    printf("%llu taken, %llu refused\n", (unsigned long long)taken, (unsigned long long)refused);
    return taken == 0 || refused == 0;
}
