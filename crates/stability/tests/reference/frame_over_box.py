"""A frame of a scene over a box of gains: every entry as a mean, a slope along each gain, and a radius for all else, rounding included.

With sᵢ ∈ [−1, 1] where in the box a gain is, an entry is mean + Σ sᵢ·slopeᵢ + e with |e| ≤ radius. Rows of such entries, coefficients of the state at the
beginning of a frame, go through what happens in the frame: sample, deliver, forces, move.

The averages of the classes of equal peers are one part of the motion; how the members of a class differ is another, one peer that hears its own samples
times −1/(N−1). Only average-position and proportional-derivative coordination between equal clocks and over equal links without chance are covered.
"""

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import product as tuples

from timing import Timing

EPS = 2.0**-52
# Radii are sums of products; a few roundings of each are far below this.
UP = 1 + 2.0**-40
NUMBERS = 2


class NotCovered(ValueError):
    """The scene has something of which nothing is said here."""


@dataclass
class Scalar:
    """A number over a box."""

    mean: float
    slopes: list
    radius: float


def scalar(mean, slopes=(Fraction(0),) * NUMBERS) -> Scalar:
    """The nearest doubles of an exact affine number, and how far they are from it."""
    exact = [Fraction(mean), *map(Fraction, slopes)]
    near = [float(number) for number in exact]
    off = sum(abs(number - Fraction(double)) for number, double in zip(exact, near))
    return Scalar(near[0], near[1:], float(off) * UP + 5e-324 if off else 0.0)


class Row:
    """Numbers over a box, one a state."""

    __slots__ = ("mean", "slopes", "radius")

    def __init__(self, mean, slopes, radius):
        self.mean, self.slopes, self.radius = mean, slopes, radius

    @classmethod
    def zeros(cls, size):
        return cls([0.0] * size, [[0.0] * size for _ in range(NUMBERS)], [0.0] * size)

    @classmethod
    def unit(cls, size, place):
        row = cls.zeros(size)
        row.mean[place] = 1.0
        return row

    def entry(self, place) -> Scalar:
        return Scalar(self.mean[place], [slopes[place] for slopes in self.slopes], self.radius[place])

    def uneven(self):
        """The largest size of all but the mean."""
        return [sum(map(abs, slopes)) + radius for *slopes, radius in zip(*self.slopes, self.radius)]

    def __add__(self, other):
        return self._with(other, lambda a, b: a + b)

    def __sub__(self, other):
        return self._with(other, lambda a, b: a - b)

    def _with(self, other, operation):
        mean = list(map(operation, self.mean, other.mean))
        slopes = [list(map(operation, a, b)) for a, b in zip(self.slopes, other.slopes)]
        # Each sum is off by half a unit of its last place.
        rounded = [EPS * (abs(m) + sum(map(abs, s))) for m, *s in zip(mean, *slopes)]
        radius = [(a + b + c) * UP for a, b, c in zip(self.radius, other.radius, rounded)]
        return Row(mean, slopes, radius)

    def times(self, by: Scalar):
        mean = [by.mean * m for m in self.mean]
        slopes = [[by.mean * s + slope * m for s, m in zip(of, self.mean)] for of, slope in zip(self.slopes, by.slopes)]
        slope = sum(map(abs, by.slopes))
        size = abs(by.mean) + slope + by.radius
        radius = [
            (abs(by.mean) * r + slope * u + by.radius * (abs(m) + u) + 4 * EPS * size * (abs(m) + u)) * UP + 1e-300
            if m or u
            else 0.0
            for m, u, r in zip(self.mean, self.uneven(), self.radius)
        ]
        return Row(mean, slopes, radius)


@dataclass
class Frame:
    mean: list
    slopes: list
    radius: list


