"""A hundred thousand points of random scenes, each stable or unstable by arithmetic of 60 digits: what no proof about a box may contradict.

A scene has two open keys. Point j of it has the values low + (high − low)·kᵢ(j)/2²⁰ with kᵢ(j) = j·Fᵢ mod 2²⁰, computed in double, so that a file of
verdicts alone holds them all; beside them stand points within 10⁻² to 10⁻⁹ of a crossing, as numbers.

The verdict is that of the characteristic polynomial of the matrices of `monodromy.py`, by the recursion of Schur and Cohn. A scene is left out if a step of
the recursion comes nearer to 1 than 10⁻²⁵, where rounding might decide. Of the first point of each scene `radius.py` finds the radius ρ in another way, and
the verdict on M/(ρ·(1 ± 10⁻²⁰)) must change between the two signs.
"""

import random
import sys
from dataclasses import replace

import gmpy2
import mpmath
import numpy as np
from gmpy2 import mpfr
from mpmath import mpf

import cases
from monodromy import Frame, make_maps, relative, rigid_modes
from radius import spectral_radius
from random_scenes import drawn, own, spread
from scene import parse
from text import name, scene

SEED = 21_000
EQUAL, UNEQUAL = 60, 40
OF_EQUAL, OF_UNEQUAL = 1500, 250
CROSSINGS = 6
GRID = 2**20
STEPS = (648_055, 400_521)  # near GRID divided by the golden ratio and its square
DIGITS = 60
gmpy2.get_context().precision = 200
LEAST = mpfr(10) ** -25


def of_peers(change):
    return lambda made, value: replace(made, peers=[change(peer, value) for peer in made.peers])


# What a key sets, and the range around a value.
KEYS = {
    "coordination.stiffness": (lambda made, value: replace(made, stiffness=value), lambda made: (made.stiffness / 8, 4 * made.stiffness)),
    "coordination.damping": (lambda made, value: replace(made, rate=value), lambda made: (0.0, max(4 * made.rate, 10.0))),
    "peer.coupling.stiffness": (
        of_peers(lambda peer, value: replace(peer, coupling=(value, peer.coupling[1]))),
        lambda made: (made.peers[0].coupling[0] / 8, 4 * made.peers[0].coupling[0]),
    ),
    "peer.coupling.damping": (
        of_peers(lambda peer, value: replace(peer, coupling=(peer.coupling[0], value))),
        lambda made: (0.0, max(4 * made.peers[0].coupling[1], 10.0)),
    ),
    "object.mass": (lambda made, value: replace(made, mass=value), lambda made: (made.mass / 4, 3 * made.mass)),
    "object.damping": (lambda made, value: replace(made, damping=value), lambda made: (0.0, max(4 * made.damping, 5.0))),
    "peer.device.mass": (
        of_peers(lambda peer, value: replace(peer, device_mass=value)),
        lambda made: (made.peers[0].device_mass / 4, 3 * made.peers[0].device_mass),
    ),
}
BODIES = ("object.mass", "object.damping", "peer.device.mass")


class Fast:
    """Numbers of 200 bits (MPFR), some times as fast as those of mpmath, which make the step maps."""

    number = staticmethod(mpfr)

    @staticmethod
    def zeros(*shape):
        return np.full(shape, mpfr(0), dtype=object)

    @staticmethod
    def exponential(x):
        result = mpmath.expm(mpmath.matrix([[mpf(str(entry)) for entry in row] for row in x]), method="taylor")
        return np.array([[short(entry) for entry in row] for row in result.tolist()], dtype=object)


def short(number):
    return mpfr(mpmath.nstr(number, DIGITS + 10))


class Undecided(ArithmeticError):
    """Rounding might decide."""


def is_stable(matrix):
    """Whether all eigenvalues are within the unit circle."""
    coefficients = polynomial(matrix)
    while len(coefficients) > 1:
        last = coefficients[-1]
        if abs(abs(last) - 1) < LEAST:
            raise Undecided
        if abs(last) > 1:
            return False
        by = 1 - last * last
        coefficients = [(a - last * b) / by for a, b in zip(coefficients[:-1], coefficients[:0:-1])]
    return True


