"""Radii of scenes whose devices exchange late or not at each tick, and the stiffness KC at which such scenes become unstable.

It shares no code with the program, and with the other files here only the step map of `held_force.py`, with `crossover.py`. One frame of a scene happens to the
unit vectors of its state, all at once: every quantity is the row of its coefficients in the state at the beginning of the frame. The eigenvalues of the
resulting matrix come from LAPACK, in double, of which the printed twelve digits are the same wherever it runs.
`python3 exchange.py` writes exchange.json in some seconds; numpy is all it needs.

Peers tick together, from the beginning of the frame on, which is the least common multiple of the update and of all exchanges. The state there:
    for each peer, device and copy, and with late readings what was read at the exchange before;
    for each peer, its samples of earlier frames that are on the way to anybody or held.
At a tick k of a peer with `exchange-every` E and `exchange-age` a, with r the reading and G the force that the device keeps:
    k mod E = 0:  r ← the device, or for a = 1 what was read at the exchange before;
    each tick:    FC = KC·(r − xO) + BC·(vr − vO) acts on the copy;
    k mod E = 0:  G ← FC;   −G acts on the device until the next exchange.
With offsets of clocks a frame may begin between two exchanges, so that r and G are states too; the tick of the frame's beginning is then not an exchange.
"""

import json
import math
import pathlib
import tomllib

import numpy as np

from held_force import step_map


def nanoseconds(text):
    for unit, factor in (("us", 1e3), ("ms", 1e6), ("s", 1e9)):
        if text.endswith(unit) and text.removesuffix(unit).replace(".", "").isdigit():
            return round(float(text.removesuffix(unit)) * factor)
    raise ValueError(text)


class Peer:
    def __init__(self, own, shared, mass):
        keys = {**shared, **own}
        for table in ("device", "coupling"):
            keys[table] = {**shared.get(table, {}), **own.get(table, {})}
        self.touches = keys.get("contact", "grasp") == "grasp"
        self.h = nanoseconds(keys.get("tick", "1ms"))
        self.offset = nanoseconds(keys.get("clock", {}).get("offset", "0ms"))
        self.phase = keys.get("phase", 0)
        device, coupling = keys["device"], keys["coupling"]
        self.every, self.late = device.get("exchange-every", 1), device.get("exchange-age", 0) == 1
        self.kc, self.bc = coupling["stiffness"], coupling["damping"]
        arm = (keys.get("hand") or {}).get("arm") or {"mass": 0.0, "damping": 0.0, "stiffness": 0.0}
        self.ka = arm["stiffness"]
        self.of_device = step_map(device["mass"] + arm["mass"], device["damping"] + arm["damping"], arm["stiffness"], self.h * 1e-9)
        self.of_copy = step_map(mass, 0.0, 0.0, self.h * 1e-9)


