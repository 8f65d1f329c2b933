"""A frame of a scene over a box of numbers: every entry as a mean, a slope along each number, and a radius for all else, rounding included.

The numbers are gains, coefficients of step maps, or what they are multiplied by for a number of peers. With sᵢ ∈ [−1, 1] where in the box one is, an entry is mean + Σ sᵢ·slopeᵢ + e with |e| ≤ radius. Rows of such entries, coefficients of the state at the
beginning of a frame, go through what happens in the frame: sample, deliver, forces, move.

The averages of the classes of equal peers are one part of the motion; how the members of a class differ is another, one peer that hears its own samples
times −1/(N−1). Only average-position, extrapolated and proportional-derivative coordination between equal clocks and over links without chance are covered.
"""

import math
from dataclasses import dataclass, replace
from fractions import Fraction

from timing import Timing

EPS = 2.0**-52
# Radii are sums of products; a few roundings of each are far below this.
UP = 1 + 2.0**-40


class NotCovered(ValueError):
    """The scene has something of which nothing is said here."""


class TooLight(NotCovered):
    """A mass that is divided without end and has no damping, or a body that a tick moves by too far: this program does not compute its step."""


@dataclass
class Scalar:
    """A number over a box."""

    mean: float
    slopes: list
    radius: float


@dataclass
class Affine:
    """A number over a box, exact."""

    mean: Fraction
    slopes: tuple

    def scaled(self, by):
        return Affine(self.mean * by, tuple(slope * by for slope in self.slopes))

    def plus(self, other):
        return Affine(self.mean + other.mean, tuple(map(sum, zip(self.slopes, other.slopes))))


def between(low, high, place, count) -> Affine:
    """From one number to another, along that number of a box."""
    slope = (high - low) / 2
    return Affine(low + slope, tuple(slope if number == place else Fraction(0) for number in range(count)))


def scalar(affine: Affine) -> Scalar:
    """The nearest doubles of an exact number, and how far they are from it."""
    exact = [affine.mean, *affine.slopes]
    near = [float(number) for number in exact]
    off = sum(abs(number - Fraction(double)) for number, double in zip(exact, near))
    return Scalar(near[0], near[1:], float(off) * UP + 5e-324 if off else 0.0)


class Row:
    """Numbers over a box, one a state."""

    __slots__ = ("mean", "slopes", "radius")

    def __init__(self, mean, slopes, radius):
        self.mean, self.slopes, self.radius = mean, slopes, radius

    @classmethod
    def zeros(cls, size, numbers):
        return cls([0.0] * size, [[0.0] * size for _ in range(numbers)], [0.0] * size)

    @classmethod
    def unit(cls, size, place, numbers):
        row = cls.zeros(size, numbers)
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


# Steps of bodies with a larger norm are those of a half of the tick, twice.
SMALL = 8


def step(mass, damping, stiffness, span):
    """Increments of one step of m·a = f − b·v − k·x with f held: e00, e01, e10, e11, g0, g1, exact but for 10⁻⁴⁰ of what they are at most; without a mass their limits."""
    h = Fraction(span, 10**9)
    if mass == 0:
        if stiffness or not damping:
            raise TooLight("a mass without a limit")
        return Fraction(0), Fraction(0), Fraction(0), Fraction(-1), h / damping, 1 / damping
    x = [[Fraction(0), h, Fraction(0)], [-stiffness / mass * h, -damping / mass * h, h], [Fraction(0)] * 3]
    size = lambda matrix: max(sum(map(abs, row)) for row in matrix)
    halvings = 0
    while size(x) > SMALL:
        x = [[entry / 2 for entry in row] for row in x]
        halvings += 1
    norm = size(x)
    grid = 2**400
    short = lambda number: Fraction(round(number * grid), grid)
    total, term, bound = [[Fraction(0)] * 3 for _ in range(3)], [[Fraction(i == j) for j in range(3)] for i in range(3)], Fraction(1)
    number = 0
    while number < 2 * norm + 4 or bound > Fraction(1, 10**102):
        number += 1
        term = [[short(sum(term[i][k] * x[k][j] for k in range(3)) / number) for j in range(3)] for i in range(3)]
        total = [[a + b for a, b in zip(*rows)] for rows in zip(total, term)]
        bound = bound * norm / number
    # What is left out of the series is at most twice the last bound; terms are rounded some hundred times at most, to 2⁻⁴⁰¹, and grow by e⁸.
    error = Fraction(1, 10**100)
    for _ in range(halvings):
        # exp(2X) − 1 = 2E + E² of E = exp(X) − 1.
        error = short((2 + 2 * size(total) + error) * error) + Fraction(4, grid)
        total = [[short(2 * total[i][j] + sum(total[i][k] * total[k][j] for k in range(3))) for j in range(3)] for i in range(3)]
    if error > Fraction(1, 10**40):
        raise TooLight("a body that moves by far within a tick")
    # The last column is for a force of the mass times 1 m/s².
    return total[0][0], total[0][1], total[1][0], total[1][1], total[0][2] / mass, total[1][2] / mass


