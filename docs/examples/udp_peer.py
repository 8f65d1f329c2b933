#!/usr/bin/env python3
"""A peer of a live session, complete and small: copy it and put your device into it.

It joins a scene that runs under `cohaptic live`, simulates a haptic device, its own copy of the shared object and average-position coordination at
1 kHz, and exchanges samples with the other peers through the session. Python 3.8 or newer, standard library only. The protocol is in
docs/live-protocol.md, the equations are in docs/model.md.

    python3 udp_peer.py 127.0.0.1:7000 --session 42 --place 1 --peers 3 --force 0.5 --duration 5

At the end it prints one line of JSON. SI units everywhere.
"""

import argparse
import hashlib
import hmac
import json
import math
import os
import select
import socket
import struct
import sys
import time

HEADER = struct.Struct("<4sHBBQIIQQQ")  # magic, version, axes, 0, session, sender, 0, number, send time [ns], 0
HELLO = struct.Struct("<4sHHQII16s32x")  # magic, version, 0, session, place, 0, client nonce
WELCOME = struct.Struct("<4sHBBQII16s16sQQ")  # magic, version, axes, 0, session, place, peers, both nonces, tick [ns], update [ns]
NONCE_LEN = TAG_LEN = 16
BUFFER_LEN = 2048  # more than any datagram of the protocol, so that a longer one shows

HELLO_EVERY = 0.25  # [s]
SILENCE = 1.0  # without anything new from anybody for so long, begin anew [s]
STALE_AFTER = 0.1  # a sender not heard for so long counts as stale [s]


def mac(key, message):
    return hmac.new(key, message, hashlib.sha256).digest()


def tag(key, message):
    return mac(key, message)[:TAG_LEN]


# --- The datagrams -----------------------------------------------------------------------------------------------------------------------------


def encode_sample(session, sender, number, sent_ns, states):
    """`states`: for each axis its position and velocity."""
    header = HEADER.pack(b"CHPT", 1, len(states), 0, session, sender, 0, number, sent_ns, 0)
    return header + b"".join(struct.pack("<dd", position, velocity) for position, velocity in states)


def decode_sample(datagram, session, axes):
    """(sender, number, states), or None for anything but a good sample of this session."""
    if len(datagram) != HEADER.size + 16 * axes:
        return None
    magic, version, found_axes, zero1, found_session, sender, zero2, number, _sent, zero3 = HEADER.unpack_from(datagram)
    if (magic, version, found_axes, found_session) != (b"CHPT", 1, axes, session) or zero1 or zero2 or zero3:
        return None
    states = list(struct.iter_unpack("<dd", datagram[HEADER.size :]))
    return (sender, number, states) if all(math.isfinite(x) for state in states for x in state) else None


class Joining:
    """One joining in a session with a key: first the hello, then the keys of both ways."""

    def __init__(self, key, session, place):
        self.key, self.session, self.place = key, session, place
        self.nonce = os.urandom(NONCE_LEN)

    def hello(self):
        hello = HELLO.pack(b"CHPH", 1, 0, self.session, self.place, 0, self.nonce)
        return hello + tag(self.key, hello)

    def handle_welcome(self, datagram):
        """(axes, peers, tick in ns, update in ns), and the keys are there; or None if it is no welcome for this joining."""
        if len(datagram) != WELCOME.size + TAG_LEN:
            return None
        body, found_tag = datagram[:-TAG_LEN], datagram[-TAG_LEN:]
        if not hmac.compare_digest(tag(self.key, body), found_tag):
            return None
        magic, version, axes, _zero, session, place, peers, nonce, server_nonce, tick, update = WELCOME.unpack(body)
        if (magic, version, session, place, nonce) != (b"CHPW", 1, self.session, self.place, self.nonce):
            return None
        both = struct.pack("<QI", session, place) + nonce + server_nonce
        self.to_door = mac(self.key, b"cohaptic 1 to door" + both)
        self.to_peer = mac(self.key, b"cohaptic 1 to peer" + both)
        return axes, peers, tick, update

    def seal(self, sample):
        body = sample + self.nonce
        return body + tag(self.to_door, body)

    def open(self, datagram):
        """The sample in it, or None if it was not made for this joining."""
        body, found_tag = datagram[:-TAG_LEN], datagram[-TAG_LEN:]
        if body[-NONCE_LEN:] != self.nonce or not hmac.compare_digest(tag(self.to_peer, body), found_tag):
            return None
        return body[:-NONCE_LEN]


