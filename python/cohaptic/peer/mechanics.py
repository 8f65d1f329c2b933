"""Motion of copies and simulated devices between two ticks, as in docs/model.md and docs/rotation.md."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

State = tuple[float, float]
"""Position [m] and velocity [m/s] along one axis."""
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
"""Rows of R, which turns vectors from the axes of a body into those of the world."""


class Body:
    """A damped mass on each axis. A step is exact for a force that is held over the step."""

    def __init__(self, mass: float, damping: float, step: float, states: Iterable[State]) -> None:
        # a = b·h/m; φ1 = (1 - e^-a)/a and φ2 = (1 - φ1)/a, by their series where the quotients would lose digits.
        a = damping * step / mass
        phi1 = 1 - a / 2 + a * a / 6 - a**3 / 24 if a < 1e-3 else -math.expm1(-a) / a
        phi2 = 1 / 2 - a / 6 + a * a / 24 - a**3 / 120 if a < 1e-3 else (1 - phi1) / a
        self.position_per_velocity, self.position_per_force = step * phi1, step * step / mass * phi2
        self.velocity_lost, self.velocity_per_force = a * phi1, step / mass * phi1
        self.states = list(states)

    def move(self, forces: Sequence[float]) -> None:
        """Moves by one step under held forces [N], one for each axis."""
        self.states = [
            (
                x + self.position_per_velocity * v + self.position_per_force * force,
                v - self.velocity_lost * v + self.velocity_per_force * force,
            )
            for (x, v), force in zip(self.states, forces, strict=True)
        ]

    @property
    def is_finite(self) -> bool:
        """Whether all positions and velocities are numbers."""
        return all(math.isfinite(x) and math.isfinite(v) for x, v in self.states)


@dataclass(frozen=True)
class Attitude:
    """Attitude of a body: a unit quaternion w, x, y, z, and the angular velocity about the axes of the body [rad/s]."""

    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    rate: Vector = (0.0, 0.0, 0.0)

    def matrix(self) -> Matrix:
        """Returns R of this attitude."""
        w, x, y, z = self.quaternion
        f = 2 / (w * w + x * x + y * y + z * z)
        return (
            (1 - f * (y * y + z * z), f * (x * y - w * z), f * (x * z + w * y)),
            (f * (x * y + w * z), 1 - f * (x * x + z * z), f * (y * z - w * x)),
            (f * (x * z - w * y), f * (y * z + w * x), 1 - f * (x * x + y * y)),
        )


def apply(matrix: Matrix, vector: Sequence[float]) -> Vector:
    """Returns R·v."""
    a, b, c = vector
    x, y, z = (row[0] * a + row[1] * b + row[2] * c for row in matrix)
    return x, y, z


def transposed(matrix: Matrix) -> Matrix:
    """Returns Rᵀ."""
    x, y, z = matrix
    return (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])


def cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    """Returns a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


class Turn:
    """A damped body that turns, in its principal axes: J·ω' + ω x Jω = τ - b·ω, by the method of Runge and Kutta of fourth order."""

    def __init__(self, inertia: Sequence[float], damping: Sequence[float], step: float) -> None:
        self.inertia, self.damping, self.step = inertia, damping, step
        self.attitude = Attitude()

    def slope(self, state: Sequence[float], torque: Sequence[float]) -> list[float]:
        """Returns the slope of quaternion and angular velocity."""
        w, x, y, z, *rate = state
        spun = cross((x, y, z), rate)
        gyration = cross(rate, [j * r for j, r in zip(self.inertia, rate, strict=True)])
        along = x * rate[0] + y * rate[1] + z * rate[2]
        turning = [(w * r + s) / 2 for r, s in zip(rate, spun, strict=True)]
        rise = [(torque[i] - gyration[i] - self.damping[i] * rate[i]) / self.inertia[i] for i in range(3)]
        return [-along / 2, *turning, *rise]

    def move(self, torque: Sequence[float]) -> None:
        """Turns by one step under a held torque [N·m], in the axes of the body."""
        h, start = self.step, [*self.attitude.quaternion, *self.attitude.rate]
        slope, rise = [0.0] * 7, [0.0] * 7
        for part, weight in ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
            slope = self.slope([s + part * h * d for s, d in zip(start, slope, strict=True)], torque)
            rise = [r + weight * d for r, d in zip(rise, slope, strict=True)]
        w, x, y, z, *rate = (s + h / 6 * r for s, r in zip(start, rise, strict=True))
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        self.attitude = Attitude((w / norm, x / norm, y / norm, z / norm), (rate[0], rate[1], rate[2]))