def refuse(scene, may_lose=False):
    """Refuses what is not covered."""
    if scene.lag is not None or scene.own_age is not None:
        raise NotCovered("a law other than average-position, extrapolated and proportional-derivative")
    if len({(p.tick, p.offset, p.phase, p.compute_delay) for p in scene.peers}) > 1 or scene.peers[0].compute_delay:
        raise NotCovered("clocks that differ, or a compute delay")
    loses = lambda link: isinstance(link.loss, dict) or link.loss and not may_lose
    if any(loses(link) or link.uniform_sd for link in scene.links.values()):
        raise NotCovered("links with chance")
    if may_lose and len(set(map(repr, scene.links.values()))) > 1:
        raise NotCovered("links that differ, in the mean square")


@dataclass(frozen=True)
class Numbers:
    """The numbers of a peer, exact: its bodies as mass, damping and stiffness, and its gains."""

    device: tuple
    copy: tuple
    kc: Fraction
    bc: Fraction
    kt: Fraction
    bt: Fraction


def numbers_of(scene, peer, copy_mass, of_law, of_coupling) -> Numbers:
    """Of a peer of a scene with copies of that mass and gains times those factors."""
    arm = peer.arm or (0.0, 0.0, 0.0)
    device = tuple(Fraction(own) + Fraction(of_arm) for own, of_arm in zip((peer.device_mass, peer.device_damping, 0.0), arm))
    kc, bc = (Fraction(gain) * of_coupling for gain in peer.coupling)
    return Numbers(device, (copy_mass, Fraction(scene.damping), Fraction(0)), kc, bc, Fraction(scene.stiffness) * of_law, Fraction(scene.rate) * of_law)


def law_factor(scene, nu, mu):
    """By what the gains of the law are multiplied, for ν = 1/(N − 1) and µ = 1/N. PD is AP with N − 1 times both gains."""
    if scene.inverse_n:
        return 4 * (1 - mu) ** 2 if scene.proportional_derivative else 4 * mu * (1 - mu)
    if scene.proportional_derivative and nu == 0:
        raise NotCovered("gains without a limit")
    return 1 / nu if scene.proportional_derivative else Fraction(1)