# --- The mechanics -----------------------------------------------------------------------------------------------------------------------------


class Body:
    """A damped mass on each axis. A step is exact for a force that is held over it."""

    def __init__(self, mass, damping, step, axes):
        # a = b·h/m; φ1 = (1 − e^−a)/a and φ2 = (1 − φ1)/a, by their series where the quotients would lose digits.
        a = damping * step / mass
        phi1 = 1 - a / 2 + a * a / 6 - a**3 / 24 if a < 1e-3 else -math.expm1(-a) / a
        phi2 = 1 / 2 - a / 6 + a * a / 24 - a**3 / 120 if a < 1e-3 else (1 - phi1) / a
        self.position_per_velocity, self.position_per_force = step * phi1, step * step / mass * phi2
        self.velocity_lost, self.velocity_per_force = a * phi1, step / mass * phi1
        self.states = [(0.0, 0.0)] * axes

    def move(self, forces):
        self.states = [
            (
                x + self.position_per_velocity * v + self.position_per_force * f,
                v - self.velocity_lost * v + self.velocity_per_force * f,
            )
            for (x, v), f in zip(self.states, forces)
        ]


class Sender:
    """What is held from another peer: the sample with the highest number; its initial state before the first."""

    def __init__(self, axes):
        self.states = [(0.0, 0.0)] * axes
        self.newest, self.heard = None, None
        self.received = self.late = 0

    def take(self, number, states, now):
        """Whether it is newer than what was held."""
        self.received += 1
        if self.newest is not None and number <= self.newest:
            self.late += 1
            return False
        self.newest, self.states, self.heard = number, states, now
        return True


# --- The peer ----------------------------------------------------------------------------------------------------------------------------------


