"""Equal peers that average over their neighbours alone: the weights of a topology, and the eigenvalues of its averaging matrix, enclosed without rounding.

With the matrix W of weights and its row sums D, each peer hears D⁻¹W of the samples. Along an eigenvector all peers do the same, scaled, and hear the eigenvalue times their own samples: a part of one peer for each.

Eigenvalues are those of W·x = λ·D·x. Let X be columns orthogonal to (1, …, 1) by D, G = XᵀDX and H = XᵀWX. If G is strictly diagonally dominant, X and (1, …, 1) are a basis; the eigenvalues are 1 and those λ for which H − λ·G is singular. With
r_i = Σ_j≠i |H_ij| + |G_ij| each of them obeys |H_ii − λ·G_ii| ≤ r_i for some row i, since |λ| ≤ 1 (Gershgorin 1931). And within r_i/√(g·G_ii) of each quotient H_ii/G_ii there is one, g being the least eigenvalue of G (Parlett 1998, Theorem 15.9.1). All this is
computed with whole numbers.
"""

import math
from copy import copy
from fractions import Fraction
from operator import mul

from boxes import KeyBox
from numbers_over_box import UP, NotCovered, Scalar, scalar, times

# An interval of a certificate is that of the eigenvalues at most so far from it.
NEAR = Fraction(1, 10**9)


def weights_of(table, names, of_file) -> list:
    """The weights between peers, a row a peer, exact: those of the table [topology], or of the file that it names."""
    count = len(names)
    kind = table.get("kind", "full")
    known = {"ring": {"kind", "neighbours"}, "star": {"kind", "hub", "role"}, "graph": {"kind", "file"}}
    if kind not in known or set(table) - known[kind] or table.get("role", "peer") != "peer":
        raise NotCovered(f"a topology that is not covered: {table}")
    if (of_file is not None) != (kind == "graph"):
        raise NotCovered("weights of a file that the scene does not name, or names without them")
    if kind == "ring":
        neighbours = table.get("neighbours", 2)
        near = lambda i, j: 0 < min((i - j) % count, (j - i) % count) <= neighbours // 2
        if neighbours % 2 or not 0 < neighbours < max(count, 3):
            raise NotCovered(f"{neighbours} neighbours of each of {count} on a ring")
    elif kind == "star":
        hub = names.index(table.get("hub", names[0]))
        near = lambda i, j: (i == hub) != (j == hub)
    else:
        rows = [[Fraction(weight) for weight in row] for row in of_file]
        if any(len(row) != count for row in rows) or rows != [list(column) for column in zip(*rows)]:
            raise NotCovered("weights that are not mutual, or are those of another number of peers")
        near = lambda i, j: rows[i][j]
    weights = [[Fraction(near(i, j)) for j in range(count)] for i in range(count)]
    if any(weights[i][i] or min(weights[i]) < 0 or not sum(weights[i]) for i in range(count)):
        raise NotCovered("a weight below zero, of a peer with itself, or none of a peer with others")
    return weights


def enclosures(weights, vectors) -> list:
    """Intervals in rising order that do not meet, of which each holds an eigenvalue, and which hold all but one 1. `vectors`: nearly the eigenvectors, a list each."""
    count = len(weights)
    if len(vectors) != count - 1 or any(len(vector) != count for vector in vectors):
        raise NotCovered(f"expected {count - 1} eigenvectors of {count} numbers")
    weights, vectors = whole(weights), whole(vectors)
    degrees = [sum(row) for row in weights]
    columns = []
    for vector in vectors:
        common = dot(degrees, vector)
        columns.append([sum(degrees) * entry - common for entry in vector])
    g = products(columns, [[degree * entry for degree, entry in zip(degrees, column)] for column in columns])
    h = products(columns, [[dot(row, column) for row in weights] for column in columns])
    beside = lambda of, i: sum(abs(of[i][j]) for j in range(count - 1) if j != i)
    least = min(g[i][i] - beside(g, i) for i in range(count - 1))
    if not all(4 * least > g[i][i] for i in range(count - 1)):
        raise NotCovered("eigenvectors that are not orthogonal, or of different sizes")
    found = []
    for i in range(count - 1):
        off = 2 * (beside(h, i) + beside(g, i))
        found.append((max(Fraction(h[i][i] - off, g[i][i]), Fraction(-1)), min(Fraction(h[i][i] + off, g[i][i]), Fraction(1))))
    apart = []
    for low, high in sorted(found):
        if apart and low <= apart[-1][1]:
            low, high = apart[-1][0], max(high, apart.pop()[1])
        apart.append((low, high))
    return apart


def whole(rows):
    """Rational numbers as whole ones, with one denominator left out."""
    rows = [list(map(Fraction, row)) for row in rows]
    unit = math.lcm(*(entry.denominator for row in rows for entry in row))
    return [[int(entry * unit) for entry in row] for row in rows]


def dot(one, other):
    return sum(map(mul, one, other))


def products(columns, others):
    return [[dot(one, other) for other in others] for one in columns]


class TopologyBox(KeyBox):
    """The scenes at the corners of a box of keys, of equal peers that average over their neighbours."""

    def __init__(self, corners, classes, weights, eigenvalues):
        if len(classes) > 1:
            raise NotCovered("peers or links that differ, on a topology")
        degrees = {sum(row) for row in weights}
        self.eigenvalues = eigenvalues
        # Of the sum over neighbours, in place of that over all others.
        self.heard = degrees.pop() / (len(weights) - 1) if len(degrees) == 1 else None
        super().__init__(corners, classes)

    def law(self, scene, nu, mu):
        factor = super().law(scene, nu, mu)
        if not scene.proportional_derivative:
            return factor
        if self.heard is None:
            raise NotCovered("sums over more neighbours of one peer than of another")
        return factor * self.heard

    def covered(self, part):
        """The places of the intervals of eigenvalues for which a part stands: each that meets its own, but for rounding."""
        if not part["difference"]:
            return []
        low, high = part["eigenvalues"]
        return [place for place, ends in enumerate(self.eigenvalues) if low - NEAR <= ends[1] and ends[0] <= high + NEAR]

    def names(self, part):
        name = (part["difference"], tuple(map(tuple, part["members"])))
        return {(*name, place) for place in self.covered(part)} if part["difference"] else {name}

    def known(self):
        everybody = tuple(self.classes)
        return {(False, everybody)} | {(True, everybody, place) for place in range(len(self.eigenvalues))}

    def part(self, part):
        """That for an eigenvalue of the matrix, or for several that are near each other."""
        box = copy(self)
        places = self.covered(part)
        if part["difference"] and not places:
            raise NotCovered("a part that stands for no eigenvalue")
        own = [self.eigenvalues[place] for place in places] or [(Fraction(1), Fraction(1))]
        box.eigenvalue = wide(min(low for low, _ in own), max(high for _, high in own), self.count)
        return KeyBox.part(box, part)

    def weight(self, row, column, difference):
        return None

    def weighed(self, by, weight):
        """A gain times the eigenvalue, by which all hear their own samples."""
        return times(scalar(by), self.eigenvalue)


def wide(low, high, count) -> Scalar:
    """A number of which no more is known than between which ends it is."""
    middle = float((low + high) / 2)
    off = max(high - Fraction(middle), Fraction(middle) - low)
    return Scalar(middle, [0.0] * count, float(off) * UP + 5e-324 if off else 0.0)