class KeyBox:
    """The scenes at the corners of a box of keys: key b is at its upper end where bit b of the corner's place is set.

    With `numbers`, two ends of ν = 1/(N − 1), it holds every number N of peers between them, of which those equal to the peers of the largest class (the last of
    those that are as large) are more or fewer. Only weights may then depend on N: they are affine in ν.
    """

    def __init__(self, corners, classes, numbers=None):
        self.classes, self.scene = classes, corners[0]
        for scene in corners:
            refuse(scene)
        n = Fraction(len(self.scene.peers))
        nu, mu = 1 / (n - 1), 1 / n
        of = lambda scene, peer: numbers_of(
            scene, peer, Fraction(scene.mass) * (mu if scene.split else 1), law_factor(scene, nu, mu), 2 * mu if peer.coupling_scaling else 1
        )
        self.numbers = [[of(scene, peer) for peer in scene.peers] for scene in corners]
        self.keys = len(corners).bit_length() - 1
        self.ends, self.growing = numbers, max(range(len(classes)), key=lambda c: (len(classes[c]), c))
        self.others = Fraction(len(self.scene.peers) - len(classes[self.growing]))
        if numbers is not None:
            if len(classes[self.growing]) < 2:
                raise NotCovered("no equal peers of which there are more and more")
            scaled = self.scene.inverse_n or self.scene.proportional_derivative or any(peer.coupling_scaling for peer in self.scene.peers)
            if self.scene.split or scaled:
                raise NotCovered("gains or masses that depend on the number of peers")
        # Coefficients of step maps that vary are numbers of their own, and so is ν.
        self.steps, self.count = {}, self.keys + (numbers is not None)
        for peer in range(len(self.scene.peers)):
            for body in ("device", "copy"):
                plants = self.plants(peer, body)
                if plants not in self.steps:
                    self.steps[plants] = self.coefficients(plants, self.scene.peers[peer].tick)
        self.steps = {plants: [between(low, high, place, self.count) for low, high, place in of_plant] for plants, of_plant in self.steps.items()}

    def plants(self, peer, body):
        return tuple(getattr(corner[peer], body) for corner in self.numbers)

    def coefficients(self, plants, tick):
        """Of the step map of a body, from where to where each goes, and along which number. Of a body that nothing ties to ground each of them is monotone in its mass and in its damping."""
        if len(set(plants)) == 1:
            return [(number, number, 0) for number in step(*plants[0], tick)]
        if any(stiffness for _, _, stiffness in plants):
            raise NotCovered("a body that is tied to ground and varies")
        ranges = [(min(values), max(values)) for values in zip(*(step(*plant, tick) for plant in plants))]
        # Without a change of its damping over its mass, a force has effects that are multiples of one number.
        place = self.count
        if len({damping / mass for mass, damping, _ in plants}) == 1:
            self.count += 1
            return [(low, high, place) for low, high in ranges]
        self.count += 6
        return [(low, high, place + number) for number, (low, high) in enumerate(ranges)]

    def step(self, peer, body):
        return self.steps[self.plants(peer, body)]

    def gain(self, peer, name) -> Affine:
        low, *others = (getattr(corner[peer], name) for corner in self.numbers)
        slopes = [(others[2**key - 1] - low) / 2 for key in range(self.keys)]
        for place, value in enumerate(others, start=1):
            if value - low != sum(2 * slope for key, slope in enumerate(slopes) if place >> key & 1):
                raise NotCovered("a gain that is no sum of what each key gives")
        return Affine(low + sum(slopes), (*slopes, *[Fraction(0)] * (self.count - self.keys)))

    def laws(self):
        """KT and BT of all peers at all corners, those of the first first."""
        return [(numbers.kt, numbers.bt) for corner in self.numbers for numbers in corner]

    def weight(self, row, column, difference):
        """Of the average of a class in what another hears."""
        if self.ends is not None:
            return affine_weight(self, row, column, difference)
        others = len(self.scene.peers) - 1
        return Fraction(-1, others) if difference else Fraction(len(self.classes[column]) - (row == column), others)

    def weighed(self, by: Affine, weight) -> Scalar:
        """A gain times the weight of what it hears."""
        if self.ends is None:
            return scalar(by.scaled(weight))
        constant, of_nu = weight
        low, high = (constant + of_nu * nu for nu in self.ends)
        return times(scalar(by), scalar(between(low, high, self.keys, self.count)))

    def has_differences(self, members):
        return len(members) > 1


def affine_weight(box, row, column, difference):
    """Of the average of a class in what another hears where one class grows: a constant, and a multiple of ν."""
    own = int(row == column)
    if difference:
        return Fraction(0), Fraction(-1)
    if column == box.growing:
        return Fraction(1), 1 - box.others - own
    return Fraction(0), Fraction(len(box.classes[column]) - own)


