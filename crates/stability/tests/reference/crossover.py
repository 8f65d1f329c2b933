"""Radii of scenes in which people track a target by the law crossover, and the values of ωc at which these scenes become unstable.

It shares no code with the program, and with the other files here only the step map of `held_force.py`, with `exchange.py`. One frame of a scene happens to the
unit vectors of its state, all at once: every quantity is the row of its coefficients in the state at the beginning of the frame. The eigenvalues of the
resulting matrix come from LAPACK, in double, of which the printed twelve digits are the same wherever it runs.
`python3 crossover.py` writes crossover.json in some seconds; numpy is all it needs.

The state, at the beginning of a frame (an instant that is a multiple of the update, before anything happens at it):
    for each peer, device and copy, with a compute delay the forces of its last tick, with an operator the wanted place and the places seen at its last m ticks;
    for each peer, its samples of earlier frames that are on the way to anybody or held.
Where the target is the origin and stays there, a tick of an operator is
    S(k) = the position of its copy, or of the sample that its peer holds of another;   vw = −ωc·S(k − m);
    the hand pulls with ka·xw + ba·vw over the tick;   xw ← xw + h·vw.
"""

import json
import math
import pathlib
import tomllib

import numpy as np

from held_force import step_map

UPDATE = 0.008


def seconds(text):
    for unit, factor in (("ms", 1e-3), ("s", 1.0)):
        if text.endswith(unit):
            return float(text.removesuffix(unit)) * factor
    raise ValueError(text)


class Peer:
    def __init__(self, own, shared, names, mass, split):
        keys = {**shared, **own}
        self.name, self.touches = keys["name"], keys.get("contact", "grasp") == "grasp"
        self.h = seconds(keys.get("tick", "1ms"))
        self.delayed = keys.get("compute-delay", 0) == 1
        self.kc, self.bc = keys["coupling"]["stiffness"], keys["coupling"]["damping"]
        hand = keys.get("hand") or {}
        operator = hand.get("operator") if isinstance(hand, dict) else None
        arm = (operator or hand).get("arm") or {}
        self.rate = None
        if operator:
            arm = {"mass": 0.5, "damping": 20.0, "stiffness": 300.0, **arm}
            if operator["law"] == "crossover" and self.touches:
                self.rate = operator.get("crossover", 3.0)
                self.lag = math.ceil(round(seconds(operator.get("visual-delay", "200ms")) / self.h, 9))
                sees = operator.get("sees", "own")
                self.sees = None if sees == "own" else names.index(sees)
        self.ka, self.ba = arm.get("stiffness", 0.0), arm.get("damping", 0.0)
        device = keys["device"]
        self.of_device = step_map(device["mass"] + arm.get("mass", 0.0), device["damping"] + self.ba, self.ka, self.h)
        self.of_copy = step_map(mass / split, 0.0, 0.0, self.h)


