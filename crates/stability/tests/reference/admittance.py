"""The admittance v/Fh of one peer's device, by lifting in mpmath: the fundamental harmonic of the periodic loop.

With Fh(k) = e^{jωkTc} held over each tick, the state at the beginnings of frames is Z·e^{jωfTn}, Z = (e^{jωTn} − M)⁻¹·Σ B_k·e^{jωkTc}; the device's velocity
at its ticks, v(k)·e^{−jωkTc}, has the period of a frame, and the admittance is its mean. Ticks are counted on the peer's own clock, so an offset changes
nothing. `first_tick_magnitude_db` is that of the velocity at the first tick of each frame alone, without the mean. Every other hand is free: no force, but arms keep their impedance, the peer's own as well, with a wanted motion of zero.

`simulated` lets the loop run in double from rest, tick by tick, under the complex force, as an independent check of the algebra: `check` compares it at some points.
"""

import math
import sys

import mpmath
import numpy as np
from mpmath import mpf

from cases import EVERY_DIFFERENT, NONE, PD
from monodromy import Frame, rigid_modes
from plant import Double, Exact, Maps
from radius import digits
from scene import parse
from text import arm, scene


class Lifted:
    """The lifted loop of one peer, for any number of frequencies."""

    def __init__(self, scene_, peer):
        self.scene, self.peer = scene_, peer
        self.tick = scene_.peers[peer].tick
        frame = Frame(scene_, Exact, forced=peer)
        # Velocities do not depend on where everything is, so what is left out has no part in the outputs.
        self.a, self.b, self.outputs = relative(scene_, frame)
        self.states = len(self.a)

    def at(self, hz):
        omega = 2 * mpmath.pi * mpf(float(hz))
        tick = mpf(self.tick) / 10**9
        turns = np.array([mpmath.expj(omega * tick * k) for k in range(len(self.outputs))], dtype=object)
        n = self.states
        with mpmath.workdps(60):
            system = mpmath.matrix((-self.a).tolist())
            whole = mpmath.expj(omega * mpf(self.scene.update) / 10**9)
            for i in range(n):
                system[i, i] += whole
            start = mpmath.lu_solve(system, mpmath.matrix((self.b @ turns).tolist()))
        start = np.array(list(start), dtype=object)
        velocity = [row[:n] @ start + row[n:] @ turns for row in self.outputs]
        turned = [v / turn for v, turn in zip(velocity, turns)]
        return sum(turned) / len(turns), turned[0]


def relative(scene_, frame):
    """The matrix, the inputs and the outputs of a frame in relative coordinates, in which the displacement of everything together is left out.

    As it changes nothing, M has an eigenvalue 1, and e^{jωTn} − M is singular at every multiple of the rate of frames, though nothing special happens
    there. With e that displacement, x the reference and z = z' + x·e: z'⁺ = (M − e·(row of x of M))·z' + (B − e·(row of x of B))·f, and velocities see z' as
    they see z. The same for each device that touches nothing, whose position is seen by nobody.
    """
    states, matrix, inputs, outputs = frame.states, frame.matrix, frame.inputs, frame.outputs
    left_out = set()
    for mode in rigid_modes(scene_):
        if mode == "scene":
            reference = states.index(("xO", 0))
            moves = [1 if "x" in state[0] and (state[0] != "xH" or scene_.peers[state[1]].touches) else 0 for state in states]
        else:
            reference = states.index(("xH", mode[1]))
            moves = [1 if place == reference else 0 for place in range(len(states))]
        n = len(states)
        assert all(abs(a - b) < 1e-90 for a, b in zip(matrix @ moves, moves)), "displacing everything must change nothing"
        assert all(abs(row[:n] @ moves) < 1e-90 for row in outputs), "a displacement is no velocity"
        matrix = matrix - [[c * value for value in matrix[reference]] for c in moves]
        inputs = inputs - [[c * value for value in inputs[reference]] for c in moves]
        left_out.add(reference)
    keep = [place for place in range(len(states)) if place not in left_out]
    columns = keep + list(range(len(states), len(states) + inputs.shape[1]))
    return matrix[keep][:, keep], inputs[keep], [row[columns] for row in outputs]


def decibels(value):
    return 20 * mpmath.log10(abs(value))


def degrees(value):
    return mpmath.degrees(mpmath.arg(value))