class NumberBox:
    """A scene with from `low` to `high` peers (None: without end), of which more and more are equal to the peer at the place `growing`.

    Numbers: the factor s of the law's gains, s·ν, the factor of coupling gains, and coefficients of step maps. Each is monotone in N. Without damping of the object
    a copy of the mass m/N moves by N times a force; where that has a limit for all gains, forces are counted in newtons over N: copies have the mass m, gains
    are N times as large, and a device moves by 1/N of a force.
    """

    def __init__(self, scene, classes, growing, low, high, may_lose=False):
        refuse(scene, may_lose)
        self.scene, self.classes = scene, classes
        self.growing = [growing in members for members in classes].index(True)
        self.others = Fraction(len(scene.peers) - len(classes[self.growing]))
        if len(classes[self.growing]) < 2 or low <= self.others or low < 2:
            raise NotCovered("no equal peers of which there are more and more")
        self.low = low
        ends = [(Fraction(1, n - 1), Fraction(1, n)) if n else (Fraction(0), Fraction(0)) for n in (low, high)]
        touching = [peer for peer in scene.peers if peer.touches]
        shrinks = scene.inverse_n and not scene.proportional_derivative and all(peer.coupling_scaling for peer in touching)
        self.divides = scene.split and scene.damping == 0 and shrinks
        law = [4 * (1 - mu) if self.divides else law_factor(scene, nu, mu) for nu, mu in ends]
        # s·ν where s itself has no limit is N − 1 times ν.
        heard = [s * nu for s, (nu, _) in zip(law, ends)]
        coupling = [Fraction(2) if self.divides else 2 * mu for _, mu in ends]
        self.count = 3
        self.factors = [(law, 0), (heard, 1), (coupling, 2)]
        self.steps = {}
        for peer in scene.peers:
            for plants, by in self.bodies(peer, ends).values():
                if (plants, by) not in self.steps:
                    self.steps[plants, by] = self.coefficients(plants, by, peer.tick)
        self.ends = ends
        self.factors = [between(*ends, place, self.count) for ends, place in self.factors]
        self.steps = {body: [between(low, high, place, self.count) for low, high, place in of_body] for body, of_body in self.steps.items()}
        self.base = [numbers_of(scene, peer, Fraction(1), Fraction(1), Fraction(1)) for peer in scene.peers]

    def bodies(self, peer, ends):
        """The bodies of a peer at both ends, and by what their effects of a force are multiplied."""
        mass = Fraction(self.scene.mass)
        plants = numbers_of(self.scene, peer, mass, Fraction(1), Fraction(1))
        masses = [mass * mu if self.scene.split and not self.divides else mass for _, mu in ends]
        return {
            "device": ((plants.device,) * 2, tuple(mu if self.divides else Fraction(1) for _, mu in ends)),
            "copy": (tuple((of_end, *plants.copy[1:]) for of_end in masses), (Fraction(1),) * 2),
        }

    def coefficients(self, plants, by, tick):
        ends = []
        for plant, factor in zip(plants, by):
            *free, g0, g1 = step(*plant, tick)
            ends.append([*free, g0 * factor, g1 * factor])
        ranges = [(min(values), max(values)) for values in zip(*ends)]
        place = self.count
        if all(low == high for low, high in ranges[:4]):
            self.count += any(low < high for low, high in ranges)
            return [(low, high, place) for low, high in ranges]
        self.count += 6
        return [(low, high, place + number) for number, (low, high) in enumerate(ranges)]

    def step(self, peer, body):
        return self.steps[self.bodies(self.scene.peers[peer], self.ends)[body]]

    def gain(self, peer, name) -> Affine:
        base = getattr(self.base[peer], name)
        law, _, coupling = self.factors
        if name in ("kt", "bt"):
            return law.scaled(base)
        if self.divides or self.scene.peers[peer].coupling_scaling:
            return coupling.scaled(base)
        return Affine(base, (Fraction(0),) * self.count)

    def laws(self):
        law = self.factors[0]
        at_low = law.mean - sum(law.slopes)
        return [(self.base[0].kt * at_low, self.base[0].bt * at_low)]

    def weight(self, row, column, difference):
        return affine_weight(self, row, column, difference)

    def weighed(self, by: Affine, weight) -> Scalar:
        """A gain times the weight of what it hears."""
        law, heard, _ = self.factors
        constant, of_nu = weight
        share = by.mean / law.mean if law.mean else Fraction(0)
        parts = (law.scaled(share * constant), heard.scaled(share * of_nu))
        return scalar(Affine(sum(part.mean for part in parts), tuple(map(sum, zip(*(part.slopes for part in parts))))))

    def has_differences(self, members):
        grows = members == self.classes[self.growing]
        return self.low - self.others > 1 if grows else len(members) > 1


def classes_of(corners, apart=lambda name: None) -> list:
    """The places of peers that are equal, for `apart` too, over equal links, in the order of the first of each."""
    classes = {}
    for place in range(len(corners[0].peers)):
        alike = tuple(replace(scene.peers[place], name="") for scene in corners)
        # Of a device that touches nothing the coupling does not count.
        if not alike[0].touches:
            alike = tuple(replace(peer, coupling=(0.0, 0.0), coupling_scaling=False) for peer in alike)
        classes.setdefault((repr(alike), apart(corners[0].peers[place].name)), []).append(place)
    return split_by_links([tuple(members) for members in classes.values()], corners[0].links)


