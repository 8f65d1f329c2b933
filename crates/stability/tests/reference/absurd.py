"""Scenes whose numbers lie anywhere between 1e-300 and 1e300, and their radii: absurd.json.

Two peers, one of them with an arm, hear each other within the tick, so that the relative motion has eleven numbers. One key is set to each power of ten in
steps of 10^25, and 150 random pairs of keys to random powers. All arithmetic has 1600 digits: an angle of 1e300 rad then has its phase, and a sum of 1e300 and
1e-300 both of its parts. Step maps are closed forms, and a radius is ‖M^K‖^(1/K) with K = 2^120, which is within ln(C)/K of ρ, where C bounds how much
larger a power of M is than that of its radius: below 10^4000 here, so that 30 digits are right.
"""

import random

import mpmath
from mpmath import mp, mpf

from cases import full_radius
from monodromy import Frame, relative
from plant import DIGITS, Exact
from scene import parse

KEYS = {
    "object.mass": 0.45,
    "object.damping": 0.2,
    "device.mass": 0.1,
    "device.damping": 5.0,
    "arm.stiffness": 100.0,
    "arm.damping": 10.0,
    "coupling.stiffness": 3500.0,
    "coupling.damping": 5.0,
    "coordination.stiffness": 1000.0,
    "coordination.damping": 5.0,
}
SQUARINGS = 120


class Absurd(Exact):
    """Numbers of 1600 digits, and the exponential of an augmented plant in closed form."""

    @staticmethod
    def exponential(x):
        h, c, d, g = x[0, 1], x[1, 0], x[1, 1], x[1, 2]
        result = Exact.zeros(3, 3)
        if c == 0 and d == 0:
            result[0, 0], result[0, 1], result[1, 1] = mpf(1), h, mpf(1)
            result[0, 2], result[1, 2] = h * g / 2, g
            return result
        if c == 0:
            left = mpmath.expm1(d)
            result[0, 0], result[0, 1], result[1, 1] = mpf(1), h * left / d, 1 + left
            result[0, 2], result[1, 2] = h * g * (left - d) / d**2, g * left / d
            return result
        # s² − d·s − c·h = 0 for [0 h; c d].
        root = mpmath.sqrt(mpmath.mpc(d * d / 4 + c * h))
        one, other = mpmath.exp(d / 2 + root), mpmath.exp(d / 2 - root)
        mean, slope = mpmath.re(one + other) / 2, mpmath.re((one - other) / (2 * root))
        result[0, 0], result[0, 1] = mean - d / 2 * slope, h * slope
        result[1, 0], result[1, 1] = c * slope, mean + d / 2 * slope
        # The integral of exp is the inverse of [0 h; c d] times exp − 1.
        result[0, 2] = (result[1, 1] - 1 - d / h * result[0, 1]) * g / c
        result[1, 2] = result[0, 1] * g / h
        return result


def text(numbers):
    n = {key: repr(float(numbers.get(key, value))) for key, value in KEYS.items()}
    return f"""[scene]
duration = "1s"

[object]
mass = {n["object.mass"]}
damping = {n["object.damping"]}

[coordination]
strategy = "average-position"
stiffness = {n["coordination.stiffness"]}
damping = {n["coordination.damping"]}
update = "1ms"

[peer]
device = {{ mass = {n["device.mass"]}, damping = {n["device.damping"]} }}
coupling = {{ stiffness = {n["coupling.stiffness"]}, damping = {n["coupling.damping"]} }}

[[peers]]
name = "a"
hand = {{ arm = {{ mass = 0.3, damping = {n["arm.damping"]}, stiffness = {n["arm.stiffness"]} }} }}

[[peers]]
name = "b"
"""


def radius(made):
    frame = Frame(made, arithmetic=Absurd)
    matrix, rigid = relative(made, frame.states, frame.matrix)
    for _ in range(SQUARINGS):
        matrix = matrix.dot(matrix)
    norm = max(sum(abs(value) for value in row) for row in matrix)
    return (mpmath.exp(mpmath.log(norm) / mpf(2) ** SQUARINGS) if norm else mpf(0)), rigid


def scenes():
    powers = range(-300, 301, 25)
    for key in KEYS:
        for power in powers:
            yield f"{key}=1e{power}", {key: float(f"1e{power}")}
    draw = random.Random(1)
    for _ in range(150):
        one, other = draw.sample(list(KEYS), 2)
        numbers = {key: float(f"{draw.uniform(1, 10):.3f}e{draw.randint(-300, 299)}") for key in (one, other)}
        yield " ".join(f"{key}={value!r}" for key, value in numbers.items()), numbers


def entry(scene):
    name, numbers = scene
    mp.dps = 1600
    try:
        written = text(numbers)
        found, rigid = radius(parse(written))
        with mpmath.workdps(40):
            return {"name": name, "scene": written, "radius": mpmath.nstr(+found, 25, min_fixed=-5, max_fixed=5), "rigid_modes": rigid}
    finally:
        mp.dps = DIGITS


def entries(pool):
    ordinary = text({})
    assert abs(mpf(entry(("ordinary", {}))["radius"]) - full_radius(ordinary)[0]) < mpf(10) ** -23
    return list(pool.imap(entry, scenes(), chunksize=4))