def polynomial(matrix):
    """det(z − M), the coefficient of the highest power first: by the Hessenberg form, and its leading blocks one after another."""
    h = [list(row) for row in matrix]
    size = len(h)
    for column in range(size - 2):
        pivot = max(range(column + 1, size), key=lambda row: abs(h[row][column]))
        if h[pivot][column] == 0:
            continue
        h[column + 1], h[pivot] = h[pivot], h[column + 1]
        for row in h:
            row[column + 1], row[pivot] = row[pivot], row[column + 1]
        head = h[column + 1]
        for place in range(column + 2, size):
            if h[place][column] != 0:
                by = h[place][column] / head[column]
                h[place] = [entry - by * of_head for entry, of_head in zip(h[place], head)]
                for row in h:
                    row[column + 1] += by * row[place]
    found = [[mpfr(1)]]
    for size in range(1, size + 1):
        last = found[-1]
        new = [mpfr(0)] * (size + 1)
        for power, coefficient in enumerate(last):
            new[power] += coefficient
            new[power + 1] -= h[size - 1][size - 1] * coefficient
        below = mpfr(1)
        for row in range(size - 2, -1, -1):
            below *= h[row + 1][row]
            if below == 0:
                break
            by = below * h[row][size - 1]
            for power, coefficient in enumerate(found[row]):
                new[size - row + power] -= by * coefficient
        found.append(new)
    return found[-1]


class Motion:
    """The matrices of a scene with values of its keys; bodies that stay keep their step maps."""

    def __init__(self, made, keys, is_alike):
        self.made, self.keys, self.is_alike = made, keys, is_alike
        self.maps = None if any(key in BODIES for key in keys) else make_maps(made, Fast)

    def matrices(self, values):
        made = self.made
        for key, value in zip(self.keys, values):
            made = KEYS[key][0](made, value)
        count = len(made.peers)
        if self.maps is None:
            maps = make_maps(made, Fast)
        else:
            # Gains alone vary: scaled as `plant.Maps` does, which is asked for no step map again.
            maps = self.maps
            for of_peer, peer in zip(maps, made.peers):
                regain(of_peer, made, peer, count)
        if not self.is_alike:
            frame = Frame(made, Fast, maps=maps)
            return [relative(made, frame.states, frame.matrix)[0]]
        together = rigid_modes(made)
        one = replace(made, peers=made.peers[:1], links={(0, 0): made.links[0, 1]})
        apart = [mode for mode in rigid_modes(one) if mode != "scene"]
        found = []
        for echo, rigid in ((mpfr(1), apart + (["scene"] if "scene" in together else [])), (mpfr(-1) / (count - 1), apart)):
            frame = Frame(one, Fast, maps=maps[:1], echo=echo)
            found.append(relative(one, frame.states, frame.matrix, rigid)[0])
        return found

    def verdict(self, values):
        return all([is_stable(matrix) for matrix in self.matrices(values)])


def regain(maps, made, peer, count):
    n = mpfr(count)
    scale = 2 / n if peer.coupling_scaling else mpfr(1)
    maps.kc, maps.bc = (mpfr(gain) * scale for gain in peer.coupling)
    scale = n - 1 if made.proportional_derivative else mpfr(1)
    if made.inverse_n:
        scale = scale * 4 * (n - 1) / n**2
    maps.kt, maps.bt = mpfr(made.stiffness) * scale, mpfr(made.rate) * scale