def split_by_links(classes, links):
    """Takes classes apart until from one to another, and within each, all links are equal."""
    def is_even(senders, receivers):
        return len({repr(links.get((i, j))) for i in senders for j in receivers if i != j}) < 2

    while uneven := next(((i, j) for i in classes for j in classes if not is_even(i, j)), None):
        kept = [members for members in classes if members not in uneven]
        classes = sorted(kept + [(member,) for members in set(uneven) for member in members])
    return classes


class Part:
    """A part of the motion, in the states that a certificate names."""

    def __init__(self, box, difference, members, states, heard, time):
        self.box, self.time, self.difference = box, Fraction(time), difference
        self.states = [tuple(state) for state in states]
        self.members = [tuple(of_class) for of_class in members]
        if (len(self.members) != 1 if difference else self.members != box.classes):
            raise NotCovered("classes of peers that are not those of the scene")
        scene = box.scene
        self.first = [of_class[0] for of_class in self.members]
        classes = range(len(self.members))
        self.weights = [[box.weight(i, j, difference) for j in classes] for i in classes]
        tied = any(peer.touches and peer.arm is not None and peer.arm[2] > 0 for peer in scene.peers)
        self.reference = None if difference or tied else ("copy", 0)
        self.combined = heard is not None

    def zeros(self, size):
        return Row.zeros(size, self.box.count)

    def unit(self, size, place):
        return Row.unit(size, place, self.box.count)

    def constant(self, number):
        return scalar(Affine(Fraction(number), (Fraction(0),) * self.box.count))

    def touches(self, c):
        return self.box.scene.peers[self.first[c]].touches

    def link(self, sender, receiver):
        """Two peers between which samples of a class go to another, or to itself."""
        if sender != receiver:
            return self.first[sender], self.first[receiver]
        return self.members[sender][1], self.members[sender][0]

    def hears(self, i, j):
        """Whether samples of a class go to another, or to itself."""
        return i != j or len(self.members[i]) > 1

    def heard(self):
        """Of each number of a sample, what it is of position and velocity; and of each class, by what each number is multiplied in what its law hears, but for what the age of a sample adds."""
        if self.combined and self.box.scene.horizon is not None:
            raise NotCovered("one number of a sample where its age counts")
        kt, bt = ([self.box.gain(peer, name) for peer in self.first] for name in ("kt", "bt"))
        constant = self.constant
        if not self.combined:
            return [row_of(constant(1), constant(0)), row_of(constant(0), constant(1))], [(k, b.scaled(1 / self.time)) for k, b in zip(kt, bt)]
        laws = self.box.laws()
        stiffness, damping = laws[0]
        unit = stiffness + damping / self.time
        if unit == 0:
            raise NotCovered("a law that hears nothing")
        if any(k * damping != b * stiffness for k, b in laws):
            raise NotCovered("one number of a sample where two are heard")
        shares = row_of(constant(stiffness / unit), constant(damping / self.time / unit))
        by = [k.scaled(unit / stiffness) if stiffness else b.scaled(unit / damping) for k, b in zip(kt, bt)]
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
            return self.unit(size, place_of[name])

        scene, timing = self.box.scene, Timing(self.box.scene)
        classes = range(len(self.members))
        zero = self.zeros(size)
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

        links = {(i, j): self.link(i, j) for i in classes for j in classes if self.hears(i, j)}
        held = {pair: number_of(pair[0], timing.held(*link)) for pair, link in links.items()}
        due = {pair: timing.in_force(*link) for pair, link in links.items()}
        senders = [[i for i in classes if (i, c) in links] for c in classes]
        ages = [()] * len(self.members)
        ticks = [self.tick(c, senders[c], heard_by[c], ages[c]) for c in classes]
        peer = self.first[0]
        for instant in range(timing.first_tick(peer, timing.t0), timing.t1, scene.peers[peer].tick):
            # Samples of this instant, of where everything is.
            fresh = {}
            for c in classes:
                if instant in timing.sends(self.first[c], timing.t0, timing.t1):
                    x, v, *_ = bodies[c]
                    samples[c, number_of(c, instant)] = [x.times(share.entry(0)) + v.times(share.entry(1)) for share in shares]
                    fresh[c, number_of(c, instant)] = [{(c, 0): share.entry(0), (c, 1): share.entry(1)} for share in shares]
            for pair, arrivals in due.items():
                for tick, sent in arrivals:
                    if tick == instant:
                        held[pair] = number_of(pair[0], sent)
            if scene.horizon is not None:
                older = [[min(instant - sent_first[i] - held[i, c] * scene.update, scene.horizon) for i in senders[c]] for c in classes]
                ticks = [ticks[c] if older[c] == ages[c] else self.tick(c, senders[c], heard_by[c], older[c]) for c in classes]
                ages = older
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
                samples = {name: self.shifted(name, rows, fresh.get(name), shift, seen, shares) for name, rows in samples.items()}
        final = []
        for kind, c, *which in self.states:
            if kind == "sample":
                final.append(sample(c, which[0] + 1)[which[1]])
            else:
                final.append(bodies[c][2 * (kind == "device") + (which == ["velocity"])])
        if taken != set(place_of):
            raise NotCovered(f"states that nothing begins with: {sorted(map(str, set(place_of) - taken))}")
        return Frame([row.mean for row in final], [[row.slopes[k] for row in final] for k in range(self.box.count)], [row.radius for row in final])

    def shifted(self, name, rows, fresh, shift, seen, shares):
        """The numbers of a sample, from where the first copy is after the move."""
        shifted = []
        for channel, (row, share) in enumerate(zip(rows, shares)):
            own = ("sample", *name, channel)
            of_shift = {of: times(by, share.entry(0)) for of, by in shift.items()}
            shifted.append(combination(difference(fresh[channel] if fresh else {own: self.constant(1)}, of_shift), {**seen, own: row}))
        return shifted

    def tick(self, c, senders, heard_by, ages):
        """Where a class moves in a tick, copy and device: what each is of where they are and of the samples held, for velocities multiplied by the time of the part.

        Where ages [ns] are given, samples have moved on by their velocity for so long.
        """
        peer = self.first[c]
        kc, bc, kt, bt = (self.box.gain(peer, name) for name in ("kc", "bc", "kt", "bt"))
        of_velocity = lambda gain: scalar(gain.scaled(1 / self.time))
        bodies = 4 if self.touches(c) else 2
        size = bodies + len(senders) * len(heard_by)
        x, v, *device = (self.unit(size, place) for place in range(bodies))
        zero = self.zeros(size)
        force = zero - (x.times(scalar(kt)) + v.times(of_velocity(bt)))
        for place, sender in enumerate(senders):
            for channel, by in enumerate(heard_by):
                if channel == 1 and ages:
                    by = by.plus(kt.scaled(Fraction(ages[place], 10**9) / self.time))
                held = self.unit(size, bodies + place * len(heard_by) + channel)
                force = force + held.times(self.box.weighed(by, self.weights[c][sender]))
        if not device:
            return self.move("copy", peer, (x, v), force)
        grasp = (device[0] - x).times(scalar(kc)) + (device[1] - v).times(of_velocity(bc))
        return self.move("copy", peer, (x, v), force + grasp) + self.move("device", peer, device, zero - grasp)

    def move(self, body, peer, state, force):
        e00, e01, e10, e11, g0, g1 = self.box.step(peer, body)
        t, (x, v) = self.time, state
        by = lambda *coefficients: sum((row.times(scalar(number)) for number, row in zip(coefficients, (x, v, force))), start=self.zeros(len(x.mean)))
        return [x + by(e00, e01.scaled(1 / t), g0), v + by(e10.scaled(t), e11, g1.scaled(t))]


def combination(coefficients, rows):
    """Σ coefficient·row over the names of the coefficients."""
    one = next(iter(rows.values()))
    total = Row.zeros(len(one.mean), len(one.slopes))
    for name, by in coefficients.items():
        if by.mean or any(by.slopes) or by.radius:
            total = total + rows[name].times(by)
    return total


def difference(one, other):
    """Coefficients less others, by name."""
    less = lambda a, b: (row_of(a) - row_of(b)).entry(0)
    zero = lambda b: Scalar(0.0, [0.0] * len(b.slopes), 0.0)
    return {name: less(one.get(name, zero(other[name])), other[name]) if name in other else one[name] for name in {**one, **other}}


def row_of(*scalars) -> Row:
    return Row([s.mean for s in scalars], [list(slopes) for slopes in zip(*(s.slopes for s in scalars))], [s.radius for s in scalars])


def times(one: Scalar, other: Scalar) -> Scalar:
    return row_of(one).times(other).entry(0)