def step(mass, damping, stiffness, span):
    """Increments of one step of m·a = f − b·v − k·x with f held: e00, e01, e10, e11, g0, g1, exact but for 10⁻⁴⁰ of what they are at most."""
    h = Fraction(span, 10**9)
    x = [[Fraction(0), h, Fraction(0)], [-stiffness / mass * h, -damping / mass * h, h / mass], [Fraction(0)] * 3]
    norm = max(sum(map(abs, row)) for row in x)
    if norm > 20:
        raise NotCovered("a body that moves by far within a tick")
    grid = 2**400
    short = lambda number: Fraction(round(number * grid), grid)
    total, term, bound = [[Fraction(0)] * 3 for _ in range(3)], [[Fraction(i == j) for j in range(3)] for i in range(3)], Fraction(1)
    number = 0
    while number < 2 * norm + 4 or bound > Fraction(1, 10**60):
        number += 1
        term = [[short(sum(term[i][k] * x[k][j] for k in range(3)) / number) for j in range(3)] for i in range(3)]
        total = [[a + b for a, b in zip(*rows)] for rows in zip(total, term)]
        bound = bound * norm / number
    return total[0][0], total[0][1], total[1][0], total[1][1], total[0][2], total[1][2]


@dataclass(frozen=True)
class Numbers:
    """The numbers of a peer at a corner of the box, exact."""

    device: tuple
    copy: tuple
    kc: Fraction
    bc: Fraction
    kt: Fraction
    bt: Fraction


def numbers_of(scene, peer) -> Numbers:
    n = len(scene.peers)
    arm = peer.arm or (0.0, 0.0, 0.0)
    device = tuple(Fraction(own) + Fraction(of_arm) for own, of_arm in zip((peer.device_mass, peer.device_damping, 0.0), arm))
    mass = Fraction(scene.mass) / (n if scene.split else 1)
    scale = Fraction(2, n) if peer.coupling_scaling else Fraction(1)
    kc, bc = (Fraction(gain) * scale for gain in peer.coupling)
    # PD is AP with N − 1 times both gains.
    scale = Fraction(n - 1) if scene.proportional_derivative else Fraction(1)
    if scene.inverse_n:
        scale *= Fraction(4 * (n - 1), n * n)
    return Numbers(device, (mass, Fraction(scene.damping), Fraction(0)), kc, bc, Fraction(scene.stiffness) * scale, Fraction(scene.rate) * scale)


class Box:
    """The scenes at the corners of a box: number b is at its upper end where bit b of the corner's place is set."""

    def __init__(self, corners):
        self.corners = corners
        for scene in corners:
            if scene.lag is not None or scene.horizon is not None or scene.own_age is not None:
                raise NotCovered("a law other than average-position and proportional-derivative")
            if len({(p.tick, p.offset, p.phase, p.compute_delay) for p in scene.peers}) > 1 or scene.peers[0].compute_delay:
                raise NotCovered("clocks that differ, or a compute delay")
            if any(link != scene.links[0, 1] or link.loss or link.uniform_sd for link in scene.links.values()):
                raise NotCovered("links that differ, or chance")
        self.numbers = [[numbers_of(scene, peer) for peer in scene.peers] for scene in corners]
        if len({tuple((n.device, n.copy) for n in corner) for corner in self.numbers}) > 1:
            raise NotCovered("masses or dampings that vary")

    def gain(self, peer, name) -> Scalar:
        low, first, second, both = (getattr(corner[peer], name) for corner in self.numbers)
        if both - first - second + low != 0:
            raise NotCovered("a gain that is no sum of what each key gives")
        slopes = ((first - low) / 2, (second - low) / 2)
        return scalar(low + sum(slopes), slopes)


def classes_of(corners) -> list:
    """The places of equal peers, in the order of the first of each."""
    classes = {}
    for place in range(len(corners[0].peers)):
        alike = tuple(replace(scene.peers[place], name="", device_mass=0.0) for scene in corners)
        own = corners[0].peers[place]
        # Of a device that touches nothing the coupling does not count.
        contact = alike if own.touches else tuple(replace(peer, coupling=(0.0, 0.0), coupling_scaling=False) for peer in alike)
        classes.setdefault(repr((contact, own.device_mass)), []).append(place)
    return [tuple(members) for members in classes.values()]


