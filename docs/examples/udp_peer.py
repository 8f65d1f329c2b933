#!/usr/bin/env python3
"""A peer of a live session, complete and small: copy it and put your device into it.

It joins a scene that runs under `cohaptic live`, simulates a haptic device, its own copy of the shared object and average-position coordination at
1 kHz, and exchanges samples with the other peers through the session. With --inertia the object turns, and the device grasps it at --grasp. Python
3.8 or newer, standard library only. The protocol is in docs/live-protocol.md, the equations are in docs/model.md and docs/rotation.md.

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

HEADER = struct.Struct("<4sHBBQIIQQQ")  # magic, version, axes, 1 with an attitude, session, sender, 0, number, send time [ns], 0
ATTITUDE = struct.Struct("<7d")  # quaternion w, x, y, z, angular velocity about the axes of the body [rad/s]
HELLO = struct.Struct("<4sHHQII16s32x")  # magic, version, 0, session, place, 0, client nonce
WELCOME = struct.Struct("<4sHBBQII16s16sQQ")  # magic, version, axes, 1 if the object turns, session, place, peers, both nonces, tick [ns], update [ns]
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


def encode_sample(session, sender, number, sent_ns, states, turn=None):
    """`states`: for each axis its position and velocity. `turn`: the attitude, if the object turns."""
    header = HEADER.pack(b"CHPT", 1, len(states), 1 if turn else 0, session, sender, 0, number, sent_ns, 0)
    attitude = ATTITUDE.pack(*turn.quaternion, *turn.rate) if turn else b""
    return header + b"".join(struct.pack("<dd", position, velocity) for position, velocity in states) + attitude


def decode_sample(datagram, session, axes, turns):
    """(sender, number, states, attitude or None), or None for anything but a good sample of this session."""
    end = HEADER.size + 16 * axes
    if len(datagram) != end + (ATTITUDE.size if turns else 0):
        return None
    magic, version, found_axes, motion, found_session, sender, zero1, number, _sent, zero2 = HEADER.unpack_from(datagram)
    if (magic, version, found_axes, motion, found_session) != (b"CHPT", 1, axes, int(turns), session) or zero1 or zero2:
        return None
    states = list(struct.iter_unpack("<dd", datagram[HEADER.size : end]))
    attitude = ATTITUDE.unpack_from(datagram, end) if turns else None
    if not all(math.isfinite(x) for numbers in states + [attitude or ()] for x in numbers):
        return None
    if turns and abs(sum(q * q for q in attitude[:4]) - 1) > 2**-20:
        return None
    return sender, number, states, attitude


class Joining:
    """One joining in a session with a key: first the hello, then the keys of both ways."""

    def __init__(self, key, session, place):
        self.key, self.session, self.place = key, session, place
        self.nonce = os.urandom(NONCE_LEN)

    def hello(self):
        hello = HELLO.pack(b"CHPH", 1, 0, self.session, self.place, 0, self.nonce)
        return hello + tag(self.key, hello)

    def handle_welcome(self, datagram):
        """(axes, turns, peers, tick in ns, update in ns), and the keys are there; or None if it is no welcome for this joining."""
        if len(datagram) != WELCOME.size + TAG_LEN:
            return None
        body, found_tag = datagram[:-TAG_LEN], datagram[-TAG_LEN:]
        if not hmac.compare_digest(tag(self.key, body), found_tag):
            return None
        magic, version, axes, turns, session, place, peers, nonce, server_nonce, tick, update = WELCOME.unpack(body)
        if (magic, version, session, place, nonce) != (b"CHPW", 1, self.session, self.place, self.nonce):
            return None
        both = struct.pack("<QI", session, place) + nonce + server_nonce
        self.to_door = mac(self.key, b"cohaptic 1 to door" + both)
        self.to_peer = mac(self.key, b"cohaptic 1 to peer" + both)
        return axes, bool(turns), peers, tick, update

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


def matrix_of(quaternion):
    """R, which turns vectors in body axes into world axes."""
    w, x, y, z = quaternion
    f = 2 / (w * w + x * x + y * y + z * z)
    return (
        (1 - f * (y * y + z * z), f * (x * y - w * z), f * (x * z + w * y)),
        (f * (x * y + w * z), 1 - f * (x * x + z * z), f * (y * z - w * x)),
        (f * (x * z - w * y), f * (y * z + w * x), 1 - f * (x * x + y * y)),
    )


def apply(matrix, vector):
    return tuple(sum(m * v for m, v in zip(row, vector)) for row in matrix)


def transposed(matrix):
    return tuple(zip(*matrix))


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


class Turn:
    """A damped body that turns, in its principal axes: J·ω' + ω×Jω = τ − b·ω, by Runge and Kutta's fourth order."""

    def __init__(self, inertia, damping, step):
        self.inertia, self.damping, self.step = inertia, damping, step
        self.quaternion, self.rate = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)

    def slope(self, state, torque):
        w, x, y, z, *rate = state
        spun = cross((x, y, z), rate)
        along = x * rate[0] + y * rate[1] + z * rate[2]
        gyration = cross(rate, [j * r for j, r in zip(self.inertia, rate)])
        rise = ((t - g - b * r) / j for t, g, b, r, j in zip(torque, gyration, self.damping, rate, self.inertia))
        return [-along / 2, *((w * r + s) / 2 for r, s in zip(rate, spun)), *rise]

    def move(self, torque):
        h, start = self.step, [*self.quaternion, *self.rate]
        moved = lambda slope, part: [s + part * d for s, d in zip(start, slope)]
        k1 = self.slope(start, torque)
        k2 = self.slope(moved(k1, h / 2), torque)
        k3 = self.slope(moved(k2, h / 2), torque)
        k4 = self.slope(moved(k3, h), torque)
        end = [s + h / 6 * (a + 2 * (b + c) + d) for s, a, b, c, d in zip(start, k1, k2, k3, k4)]
        norm = math.sqrt(sum(q * q for q in end[:4]))
        self.quaternion, self.rate = tuple(q / norm for q in end[:4]), tuple(end[4:])


class Sender:
    """What is held from another peer: the sample with the highest number; its initial state before the first."""

    def __init__(self, axes):
        self.states = [(0.0, 0.0)] * axes
        self.matrix, self.world_rate = matrix_of((1.0, 0.0, 0.0, 0.0)), (0.0, 0.0, 0.0)
        self.newest, self.heard = None, None
        self.received = self.late = 0

    def take(self, number, states, attitude, now):
        """Whether it is newer than what was held."""
        self.received += 1
        if self.newest is not None and number <= self.newest:
            self.late += 1
            return False
        self.newest, self.states, self.heard = number, states, now
        if attitude:
            self.matrix = matrix_of(attitude[:4])
            self.world_rate = apply(self.matrix, attitude[4:])
        return True


# --- The peer ----------------------------------------------------------------------------------------------------------------------------------


class Peer:
    def __init__(self, options, door, joining, axes, peers, tick_ns, update_ns):
        self.options, self.door, self.joining = options, door, joining
        self.axes, self.tick_ns, self.ticks_per_update = axes, tick_ns, max(1, round(update_ns / tick_ns))
        step = tick_ns * 1e-9
        self.device = Body(options.device_mass, options.device_damping, step, axes)
        if options.inertia:
            self.device.states = [(position, 0.0) for position in options.grasp]
        self.copy = Body(options.object_mass / peers, options.object_damping, step, axes)
        self.turn = None
        if options.inertia:
            # Gains and damping of the turn are those of the translation times J/m: each element of the mass as if it were alone.
            self.over_mass = [j / options.object_mass for j in options.inertia]
            damping = [options.object_damping * share for share in self.over_mass]
            self.turn = Turn([j / peers for j in options.inertia], damping, step)
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
            sample = encode_sample(self.options.session, self.options.place, self.sent, tick * self.tick_ns, self.copy.states, self.turn)
            self.send(self.joining.seal(sample) if self.joining else sample)
            self.sent += 1
        # 2. Take in what has arrived.
        now = time.monotonic()
        self.receive(now)
        self.begin_anew_after_silence(now)
        # 3. Forces. 4. Move.
        force_of_hand = self.options.force if tick * self.tick_ns < self.options.force_for * 1e9 else 0.0
        on_device, on_copy, coupling = self.forces(force_of_hand)
        torque = self.torque(coupling) if self.turn else None
        self.device.move(on_device)
        self.copy.move(on_copy)
        if self.turn:
            self.turn.move(torque)

    def forces(self, force_of_hand):
        options, on_device, on_copy, on_grasp = self.options, [], [], []
        # Of an object that turns the grasp point is held: xO + R·r, with the velocity vO + R·(ω×r).
        arm = swing = (0.0, 0.0, 0.0)
        if self.turn:
            matrix = matrix_of(self.turn.quaternion)
            arm, swing = apply(matrix, options.grasp), apply(matrix, cross(self.turn.rate, options.grasp))
        for axis in range(self.axes):
            (xh, vh), (xo, vo) = self.device.states[axis], self.copy.states[axis]
            # (9) FC = KC·(xH − xO) + BC·(vH − vO): what the device does to the copy.
            coupling = options.coupling[0] * (xh - xo - arm[axis]) + options.coupling[1] * (vh - vo - swing[axis])
            # (10) FT = KT·(xO − xd) + BT·(vO − vd), towards the mean of the samples held from the others.
            coordination = 0.0
            if self.others:
                xd = sum(other.states[axis][0] for other in self.others.values()) / len(self.others)
                vd = sum(other.states[axis][1] for other in self.others.values()) / len(self.others)
                coordination = options.coordination[0] * (xo - xd) + options.coordination[1] * (vo - vd)
            on_device.append((force_of_hand if axis == 0 else 0.0) - coupling)
            on_copy.append(coupling - coordination)
            on_grasp.append(coupling)
        return on_device, on_copy, on_grasp

    def torque(self, coupling):
        """r×RᵀFC − τT in body axes, with τT = BR∘(ω − Rᵀ·w̄) − 2·vee sk(RᵀM̄·P) and P = diag(½·ΣKR − KR)."""
        options, others = self.options, list(self.others.values())
        to_body = transposed(matrix_of(self.turn.quaternion))
        lever = cross(options.grasp, apply(to_body, coupling))
        if not others:
            return lever
        stiffness, damping = ([gain * share for share in self.over_mass] for gain in options.coordination)
        mean = [[sum(other.matrix[i][j] for other in others) / len(others) for j in range(3)] for i in range(3)]
        rate = apply(to_body, [sum(other.world_rate[i] for other in others) / len(others) for i in range(3)])
        weights = [sum(stiffness) / 2 - gain for gain in stiffness]
        apart = [[sum(to_body[i][k] * mean[k][j] for k in range(3)) * weights[j] for j in range(3)] for i in range(3)]
        spring = apart[2][1] - apart[1][2], apart[0][2] - apart[2][0], apart[1][0] - apart[0][1]
        return [t + s - b * (own - w) for t, s, b, own, w in zip(lever, spring, damping, self.turn.rate, rate)]

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
        sample = decode_sample(plain, self.options.session, self.axes, self.turn is not None) if plain else None
        if sample is None or sample[0] not in self.others:
            return False
        sender, number, states, attitude = sample
        if self.others[sender].take(number, states, attitude, now):
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
            "orientation": list(self.turn.quaternion) if self.turn else None,
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
        raise ValueError(f"{path} is not a key file: it must hold 64 hexadecimal digits")
    return bytes.fromhex(digits)


def gains(text):
    stiffness, damping = (float(part) for part in text.split(","))
    return stiffness, damping


def triple(text):
    x, y, z = (float(part) for part in text.split(","))
    return x, y, z


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
    parser.add_argument("--inertia", type=triple, metavar="X,Y,Z", help="of the whole object, about its own axes: it turns, kg·m² [it does not]")
    parser.add_argument("--grasp", type=triple, default=(0.0, 0.0, 0.0), metavar="X,Y,Z", help="from its centre, in its own axes, m [0,0,0]")
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
        joining, (axes, turns, peers, tick_ns, update_ns) = join(door, key, options.session, options.place, options.patience)
    else:
        joining, axes, turns, peers = None, options.axes, bool(options.inertia), options.peers
        tick_ns, update_ns = round(options.tick_ms * 1e6), round(options.update_ms * 1e6)
    if not (0 <= options.place < peers and tick_ns > 0):
        sys.exit("udp_peer: place, peers and periods do not fit together")
    if turns != bool(options.inertia) or (turns and axes != 3):
        sys.exit("udp_peer: the object of the session turns if, and only if, --inertia is given, and it has three axes then")
    peer = Peer(options, door, joining, axes, peers, tick_ns, update_ns)
    ticks = peer.run()
    print(json.dumps(peer.summary(ticks)))


if __name__ == "__main__":
    main()