class Frame:
    def __init__(self, text):
        scene = tomllib.loads(text)
        names = [peer["name"] for peer in scene["peers"]]
        count = len(names)
        peers = [Peer(peer, scene.get("peer", {}), names, scene["object"]["mass"], count) for peer in scene["peers"]]
        assert seconds(scene["coordination"]["update"]) == UPDATE
        pull = {"average-position": 1.0 / (count - 1), "proportional-derivative": 1.0}[scene["coordination"]["strategy"]]
        kt, bt = scene["coordination"]["stiffness"], scene["coordination"]["damping"]
        delay = round(seconds(scene["link"]["delay"]) * 1e6)
        update = round(UPDATE * 1e6)
        oldest = -(-delay // update)
        self.states = []
        for i, peer in enumerate(peers):
            self.states += [("device", i, 0), ("device", i, 1), ("copy", i, 0), ("copy", i, 1)]
            if peer.delayed:
                self.states += [("waits", i, 0), ("waits", i, 1)]
            if peer.rate is not None:
                self.states += [("wanted", i)] + [("seen", i, age) for age in range(1, peer.lag + 1)]
            self.states += [("sample", i, age, part) for age in range(1, oldest + 1) for part in (0, 1)]
        place = {state: number for number, state in enumerate(self.states)}
        unit = np.eye(len(self.states))
        now = {state: unit[number] for state, number in place.items()}
        sent = {(i, -age): (now["sample", i, age, 0], now["sample", i, age, 1]) for i in range(count) for age in range(1, oldest + 1)}
        seen = [[now["seen", i, age] for age in range(peer.lag, 0, -1)] if peer.rate is not None else [] for i, peer in enumerate(peers)]
        zero = np.zeros(len(self.states))
        for i in range(count):
            sent[i, 0] = (now["copy", i, 0], now["copy", i, 1])
        ticks = sorted((round(peer.h * 1e6) * k, i) for i, peer in enumerate(peers) for k in range(round(UPDATE / peer.h)))
        for instant in sorted({at for at, _ in ticks}):
            newest = (instant - delay) // update
            before, moves = dict(now), {}
            for i in (i for at, i in ticks if at == instant):
                peer = peers[i]
                (xh, vh), (xo, vo) = ((before[body, i, 0], before[body, i, 1]) for body in ("device", "copy"))
                held = {j: sent[j, newest] for j in range(count) if j != i}
                on_copy = -sum(pull * (kt * (xo - x) + bt * (vo - v)) for x, v in held.values())
                coupling = peer.kc * (xh - xo) + peer.bc * (vh - vo) if peer.touches else zero
                on_copy = on_copy + coupling
                if peer.delayed:
                    waits = coupling, on_copy
                    coupling, on_copy = before["waits", i, 0], before["waits", i, 1]
                    now["waits", i, 0], now["waits", i, 1] = waits
                hand = zero
                if peer.rate is not None:
                    seen[i].append(xo if peer.sees is None else held[peer.sees][0])
                    speed = -peer.rate * seen[i][-1 - peer.lag]
                    hand = peer.ka * now["wanted", i] + peer.ba * speed
                    now["wanted", i] = now["wanted", i] + peer.h * speed
                moves["device", i] = peer.of_device, (xh, vh), hand - coupling
                moves["copy", i] = peer.of_copy, (xo, vo), on_copy
            for (body, i), ((e, g), (x, v), force) in moves.items():
                for part in (0, 1):
                    now[body, i, part] = e[part, 0] * x + e[part, 1] * v + g[part] * force
        for i, peer in enumerate(peers):
            for age in range(1, oldest + 1):
                now["sample", i, age, 0], now["sample", i, age, 1] = sent[i, 1 - age]
            if peer.rate is not None:
                for age in range(1, peer.lag + 1):
                    now["seen", i, age] = seen[i][-age]
        self.matrix = np.array([now[state] for state in self.states])
        # States that move nothing: the position of a device that touches nothing on a hand without a spring, and the wanted place of an arm without a
        # spring.
        loose = {("device", i, 0) for i, peer in enumerate(peers) if not peer.touches and peer.ka == 0}
        loose |= {("wanted", i) for i, peer in enumerate(peers) if peer.ka == 0}
        kept = [number for number, state in enumerate(self.states) if state not in loose]
        assert any(peer.touches and (peer.ka > 0 or peer.rate is not None) for peer in peers), "nothing ties the scene to a place"
        self.matrix = self.matrix[np.ix_(kept, kept)]

    def radius(self):
        return max(abs(np.linalg.eigvals(self.matrix)))


def scene(hands, kt=1000.0, delay="24ms", strategy="average-position", lines=None):
    """People named a, b, c, … with the given hands, None for no hand. `lines` has further lines of the tables of some."""
    text = f"""scene = {{ duration = "10s" }}
object = {{ mass = 0.45 }}
coordination = {{ strategy = "{strategy}", stiffness = {kt}, damping = 5.0, update = "8ms" }}
peer = {{ device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = 3500.0, damping = 5.0 }} }}
link = {{ delay = "{delay}" }}
task = {{ kind = "track", sines = [{{ amplitude = 0.02, frequency = 0.1 }}] }}
"""
    for number, hand in enumerate(hands):
        text += f'[[peers]]\nname = "{chr(97 + number)}"\n'
        text += f"hand = {{ {hand} }}\n" if hand else ""
        text += "".join(f"{line}\n" for line in (lines or {}).get(number, []))
    return text


def operator(rate=3.0, **keys):
    text = ", ".join([f"crossover = {rate}"] + [f"{key.replace('_', '-')} = {value}" for key, value in keys.items()])
    return f'operator = {{ law = "crossover", {text} }}'


SECOND = {"sees": '"b"'}
ARM = "arm = { mass = 0.5, damping = 20.0, stiffness = 300.0 }"


def cases():
    yield "arm-alone", scene([ARM, None])
    yield "own", scene([operator(), None])
    yield "sees-the-second", scene([operator(**SECOND), None])
    yield "both-own", scene([operator(2.0), operator(2.0)])
    yield "three", scene([operator(), None, None])
    yield "soft-and-late-sees-the-second", scene([operator(**SECOND), None], kt=200.0, delay="100ms")
    # Beyond the page: classes, differences and ticks.
    yield "four-two-own", scene([operator(2.5), operator(2.5), None, None])
    yield "three-pd-own", scene([operator(1.5)] * 3, kt=400.0, strategy="proportional-derivative")
    yield "each-sees-the-other", scene([operator(2.0, sees='"b"'), operator(2.0, sees='"a"')])
    yield "two-see-a-third", scene([operator(1.5, sees='"c"')] * 2 + [None])
    yield "unequal-eyes", scene([operator(2.0, visual_delay='"150ms"'), operator(2.0, visual_delay='"250ms"')])
    yield "within-a-frame", scene([operator(9.0, visual_delay='"3ms"'), None], delay="3ms")
    yield "at-once", scene([operator(9.0, visual_delay='"0ms"', **SECOND), None], delay="0ms")
    yield "not-whole", scene([operator(visual_delay='"180.4ms"'), None], delay="11.3ms")
    # Two people watch one copy: hands that pull against each other and leave this copy at the target are at rest.
    yield "both-watch-one-copy", scene([operator(2.0, **SECOND), operator(1.0)])
    yield "compute-delay", scene([operator(), operator(2.0)], lines={0: ["compute-delay = 1"]})
    yield "compute-delay-sees-the-second", scene([operator(**SECOND), None], lines={0: ["compute-delay = 1"]})
    yield "slow-eye", scene([operator(), None], lines={0: ['tick = "2ms"']})
    yield "slow-hand", scene([operator(**SECOND), None], lines={1: ['tick = "2ms"'], 0: ['tick = "4ms"']})
    yield "one-touches-nothing", scene([operator(), operator()], lines={1: ['contact = "none"']})
    yield "without-a-spring", scene([operator(1.0, arm="{ mass = 0.5, damping = 20.0, stiffness = 0.0 }"), None])
    yield "heavy-arm", scene([operator(arm="{ mass = 2.0, damping = 60.0, stiffness = 900.0 }"), None])


def boundaries():
    for name, keys, where in (
        ("own", {}, {}),
        ("sees-the-second", SECOND, {}),
        ("soft-and-late-own", {}, {"kt": 200.0, "delay": "100ms"}),
        ("soft-and-late-sees-the-second", SECOND, {"kt": 200.0, "delay": "100ms"}),
    ):
        yield name, lambda rate, keys=keys, where=where: scene([operator(rate, **keys), None], **where)


def crossing(make, low=1.0, high=14.0):
    """The ωc at which a scene that is stable at `low` becomes unstable, by halving. A scan in steps of 0.25 finds no other change."""
    stable = [Frame(make(low + 0.25 * step)).radius() < 1 for step in range(round((high - low) / 0.25) + 1)]
    assert stable == sorted(stable, reverse=True) and stable[0] and not stable[-1]
    high = low + 0.25 * stable.index(False)
    low = high - 0.25
    while high - low > 1e-7:
        middle = (low + high) / 2
        low, high = (middle, high) if Frame(make(middle)).radius() < 1 else (low, middle)
    return (low + high) / 2


def entries():
    radii = [{"name": name, "scene": text, "radius": f"{Frame(text).radius():.12f}"} for name, text in cases()]
    found = [{"name": name, "scene": make(3.0), "crossing": f"{crossing(make):.5f}"} for name, make in boundaries()]
    return {"radii": radii, "boundaries": found}


if __name__ == "__main__":
    target = pathlib.Path(__file__).parent / "crossover.json"
    target.write_text(json.dumps(entries(), indent=2, ensure_ascii=False) + "\n")
