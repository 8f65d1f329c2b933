"""Circles on which no matrix of a box has an eigenvalue (Gershgorin 1931).

In coordinates V with W nearly their inverse, A(z) = W·(z·1 − M)·V. Where on a circle it is strictly diagonally dominant with some weights, for all M of the box, none of them has an eigenvalue there, and as many inside as A has diagonal entries that vanish there.
"""

import math
import struct
from operator import mul

from numbers_over_box import EPS, UP


class Refused(Exception):
    """The certificate does not show what it says, or cannot be checked."""


def doubles(digits: str) -> list:
    """Numbers from the hexadecimal digits of their representations."""
    if len(digits) % 16:
        raise Refused("digits that are no numbers")
    return [number for (number,) in struct.iter_unpack(">d", bytes.fromhex(digits))]


def product(one, other):
    columns = list(zip(*other))
    return [[sum(map(mul, row, column)) for column in columns] for row in one]


def sizes(matrix):
    return [[abs(entry) * UP for entry in row] for row in matrix]


def inverse(matrix):
    """The inverse, nearly, by Gauss and Jordan."""
    size = len(matrix)
    rows = [list(row) + [1.0 if i == j else 0.0 for j in range(size)] for i, row in enumerate(matrix)]
    for place in range(size):
        pivot = max(range(place, size), key=lambda row: abs(rows[row][place]))
        rows[place], rows[pivot] = rows[pivot], rows[place]
        if rows[place][place] == 0:
            raise Refused("coordinates that are none: V has no inverse")
        by = 1 / rows[place][place]
        head = rows[place] = [entry * by for entry in rows[place]]
        for row in range(size):
            if row != place and rows[row][place] != 0:
                factor = rows[row][place]
                rows[row] = [entry - factor * of_head for entry, of_head in zip(rows[row], head)]
    return [row[size:] for row in rows]


def check_part(frame, certificate) -> tuple:
    """How many eigenvalues of every matrix of the box lie within the circle of the certificate, of how many; and a bound from below of how far the others
    are from zero."""
    size, numbers = len(frame.mean), len(frame.slopes)
    flat = doubles(certificate["coordinates"])
    weights = doubles(certificate["weights"])
    if len(flat) != 2 * size * size or len(weights) != size or not all(weight > 0 for weight in weights):
        raise Refused(f"expected {size} coordinates and as many weights above zero")
    column = lambda j: [complex(*flat[2 * (j * size + i) : 2 * (j * size + i) + 2]) for i in range(size)]
    v = [list(row) for row in zip(*[column(j) for j in range(size)])]
    w = inverse(v)
    through = lambda matrix: product(w, product(matrix, v))
    unit, mean, slopes = product(w, v), through(frame.mean), [through(slope) for slope in frame.slopes]
    w_sizes, v_sizes = sizes(w), sizes(v)
    rounding = (8 * size + 32) * (2 + numbers) * EPS
    largest = [
        [(abs(m) + sum(abs(s[i][j]) for s in frame.slopes) + frame.radius[i][j]) * UP for j, m in enumerate(row)] for i, row in enumerate(frame.mean)
    ]
    by_radius, by_largest = (product(w_sizes, product(matrix, v_sizes)) for matrix in (frame.radius, largest))
    unit_sizes = product(w_sizes, v_sizes)
    wide = [[(one + rounding * other) * UP for one, other in zip(*rows)] for rows in zip(by_radius, by_largest)]
    off_unit = [[(abs(u - (i == j)) + rounding * unit_sizes[i][j]) * UP for j, u in enumerate(row)] for i, row in enumerate(unit)]

    def reach(centre, moves, radius):
        """Between which sizes centre + Σ sᵢ·movesᵢ ± radius stays."""
        length = abs(centre)
        turn = centre.conjugate() / length if length > 0 else 1.0
        along = sum(abs((move * turn).real) for move in moves)
        across = sum(abs((move * turn).imag) for move in moves)
        radius = radius + 16 * EPS * (length + along + across)
        return length - along - radius, (math.hypot(length + along, across) + radius) * UP

    moves = lambda i, j: [slope[i][j] for slope in slopes]
    reaches = [reach(mean[i][i], moves(i, i), wide[i][i]) for i in range(size)]
    kind, *of_circle = certificate["circle"]
    if kind == "around-zero":
        (radius,) = of_circle
        inside = [high < radius for _, high in reaches]
        apart = [radius - high if within else low - radius for (low, high), within in zip(reaches, inside)]
        farthest = radius
        least = radius
    elif kind == "around-entry":
        place, radius = of_circle
        inside = [i == place for i in range(size)]
        far = lambda i: reach(mean[i][i] - mean[place][place], [a - b for a, b in zip(moves(i, i), moves(place, place))], wide[i][i])[0]
        apart = [radius - wide[i][i] if i == place else far(i) - radius for i in range(size)]
        low, high = reach(mean[place][place], moves(place, place), 0.0)
        farthest = (high + radius) * UP
        least = low - radius
    else:
        raise Refused(f"a circle that is not covered: {kind}")
    if not radius > 0:
        raise Refused("a circle without a radius")
    for i in range(size):
        own = (apart[i] - off_unit[i][i] * farthest * UP) * weights[i]
        beside = [(abs(mean[i][j]) + sum(map(abs, moves(i, j))) + wide[i][j] + off_unit[i][j] * farthest) * weights[j] for j in range(size) if j != i]
        if not own > sum(beside) * (1 + 4 * size * EPS) * UP:
            raise Refused(f"row {i + 1} of {size} is not dominant on the circle")
    return sum(inside), size, kind, least