class Peer:
    def __init__(self, options, door, joining, axes, peers, tick_ns, update_ns):
        self.options, self.door, self.joining = options, door, joining
        self.axes, self.tick_ns, self.ticks_per_update = axes, tick_ns, max(1, round(update_ns / tick_ns))
        step = tick_ns * 1e-9
        self.device = Body(options.device_mass, options.device_damping, step, axes)
        self.copy = Body(options.object_mass / peers, options.object_damping, step, axes)
        self.others = {place: Sender(axes) for place in range(peers) if place != options.place}
        self.sent = self.ignored = 0
        self.joinings = 1 if joining else 0
        self.heard = time.monotonic()  # anything new from anybody
        self.rejoining, self.next_hello = None, 0.0

    def run(self):
        """Runs for the duration, in ticks at fixed times: one that is late is made up for, so the peer's time never falls behind for good."""
        ticks = round(self.options.duration / (self.tick_ns * 1e-9))
        began = time.monotonic()
        for tick in range(ticks):
            wait = began + tick * self.tick_ns * 1e-9 - time.monotonic()
            if wait > 0:
                time.sleep(wait)
            self.tick(tick)
        return ticks

    def tick(self, tick):
        # 1. Sample and send.
        if tick % self.ticks_per_update == 0:
            sample = encode_sample(self.options.session, self.options.place, self.sent, tick * self.tick_ns, self.copy.states)
            self.send(self.joining.seal(sample) if self.joining else sample)
            self.sent += 1
        # 2. Take in what has arrived.
        now = time.monotonic()
        self.receive(now)
        self.begin_anew_after_silence(now)
        # 3. Forces. 4. Move.
        force_of_hand = self.options.force if tick * self.tick_ns < self.options.force_for * 1e9 else 0.0
        on_device, on_copy = self.forces(force_of_hand)
        self.device.move(on_device)
        self.copy.move(on_copy)

    def forces(self, force_of_hand):
        options, on_device, on_copy = self.options, [], []
        for axis in range(self.axes):
            (xh, vh), (xo, vo) = self.device.states[axis], self.copy.states[axis]
            # (9) FC = KC·(xH − xO) + BC·(vH − vO): what the device does to the copy.
            coupling = options.coupling[0] * (xh - xo) + options.coupling[1] * (vh - vo)
            # (10) FT = KT·(xO − xd) + BT·(vO − vd), towards the mean of the samples held from the others.
            coordination = 0.0
            if self.others:
                xd = sum(other.states[axis][0] for other in self.others.values()) / len(self.others)
                vd = sum(other.states[axis][1] for other in self.others.values()) / len(self.others)
                coordination = options.coordination[0] * (xo - xd) + options.coordination[1] * (vo - vd)
            on_device.append((force_of_hand if axis == 0 else 0.0) - coupling)
            on_copy.append(coupling - coordination)
        return on_device, on_copy

    def send(self, datagram):
        try:
            self.door.send(datagram)
        except OSError:
            pass  # Nobody is there, or no room: the next sample says more than this one would.

    def receive(self, now):
        # No more at one tick than can be new, so that a flood cannot stop the loop.
        for _ in range(64):
            try:
                datagram = self.door.recv(BUFFER_LEN)
            except BlockingIOError:
                return
            except OSError:
                continue  # The system tells that an earlier datagram found nobody.
            if not self.handle(datagram, now):
                self.ignored += 1

    def handle(self, datagram, now):
        if self.rejoining and self.rejoining.handle_welcome(datagram):
            self.joining, self.rejoining, self.heard = self.rejoining, None, now
            self.joinings += 1
            self.forget_numbers()
            return True
        plain = self.joining.open(datagram) if self.joining else datagram
        sample = decode_sample(plain, self.options.session, self.axes) if plain else None
        if sample is None or sample[0] not in self.others:
            return False
        sender, number, states = sample
        if self.others[sender].take(number, states, now):
            self.heard = now
        return True

    def begin_anew_after_silence(self, now):
        """The session may have been started again: then all numbers begin at 0, and the keys of the joining are worth nothing."""
        if now - self.heard < SILENCE:
            self.rejoining = None
        elif not self.joining:
            self.forget_numbers()
        elif now >= self.next_hello:
            self.rejoining = self.rejoining or Joining(self.joining.key, self.joining.session, self.joining.place)
            self.send(self.rejoining.hello())
            self.next_hello = now + HELLO_EVERY

    def forget_numbers(self):
        for other in self.others.values():
            other.newest = None

    def summary(self, ticks):
        now = time.monotonic()
        others = [
            {"sender": place, "received": o.received, "late": o.late, "stale": o.heard is None or now - o.heard > STALE_AFTER}
            for place, o in sorted(self.others.items())
        ]
        return {
            "place": self.options.place,
            "ticks": ticks,
            "sent": self.sent,
            "joinings": self.joinings,
            "ignored": self.ignored,
            "position": [position for position, _ in self.copy.states],
            "velocity": [velocity for _, velocity in self.copy.states],
            "device": [position for position, _ in self.device.states],
            "others": others,
        }


def join(door, key, session, place, patience):
    """Says hello until the door answers: the joining, and what it has said of the session."""
    joining = Joining(key, session, place)
    until = time.monotonic() + patience
    while time.monotonic() < until:
        try:
            door.send(joining.hello())
        except OSError:
            pass  # Nobody is there yet.
        again = time.monotonic() + HELLO_EVERY
        while True:
            wait = again - time.monotonic()
            if wait <= 0 or not select.select([door], [], [], wait)[0]:
                break
            try:
                welcome = joining.handle_welcome(door.recv(BUFFER_LEN))
            except OSError:
                time.sleep(0.01)
                continue
            if welcome:
                return joining, welcome
    sys.exit(f"udp_peer: no welcome for place {place} of session {session} within {patience} s: is the session up, and is the key the same?")


