"""What a scene's numbers mean as plants and gains, in any arithmetic: mpmath by default, or double where many modes are enumerated.

The doubles nearest to the decimal numbers of a scene are its numbers; durations are whole nanoseconds; everything derived from these (the mass of
one copy, scaled gains, the step maps) is computed in the arithmetic asked for.
"""

import math

import mpmath
import numpy as np
import scipy.linalg
from mpmath import mp, mpf

DIGITS = 110  # of every computation in mpmath
mp.dps = DIGITS


class Exact:
    """Numbers of mpmath."""

    dtype = object
    number = staticmethod(mpf)
    power_of_e = staticmethod(mpmath.exp)

    @staticmethod
    def exponential(x):
        result = mpmath.expm(mpmath.matrix(x.tolist()), method="taylor")
        return np.array(result.tolist(), dtype=object)

    @staticmethod
    def zeros(*shape):
        return np.full(shape, mpf(0), dtype=object)


class Double:
    """Numbers of IEEE binary64."""

    dtype = float
    number = staticmethod(float)
    exponential = staticmethod(scipy.linalg.expm)
    power_of_e = staticmethod(math.exp)
    zeros = staticmethod(lambda *shape: np.zeros(shape))


def step(arithmetic, mass, damping, stiffness, span):
    """One step of m·a = f − b·v − k·x with f held, by the exponential of the augmented plant (no inverse, so b = k = 0 needs no care).

    Returns Φ (2 by 2) and Γ (2): (x, v) ← Φ·(x, v) + Γ·f.
    """
    x = arithmetic.zeros(3, 3)
    h = arithmetic.number(span) / 10**9
    x[0, 1] = h
    x[1, 0] = -stiffness / mass * h
    x[1, 1] = -damping / mass * h
    x[1, 2] = h / mass
    e = arithmetic.exponential(x)
    return e[:2, :2], e[:2, 2]


class Maps:
    """The step maps and gains of one peer."""

    def __init__(self, arithmetic, scene, peer, count):
        number = arithmetic.number
        n = number(count)
        arm = peer.arm or (0.0, 0.0, 0.0)
        self.device = step(
            arithmetic,
            number(peer.device_mass) + number(arm[0]),
            number(peer.device_damping) + number(arm[1]),
            number(arm[2]),
            peer.tick,
        )
        copy_mass = number(scene.mass) / n if scene.split else number(scene.mass)
        self.copy = step(arithmetic, copy_mass, number(scene.damping), number(0), peer.tick)
        scale = 2 / n if peer.coupling_scaling else number(1)
        self.kc, self.bc = (number(gain) * scale for gain in peer.coupling)
        # PD is AP with N − 1 times both gains.
        scale = n - 1 if scene.proportional_derivative else number(1)
        if scene.inverse_n:
            scale = scale * 4 * (n - 1) / n**2
        self.kt, self.bt = number(scene.stiffness) * scale, number(scene.rate) * scale
        # Of a force with a lag: the share that is left of the one of the tick before.
        self.kept = arithmetic.power_of_e(-number(peer.tick) / scene.lag) if scene.lag else number(0)