def text_of(chance, is_alike):
    """A scene: of equal peers up to forty, else of two or three."""
    update = chance.choice((2, 4, 8))
    count = chance.choice((2, 3, 5, 12, 40)) if is_alike else chance.choice((2, 2, 2, 3))
    keys = {
        "kc": spread(chance, 200.0, 6000.0),
        "bt": spread(chance, 0.1, 30.0),
        "bc": spread(chance, 0.1, 10.0),
        "bh": spread(chance, 0.1, 20.0),
        "mh": spread(chance, 0.05, 1.0),
        "mo": spread(chance, 0.05, 5.0),
        "bo": chance.choice((0.0, spread(chance, 0.01, 5.0))),
        "split": chance.random() < 0.5,
        "strategy": chance.choice(("average-position", cases.PD)),
        "scaling": chance.choice((None, None, "inverse-n")),
        "update": f"{update}ms",
        "delay": chance.choice((None, f"{chance.randrange(1, 2 * update * 1000)}us", f"{update}ms")),
        "compute_delay": int(chance.random() < 0.2),
    }
    peers = [] if is_alike else [own(chance, place, update) for place in range(count)]
    return scene(count, spread(chance, 50.0, 5000.0), peers=peers, **keys)


def values_of(ranges, point):
    shares = [point * step % GRID / GRID for step in STEPS]
    return [low + (high - low) * share for (low, high), share in zip(ranges, shares)]


def near(chance, motion, ranges, verdicts):
    """Points on both sides of a crossing on the way from a stable to an unstable point."""
    ends = [chance.choice([j for j, stable in enumerate(verdicts) if stable == wanted]) for wanted in (True, False)]
    stable, unstable = (values_of(ranges, end) for end in ends)
    at = lambda share: [a + (b - a) * share for a, b in zip(stable, unstable)]
    low, high = 0.0, 1.0
    while high - low > 1e-10:
        middle = (low + high) / 2
        low, high = (middle, high) if motion.verdict(at(middle)) else (low, middle)
    apart = spread(chance, 1e-9, 1e-2)
    for share in (low - apart, high + apart):
        if 0 < share < 1:
            yield [*at(share), motion.verdict(at(share))]


def check_digits(matrices):
    """That the verdict sees the twentieth digit of a radius that another method finds."""
    exact = lambda matrix: np.array([[mpf(str(entry)) for entry in row] for row in matrix], dtype=object)
    radius, place = max((spectral_radius(exact(matrix))[0], place) for place, matrix in enumerate(matrices))
    for sign, stable in ((1, True), (-1, False)):
        if is_stable(matrices[place] / (short(radius) * (1 + sign * mpfr(10) ** -20))) != stable:
            raise RuntimeError("a radius and a verdict that differ")


def entry(place):
    """A scene with its verdicts; None if it is not of use."""
    is_alike = place < EQUAL
    for attempt in range(1000):
        chance = random.Random(1000 * (SEED + place) + attempt)
        text = text_of(chance, is_alike)
        made = parse(text)
        own_devices = any(peer.device_mass != made.peers[0].device_mass for peer in made.peers)
        keys = chance.sample([key for key in KEYS if not (own_devices and key == "peer.device.mass")], 2)
        ranges = [tuple(float(f"{value:.3g}") for value in KEYS[key][1](made)) for key in keys]
        motion = Motion(made, keys, is_alike)
        verdict = lambda point: motion.verdict(values_of(ranges, point))
        try:
            verdicts = [verdict(point) for point in range(24)]
            if not 3 <= sum(verdicts) <= 21:
                continue
            verdicts += [verdict(point) for point in range(24, OF_EQUAL if is_alike else OF_UNEQUAL)]
            beside = [point for _ in range(CROSSINGS) for point in near(chance, motion, ranges, verdicts)]
            check_digits(motion.matrices(values_of(ranges, 0)))
        except (ArithmeticError, AssertionError):
            # The radius, or its nearness to 1, is not found to these digits.
            continue
        bits = "".join(format(int("".join(map(str, map(int, reversed(verdicts[k : k + 4])))), 2), "x") for k in range(0, len(verdicts), 4))
        print(f"{place:4} {sum(verdicts)} of {len(verdicts)} stable, {len(beside)} near  {' '.join(keys)}", file=sys.stderr, flush=True)
        return {
            "name": f"verdicts-{place}",
            "scene": text,
            "keys": keys,
            "ranges": ranges,
            "points": len(verdicts),
            "stable": bits,
            "near": beside,
        }
    raise ArithmeticError(f"no scene for place {place}")


def entries(pool):
    return list(pool.imap(entry, range(EQUAL + UNEQUAL), chunksize=1))
