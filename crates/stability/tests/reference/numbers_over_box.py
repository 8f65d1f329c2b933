"""Numbers over a box: each entry as a mean, a slope along each number of the box, and a radius for all else, rounding included.

With sᵢ ∈ [−1, 1] where in the box one is, an entry is mean + Σ sᵢ·slopeᵢ + e with |e| ≤ radius.
"""

from dataclasses import dataclass
from fractions import Fraction

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
    off = sum(abs(number - Fraction(double)) for number, double in zip(exact, near) if number)
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