class Part:
    """A part of the motion, in the states that a certificate names."""

    def __init__(self, box, classes, difference, members, states, heard, time):
        self.box, self.time, self.difference = box, time, difference
        self.states = [tuple(state) for state in states]
        self.members = [tuple(of_class) for of_class in members]
        if (len(self.members) != 1 if difference else self.members != classes):
            raise NotCovered("classes of peers that are not those of the scene")
        scene = box.corners[0]
        others = len(scene.peers) - 1
        if difference:
            self.weights = [[Fraction(-1, others)]]
        else:
            count = [len(of_class) for of_class in self.members]
            self.weights = [[Fraction(n - (i == j), others) for j, n in enumerate(count)] for i in range(len(count))]
        self.first = [of_class[0] for of_class in self.members]
        tied = any(scene.peers[peer].touches and scene.peers[peer].arm is not None and scene.peers[peer].arm[2] > 0 for peer in range(len(scene.peers)))
        self.reference = None if difference or tied else ("copy", 0)
        self.combined = heard is not None

    def touches(self, c):
        return self.box.corners[0].peers[self.first[c]].touches

    def link(self, sender, receiver):
        """Two peers between which samples of a class go to another, or to itself."""
        if sender != receiver:
            return self.first[sender], self.first[receiver]
        return self.members[sender][1], self.members[sender][0]

    def heard(self):
        """Of each number of a sample, what it is of position and velocity; and of each class, by what each number is multiplied in what its law hears."""
        kt, bt = ([self.box.gain(peer, name) for peer in self.first] for name in ("kt", "bt"))
        by_time = scalar(1 / Fraction(self.time))
        if not self.combined:
            return [row_of(scalar(1), scalar(0)), row_of(scalar(0), scalar(1))], [(k, times(b, by_time)) for k, b in zip(kt, bt)]
        stiffness, damping = ((getattr(self.box.numbers[0][self.first[0]], name)) for name in ("kt", "bt"))
        unit = stiffness + damping / Fraction(self.time)
        if unit == 0:
            raise NotCovered("a law that hears nothing")
        for corner, peer in tuples(self.box.numbers, self.first):
            if corner[peer].kt * damping != corner[peer].bt * stiffness:
                raise NotCovered("one number of a sample where two are heard")
        shares = row_of(scalar(stiffness / unit), scalar(damping / Fraction(self.time) / unit))
        by = [times(k, scalar(unit / stiffness)) if stiffness else times(b, scalar(unit / damping)) for k, b in zip(kt, bt)]
        return [shares], [(scale,) for scale in by]

    def frame(self) -> Frame:
        size = len(self.states)
        place_of = {state: place for place, state in enumerate(self.states)}
        if len(place_of) != size:
            raise NotCovered("a state that stands there twice")
        taken = set()

        def state(*name):
            taken.add(name)
            if name not in place_of:
                raise NotCovered(f"a state that is missing: {name}")
            return Row.unit(size, place_of[name])

        scene, timing = self.box.corners[0], Timing(self.box.corners[0])
        classes = range(len(self.members))
        zero = Row.zeros(size)
        body = lambda kind, c: [zero if (kind, c) == self.reference else state(kind, c, "position"), state(kind, c, "velocity")]
        bodies = [[*body("copy", c), *(body("device", c) if self.touches(c) else [])] for c in classes]
        shares, heard_by = self.heard()

        # Samples by class and number: 0 the first of this frame, −1 the last of the frame before.
        sent_first = {c: timing.sends(self.first[c], timing.t0, timing.t1)[0] for c in classes}
        number_of = lambda c, sent: (sent - sent_first[c]) // scene.update
        before = sorted({(c, number) for kind, c, number, *_ in self.states if kind == "sample"})
        samples = {(c, number): [state("sample", c, number, channel) for channel in range(len(shares))] for c, number in before}

        def sample(c, number):
            if (c, number) not in samples:
                raise NotCovered(f"a sample that is missing: {number} of class {c}")
            return samples[c, number]

        links = {(i, j): self.link(i, j) for i in classes for j in classes if self.weights[j][i] != 0}
        held = {pair: number_of(pair[0], timing.held(*link)) for pair, link in links.items()}
        due = {pair: timing.in_force(*link) for pair, link in links.items()}
        senders = [[i for i in classes if (i, c) in links] for c in classes]
        ticks = [self.tick(c, senders[c], heard_by[c]) for c in classes]
        peer = self.first[0]
        for instant in range(timing.first_tick(peer, timing.t0), timing.t1, scene.peers[peer].tick):
            for c in classes:
                if instant in timing.sends(self.first[c], timing.t0, timing.t1):
                    x, v, *_ = bodies[c]
                    samples[c, number_of(c, instant)] = [x.times(share.entry(0)) + v.times(share.entry(1)) for share in shares]
            for pair, arrivals in due.items():
                for tick, sent in arrivals:
                    if tick == instant:
                        held[pair] = number_of(pair[0], sent)
            # What each number is of where everything is, by name: copies and devices, and the samples held.
            seen = {(c, place): row for c in classes for place, row in enumerate(bodies[c])}
            moved = []
            for c in classes:
                of_samples = [("sample", i, held[i, c], channel) for i in senders[c] for channel in range(len(shares))]
                seen.update({name: sample(*name[1:3])[name[3]] for name in of_samples})
                names = [(c, place) for place in range(len(bodies[c]))] + of_samples
                moved.append([{name: row.entry(place) for place, name in enumerate(names)} for row in ticks[c]])
            shift = moved[0][0] if self.reference else {}
            bodies = [[combination(difference(row, {} if place % 2 else shift), seen) for place, row in enumerate(moved[c])] for c in classes]
            if shift:
                by = combination(shift, seen)
                samples = {name: [row - by.times(share.entry(0)) for row, share in zip(rows, shares)] for name, rows in samples.items()}
        final = []
        for kind, c, *which in self.states:
            if kind == "sample":
                final.append(sample(c, which[0] + 1)[which[1]])
            else:
                final.append(bodies[c][2 * (kind == "device") + (which == ["velocity"])])
        if taken != set(place_of):
            raise NotCovered(f"states that nothing begins with: {sorted(map(str, set(place_of) - taken))}")
        return Frame([row.mean for row in final], [[row.slopes[k] for row in final] for k in range(NUMBERS)], [row.radius for row in final])

    def tick(self, c, senders, heard_by):
        """Where a class moves in a tick, copy and device: what each is of where they are and of the samples held, for velocities multiplied by the time of the part."""
        peer = self.first[c]
        by_time = scalar(1 / Fraction(self.time))
        kc, bc, kt, bt = (self.box.gain(peer, name) for name in ("kc", "bc", "kt", "bt"))
        bodies = 4 if self.touches(c) else 2
        size = bodies + len(senders) * len(heard_by)
        x, v, *device = (Row.unit(size, place) for place in range(bodies))
        zero = Row.zeros(size)
        force = zero - (x.times(kt) + v.times(times(bt, by_time)))
        for place, sender in enumerate(senders):
            for channel, by in enumerate(heard_by):
                held = Row.unit(size, bodies + place * len(heard_by) + channel)
                force = force + held.times(times(by, scalar(self.weights[c][sender])))
        if not device:
            return self.move("copy", peer, (x, v), force)
        grasp = (device[0] - x).times(kc) + (device[1] - v).times(times(bc, by_time))
        return self.move("copy", peer, (x, v), force + grasp) + self.move("device", peer, device, zero - grasp)

    def move(self, name, peer, state, force):
        e00, e01, e10, e11, g0, g1 = step(*getattr(self.box.numbers[0][peer], name), self.box.corners[0].peers[peer].tick)
        t, (x, v) = Fraction(self.time), state
        by = lambda *coefficients: sum((row.times(scalar(number)) for number, row in zip(coefficients, (x, v, force))), start=Row.zeros(len(x.mean)))
        return [x + by(e00, e01 / t, g0), v + by(e10 * t, e11, g1 * t)]


def combination(coefficients, rows):
    """Σ coefficient·row over the names of the coefficients."""
    total = Row.zeros(len(next(iter(rows.values())).mean))
    for name, by in coefficients.items():
        if by.mean or any(by.slopes) or by.radius:
            total = total + rows[name].times(by)
    return total


def difference(one, other):
    """Coefficients less others, by name."""
    zero = scalar(0)
    less = lambda a, b: (row_of(a) - row_of(b)).entry(0)
    return {name: less(one.get(name, zero), other[name]) if name in other else one[name] for name in {**one, **other}}


def row_of(*scalars) -> Row:
    return Row([s.mean for s in scalars], [list(slopes) for slopes in zip(*(s.slopes for s in scalars))], [s.radius for s in scalars])


def times(one: Scalar, other: Scalar) -> Scalar:
    return row_of(one).times(other).entry(0)
