"""Boxes of scenes: keys between two values each, or numbers of peers, with the gains, step maps and weights that belong to them.

The numbers of a box are gains, coefficients of step maps, or what they are multiplied by for a number of peers. Of a body that nothing ties to ground each coefficient is monotone in its mass and in its damping, so that the ends enclose it.
"""

from dataclasses import dataclass, replace
from functools import cache
from fractions import Fraction

from frame_over_box import Part
from numbers_over_box import Affine, NotCovered, Scalar, TooLight, between, scalar, times

# Steps of bodies with a larger norm are those of a half of the tick, twice.
SMALL = 8


@cache
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


def apart(ranges, place, dampings):
    """Coefficients of step maps from where to where, each along a number of its own from `place` on. Of one damping b that stays, e01 = h − b·g0 and e11 = −b·g1 go along with the effects of a force."""
    (e00, e01, e10, e11, g0, g1) = ranges
    if len(dampings) == 1 and 0 not in dampings and e00 == e10 == (0, 0):
        back = lambda ends: (ends[1], ends[0])
        return [(*e00, place), (*back(e01), place), (*e10, place + 1), (*back(e11), place + 1), (*g0, place), (*g1, place + 1)]
    return [(low, high, place + number) for number, (low, high) in enumerate(ranges)]


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


class Parts:
    """The parts of the motion of a scene: the averages of its classes, and how the members of each differ."""

    def names(self, part):
        """The parts of the scene for which a part of a certificate stands."""
        return {(part["difference"], tuple(map(tuple, part["members"])))}

    def known(self):
        """All parts of the scene."""
        return {(True, (members,)) for members in self.classes if self.has_differences(members)} | {(False, tuple(self.classes))}

    def part(self, part):
        """A part of a certificate, whose frame can be written down."""
        return Part(self, part["difference"], part["members"], part["states"], part["heard"], part["time"])


class KeyBox(Parts):
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
            scene, peer, Fraction(scene.mass) * (mu if scene.split else 1), self.law(scene, nu, mu), 2 * mu if peer.coupling_scaling else 1
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

    def law(self, scene, nu, mu):
        """By what the gains of the law are multiplied."""
        return law_factor(scene, nu, mu)

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
        along = apart(ranges, place, {damping for _, damping, _ in plants})
        self.count += len({number for *_, number in along})
        return along

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


class NumberBox(Parts):
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
        along = apart(ranges, place, {damping for _, damping, _ in plants} if set(by) == {1} else set())
        self.count += len({number for *_, number in along})
        return along

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