def connect(text):
    """A socket that talks to the door alone: the system drops what comes from elsewhere."""
    host, _, port = text.rpartition(":")
    host = host.strip("[]")
    family, kind, protocol, _, address = socket.getaddrinfo(host, int(port), type=socket.SOCK_DGRAM)[0]
    door = socket.socket(family, kind, protocol)
    door.connect(address)
    door.setblocking(False)
    return door


def read_key(path):
    with open(path, encoding="ascii") as file:
        digits = file.read(1024).rstrip()
    if len(digits) != 64:
        raise ValueError(f"{path} is no key file: it must hold 64 hexadecimal digits")
    return bytes.fromhex(digits)


def gains(text):
    stiffness, damping = (float(part) for part in text.split(","))
    return stiffness, damping


def parse():
    parser = argparse.ArgumentParser(description="A peer of a live session of cohaptic.")
    parser.add_argument("door", help="HOST:PORT of the session; an IPv6 address in brackets")
    parser.add_argument("--session", type=int, required=True, help="the seed of the scene")
    parser.add_argument("--place", type=int, required=True, help="place of this peer among the peers of the scene, from 0")
    parser.add_argument("--key-file", help="64 hexadecimal digits; then axes, peers and periods are told by the door")
    parser.add_argument("--axes", type=int, default=1, choices=[1, 2, 3])
    parser.add_argument("--peers", type=int, default=2, help="how many peers the scene has [%(default)s]")
    parser.add_argument("--tick-ms", type=float, default=1.0, help="[%(default)s]")
    parser.add_argument("--update-ms", type=float, default=8.0, help="[%(default)s]")
    parser.add_argument("--duration", type=float, default=10.0, help="s [%(default)s]")
    parser.add_argument("--patience", type=float, default=10.0, help="how long to wait for a welcome, s [%(default)s]")
    parser.add_argument("--force", type=float, default=0.0, help="of the hand, along x, N [%(default)s]")
    parser.add_argument("--force-for", type=float, default=math.inf, help="how long the hand pushes, s [always]")
    parser.add_argument("--object-mass", type=float, default=0.45, help="of the whole object; each copy has its share, kg [%(default)s]")
    parser.add_argument("--object-damping", type=float, default=0.0, help="of each copy, N·s/m [%(default)s]")
    parser.add_argument("--device-mass", type=float, default=0.1, help="kg [%(default)s]")
    parser.add_argument("--device-damping", type=float, default=5.0, help="N·s/m [%(default)s]")
    parser.add_argument("--coupling", type=gains, default=(3500.0, 5.0), metavar="K,B", help="N/m, N·s/m [3500,5]")
    parser.add_argument("--coordination", type=gains, default=(300.0, 5.0), metavar="K,B", help="N/m, N·s/m [300,5]")
    return parser.parse_args()


def main():
    options = parse()
    door = connect(options.door)
    if options.key_file:
        key = read_key(options.key_file)
        joining, (axes, peers, tick_ns, update_ns) = join(door, key, options.session, options.place, options.patience)
    else:
        joining, axes, peers = None, options.axes, options.peers
        tick_ns, update_ns = round(options.tick_ms * 1e6), round(options.update_ms * 1e6)
    if not (0 <= options.place < peers and tick_ns > 0):
        sys.exit("udp_peer: place, peers and periods do not fit together")
    peer = Peer(options, door, joining, axes, peers, tick_ns, update_ns)
    ticks = peer.run()
    print(json.dumps(peer.summary(ticks)))


if __name__ == "__main__":
    main()