class Frame:
    def __init__(self, text, hz=0.0):
        """With `hz` the hand of the first peer pushes at each tick by e^(jωt), and the last column of all rows is what that does."""
        scene = tomllib.loads(text)
        count = len(scene["peers"])
        self.peers = peers = [Peer(peer, scene["peer"], scene["object"]["mass"] / count) for peer in scene["peers"]]
        law = scene["coordination"]
        pull = {"average-position": 1.0 / (count - 1), "proportional-derivative": 1.0}[law["strategy"]]
        kt, bt, update, delay = law["stiffness"], law["damping"], nanoseconds(law["update"]), nanoseconds(scene["link"]["delay"])
        self.frame = frame = math.lcm(update, *(peer.h * peer.every for peer in peers))
        # Ticks of the frame: the first one at or after its beginning may have any number, below 0 too.
        first = [-(peer.offset // peer.h) for peer in peers]
        ticks = sorted((peer.offset + peer.h * k, i, k) for i, peer in enumerate(peers) for k in range(first[i], first[i] + frame // peer.h))
        sends = [[at for at, j, k in ticks if j == i and (k - peer.phase) % (update // peer.h) == 0] for i, peer in enumerate(peers)]
        # Samples are named by their instant; a frame earlier each has another.
        reach = -(-(delay + 2 * update) // frame)
        earlier = [[at - frame * back for back in range(reach, 0, -1) for at in sends[i]] for i in range(count)]
        self.states = []
        for i in range(count):
            self.states += [("device", i, 0), ("device", i, 1), ("copy", i, 0), ("copy", i, 1)]
            self.states += [("latest", i, 0), ("latest", i, 1), ("reading", i, 0), ("reading", i, 1), ("kept", i, 0)]
            self.states += [("sample", i, at, part) for at in earlier[i] for part in (0, 1)]
        unit = np.eye(len(self.states) + 1, dtype=complex if hz else float)
        now = {state: unit[number] for number, state in enumerate(self.states)}
        zero, push = 0.0 * unit[-1], unit[-1]
        seen = []
        for instant in sorted({at for at, _, _ in ticks}):
            for i in range(count):
                if instant in sends[i]:
                    now["sample", i, instant, 0], now["sample", i, instant, 1] = now["copy", i, 0], now["copy", i, 1]
            before, moves = dict(now), {}
            for i, k in ((i, k) for at, i, k in ticks if at == instant):
                peer = peers[i]
                (xh, vh), (xo, vo) = ((before[body, i, 0], before[body, i, 1]) for body in ("device", "copy"))
                held = [max(at for at in earlier[j] + sends[j] if at + delay <= instant) for j in range(count) if j != i]
                others = [j for j in range(count) if j != i]
                heard = [(now["sample", j, at, 0], now["sample", j, at, 1]) for j, at in zip(others, held)]
                on_copy = -sum(pull * (kt * (xo - x) + bt * (vo - v)) for x, v in heard)
                exchanges = k % peer.every == 0
                if exchanges:
                    for part, device in ((0, xh), (1, vh)):
                        now["reading", i, part] = before["latest", i, part] if peer.late else device
                        now["latest", i, part] = device
                coupling = peer.kc * (now["reading", i, 0] - xo) + peer.bc * (now["reading", i, 1] - vo) if peer.touches else zero
                if exchanges:
                    now["kept", i, 0] = coupling
                hand = zero
                if i == 0 and hz:
                    phase = np.exp(2j * math.pi * hz * instant * 1e-9)
                    hand = phase * push
                    seen.append(vh / phase)
                moves["device", i] = peer.of_device, (xh, vh), hand - now["kept", i, 0]
                moves["copy", i] = peer.of_copy, (xo, vo), on_copy + coupling
            for (body, i), ((e, g), (x, v), force) in moves.items():
                for part in (0, 1):
                    now[body, i, part] = e[part, 0] * x + e[part, 1] * v + g[part] * force
        for i in range(count):
            shown = (earlier[i] + sends[i])[len(sends[i]) :]
            for at, newer in zip(earlier[i], shown):
                for part in (0, 1):
                    now["next", i, at, part] = now["sample", i, newer, part]
        rows = np.array([now[("next", *state[1:])] if state[0] == "sample" else now[state] for state in self.states])
        self.matrix, self.pushed = rows[:, :-1], rows[:, -1]
        # The component of the velocity of the first device at the frequency of the push.
        self.seen = sum(seen) / len(seen) if seen else None

    def admittance(self, hz):
        """v/Fh of the first device [m/s/N]: after a frame the motion is that at its beginning times e^(jω·frame)."""
        turn = np.exp(2j * math.pi * hz * self.frame * 1e-9)
        state = np.linalg.solve(turn * np.eye(len(self.states)) - self.matrix, self.pushed)
        return self.seen[:-1] @ state + self.seen[-1]

    def radius(self):
        """Without the displacements that nothing resists, of the whole scene and of each device that touches nothing, counted from the first copy."""
        loose = {("device", i, 0) for i, peer in enumerate(self.peers) if not peer.touches and peer.ka == 0}
        idle = {(what, i) for i, peer in enumerate(self.peers) if not peer.touches for what in ("latest", "reading", "kept")}
        kept = [n for n, state in enumerate(self.states) if state not in loose and state[:2] not in idle]
        matrix, states = self.matrix[np.ix_(kept, kept)], [self.states[n] for n in kept]
        if not any(peer.touches and peer.ka > 0 for peer in self.peers):
            reference = states.index(("copy", 0, 0))
            arm = {i for i, peer in enumerate(self.peers) if not peer.touches}
            moved = np.array([float(state[-1] == 0 and state[0] != "kept" and not (state[0] == "device" and state[1] in arm)) for state in states])
            matrix = matrix - np.outer(moved, matrix[reference])
            matrix = np.delete(np.delete(matrix, reference, 0), reference, 1)
        return max(abs(np.linalg.eigvals(matrix)))


def scene(exchanges, kc=1000.0, kt=500.0, bc=5.0, delay="24ms", update="8ms", strategy="average-position", lines=None):
    """Peers named a, b, c, … whose devices have the given E and a. `lines` has further lines of the tables of some."""
    text = f"""scene = {{ duration = "10s" }}
object = {{ mass = 0.45 }}
coordination = {{ strategy = "{strategy}", stiffness = {kt}, damping = 5.0, update = "{update}" }}
peer = {{ device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = {kc}, damping = {bc} }} }}
link = {{ delay = "{delay}" }}
"""
    for number, (every, age) in enumerate(exchanges):
        text += f'[[peers]]\nname = "{chr(97 + number)}"\ndevice = {{ exchange-every = {every}, exchange-age = {age} }}\n'
        text += "".join(f"{line}\n" for line in (lines or {}).get(number, []))
    return text


ARM = "hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 }, follows = { position = 0.0 } }"


def cases():
    yield "two-late", scene([(2, 1)] * 2)
    yield "two-late-stiff", scene([(2, 1)] * 2, kc=3500.0)
    yield "each-tick-late", scene([(1, 1)] * 2, kc=2000.0)
    yield "two", scene([(2, 0)] * 2, kc=5000.0)
    yield "eleven", scene([(11, 0)] * 2)
    yield "eleven-late", scene([(11, 1)] * 2, kc=300.0)
    yield "five-of-eight", scene([(5, 0)] * 3, kc=2000.0, delay="11.3ms")
    yield "one-slow", scene([(4, 1), (1, 0)], kc=800.0)
    yield "three-unlike", scene([(2, 0), (3, 1), (1, 1)], kc=600.0)
    yield "four-classes", scene([(4, 0), (4, 0), (2, 1), (2, 1)], kc=700.0, strategy="proportional-derivative", kt=200.0)
    yield "arm", scene([(4, 1), (4, 1)], kc=600.0, lines={0: [ARM]})
    yield "one-touches-nothing", scene([(4, 0), (4, 0)], lines={1: ['contact = "none"']})
    yield "other-ticks", scene([(2, 0), (3, 1)], kc=500.0, lines={0: ['tick = "2ms"']})
    offsets = {0: ['clock = { offset = "2300us" }'], 1: ['clock = { offset = "1ms" }', "phase = 3"]}
    yield "offset-between-exchanges", scene([(4, 1), (3, 0)], kc=600.0, lines=offsets)
    yield "without-delay", scene([(8, 0)] * 2, kc=900.0, delay="0ms")


# Stable scenes in which the hand of the first peer is pushed.
PUSHED = ("two-late", "eleven", "three-unlike", "other-ticks", "arm", "offset-between-exchanges")


def points(text):
    for hz in (0.5, 7.3, 40.0):
        found = Frame(text, hz).admittance(hz)
        yield {"hz": hz, "re": f"{found.real:.12e}", "im": f"{found.imag:.12e}"}


# The table of the page: rates of 1 kHz, 500 Hz, 250 Hz, 200 Hz, 125 Hz and 90.9 Hz at a tick of 1 ms.
RATES = (1, 2, 4, 5, 8, 11)


def boundaries():
    """Name, and KT, BC, E, a. The range of KC is that in which the scene becomes unstable as KC grows."""
    for age in (0, 1):
        for every in RATES:
            yield f"every-{every}-age-{age}", {"exchanges": [(every, age)] * 2}
    for every in (1, 2, 4, 11):
        yield f"soft-every-{every}-age-1", {"exchanges": [(every, 1)] * 2, "kt": 300.0, "bc": 2.0}


def crossing(keys):
    """The largest KC below which a stable range ends: a scan by a hundredth finds the last stable value, halving the end of the range."""
    def stable(kc):
        return Frame(scene(kc=kc, **keys)).radius() < 1

    kc = 20000.0
    while not stable(kc):
        kc /= 1.02
    low, high = kc, kc * 1.02
    while high - low > 1e-6:
        middle = (low + high) / 2
        low, high = (middle, high) if stable(middle) else (low, middle)
    return (low + high) / 2


def entries():
    radii = [{"name": name, "scene": text, "radius": f"{Frame(text).radius():.12f}"} for name, text in cases()]
    found = [{"name": name, "scene": scene(**keys), "crossing": f"{crossing(keys):.5f}"} for name, keys in boundaries()]
    pushed = [{"name": name, "scene": text, "points": list(points(text))} for name, text in cases() if name in PUSHED]
    return {"radii": radii, "boundaries": found, "admittance": pushed}


if __name__ == "__main__":
    target = pathlib.Path(__file__).parent / "exchange.json"
    target.write_text(json.dumps(entries(), indent=2, ensure_ascii=False) + "\n")