def simulated(scene_, peer, hz, settle, periods):
    """The same in the time domain, in double, for scenes in which all peers tick together: no rows, no matrices, no frames."""
    count, tick = len(scene_.peers), scene_.peers[0].tick
    assert all(p.tick == tick and p.offset == 0 and not p.compute_delay for p in scene_.peers)
    every = scene_.update // tick
    maps = [Maps(Double, scene_, p, count) for p in scene_.peers]
    device, copy = np.zeros((count, 2), dtype=complex), np.zeros((count, 2), dtype=complex)
    # Samples with the tick at which they were sent, and the forces of the tick before.
    held = {pair: (0, np.zeros(2, dtype=complex)) for pair in scene_.links}
    lagging = np.zeros(count, dtype=complex)
    past = [[np.zeros(2, dtype=complex) for _ in range(scene_.looks_back(i))] for i in range(count)]
    delay = {pair: -(-link.delay // tick) for pair, link in scene_.links.items()}
    flying = {pair: [] for pair in scene_.links}

    def by_now(sent, state, k):
        """Where the law believes a sender to be at tick k."""
        if scene_.horizon is None:
            return state
        return state + np.array([min((k - sent) * tick, scene_.horizon) * 1e-9 * state[1], 0])

    omega = 2 * math.pi * hz * tick * 1e-9
    steps = periods * round(2 * math.pi / omega)
    assert abs(omega * steps / periods - 2 * math.pi) < 1e-9, "a whole number of ticks a period"
    first = -(-settle // every) * every
    assert steps % every == 0
    total = 0
    for k in range(first + steps):
        for (j, i), queue in flying.items():
            if k >= scene_.peers[j].phase and (k - scene_.peers[j].phase) % every == 0:
                queue.append((k + delay[j, i], k, copy[j].copy()))
            while queue and queue[0][0] <= k:
                held[j, i] = queue.pop(0)[1:]
        if k >= first:
            total += device[peer][1] * np.exp(-1j * omega * k)
        for i in range(count):
            m, target = maps[i], sum(by_now(*held[j, i], k) for j in range(count) if j != i) / (count - 1)
            fc = 0.0
            if scene_.peers[i].touches:
                fc = m.kc * (device[i][0] - copy[i][0]) + m.bc * (device[i][1] - copy[i][1])
            past[i].append(copy[i].copy())
            own = past[i].pop(0)
            ft = m.kt * (own[0] - target[0]) + m.bt * (own[1] - target[1])
            if scene_.lag is not None:
                ft = lagging[i] = m.kept * lagging[i] + (1 - m.kept) * ft
            hand = np.exp(1j * omega * k) if i == peer else 0.0
            device[i] = m.device[0] @ device[i] + m.device[1] * (hand - fc)
            copy[i] = m.copy[0] @ copy[i] + m.copy[1] * (fc - ft)
    return total / steps


def paper(n, **keys):
    """One peer touches, the delay is one period."""
    return scene(n, 1000.0, delay="8ms", peers=[""] + [NONE] * (n - 1), **keys)


def cases():
    """(name, scene, place of the peer, frequencies, why)."""
    yield "anchor-n2", paper(2), 0, [0.01, 0.1, 1.0, 7.3, 40.0], "control.md: −29.01 dB at 0.01 Hz, which is the first tick's; see README.md"
    yield "anchor-n3-ap", paper(3), 0, [0.01, 0.1, 1.0, 10.0, 60.0], "control.md: −32.03 dB at 0.01 Hz, which is the first tick's; see README.md"
    yield "anchor-n3-pd", paper(3, strategy=PD), 0, [0.01, 0.1, 1.0, 10.0, 60.0], "control.md: −37.61 dB at 0.01 Hz, which is the first tick's; see README.md"
    yield "above-the-rate-of-samples", paper(2), 0, [62.5, 100.0, 125.0, 300.0, 499.0], "half the rate of the samples, that rate, and near half that of the ticks"
    yield "24ms", scene(3, 500.0, strategy=PD, delay="24ms", bo=2.0), 1, [0.5, 5.0, 15.0], "all touch"
    yield "one-who-does-not-touch", scene(3, 1000.0, delay="8ms", peers=["", "", NONE]), 2, [0.1, 3.0], "the device alone, sampled and held"
    yield "arms", scene(2, 1000.0, delay="3ms", hand=arm(0.3, 10.0, 100.0)), 0, [0.01, 1.0, 5.0], "both arms keep their impedance"
    yield "every-peer-different", scene(3, 800.0, delay="8ms", peers=EVERY_DIFFERENT), 1, [0.2, 4.0, 25.0], "no symmetry"
    yield "ideal-network", scene(2, 1000.0), 0, [0.01, 2.0, 20.0], "no delay"
    yield (
        "two-ticks-and-offset",
        scene(2, 800.0, delay="3ms", peers=["", 'tick = "2ms"; clock = { offset = "300us" }']),
        1,
        [0.3, 6.0],
        "ticks of the peer's own clock",
    )
    yield "compute-delay", scene(2, 700.0, kc=1500.0, delay="8ms", compute_delay=1), 0, [0.3, 6.0], "the hand's own force is not delayed"


def group(place):
    return group_of(*list(cases())[place])


def group_of(name, text, peer, frequencies, why):
    made = parse(text)
    lifted = Lifted(made, peer)
    entries_ = []
    for hz in frequencies:
        value, first = lifted.at(hz)
        entries_.append(
            {
                "name": f"{name}-{hz:g}hz",
                "scene": text,
                "peer": made.peers[peer].name,
                "hz": hz,
                "magnitude_db": digits(decibels(value), 30),
                "phase_deg": digits(degrees(value), 30),
                "first_tick_magnitude_db": digits(decibels(first), 30),
                "why": why,
            }
        )
        print(f"{digits(decibels(value), 10)} dB  {digits(degrees(value), 10)}°  {name} {hz:g} Hz", file=sys.stderr, flush=True)
    return entries_


def places_to_check():
    """(scene, place of the peer, frequency, ticks to settle)"""
    different = scene(3, 800.0, delay="8ms", peers=EVERY_DIFFERENT)
    # The last two have a mode that decays by 0.2 % a frame only.
    return (paper(3), 0, 5.0, 30_000), (different, 1, 25.0, 30_000), (paper(2), 0, 62.5, 100_000), (paper(2), 0, 125.0, 100_000)


def check(places):
    """Lifting against simulation."""
    for text, peer, hz, settle in places:
        made = parse(text)
        exact = complex(Lifted(made, peer).at(hz)[0])
        seen = simulated(made, peer, hz, settle, 4)
        assert abs(seen - exact) < 1e-8 * abs(exact), (seen, exact)
        print(f"lifted {exact:.10g}, simulated {seen:.10g}", file=sys.stderr, flush=True)


def entries(pool):
    check(places_to_check())
    return sum(pool.imap(group, range(len(list(cases()))), chunksize=1), [])
