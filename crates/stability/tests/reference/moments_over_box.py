"""The second moment of equal peers over links that lose independently, over a span of numbers of peers: what a frame makes of it, rounding included.

With ν = 1/(N − 1) and µ = 1/N the second moments of N peers, of which none is told from another, are those of three kinds of motion that only the variance σ² = E(u − h)² of what a
delivery brings mixes: C of √N times the mean over the peers of (a, h), A of the differences of (a, in, out) from the mean, and x of samples held of which all sums are zero; a are the states
of a peer and its samples on the way, in the mean of the samples that it holds, out the mean of its samples that others hold. A delivery with the probability p = 1 − q does

    C    h ← q·h + p·u                                              noise ν·p·q·σ²
    A    in ← q·in − ν·p·u,  out ← q·out + p·u                      noise ν·p·q·σ²·[1, −ν; −ν, 1]
    x    ← q²·x + p·q·σ²
    σ² = µ·C[u − h] + (1 − µ)·A[u − out] + (1 − µ)/(1 − ν²)·A[in + ν·out] + ((1 − 2ν)/2 + (1 − ν)/(2 + 2ν))·x

Of two peers out is −in and there is no x, so that A has (a, in) alone, each delivery makes the noise p·q·σ² of both, and σ² = C[u − h]/2 + A[u + in]/2.

`mean_square.py` computes the moments of few peers without any of this. Only links of constant delay are covered.
"""

import math
from dataclasses import dataclass
from fractions import Fraction

from circles import product
from frame_over_box import Part
from numbers_over_box import EPS, UP, Affine, NotCovered, between, scalar
from timing import Timing

TINY = 1e-290


def plus(*matrices):
    return [[sum(entries) for entries in zip(*rows)] for rows in zip(*matrices)]


def sizes(matrix):
    return [[abs(entry) for entry in row] for row in matrix]


def transposed(matrix):
    return [list(column) for column in zip(*matrix)]


def scaled(matrix, by):
    return [[by * entry for entry in row] for row in matrix]


@dataclass
class Span:
    """A matrix over a box: mean + Σ sᵢ·slopeᵢ + E with sᵢ in [−1, 1] and |E| ≤ radius."""

    mean: list
    slopes: list
    radius: list

    def uneven(self):
        return scaled(plus(self.radius, *map(sizes, self.slopes)), UP)

    def largest(self):
        return scaled(plus(sizes(self.mean), self.uneven()), UP)

    def times(self, other):
        mean = product(self.mean, other.mean)
        slopes = [plus(product(a, other.mean), product(self.mean, b)) for a, b in zip(self.slopes, other.slopes)]
        inner = len(other.mean)
        # Sums of `inner` products, of the mean and each slope; those of slopes are sums of two.
        share = (2 * inner + 8) * (1 + len(slopes)) * EPS
        whole = product(self.largest(), other.largest())
        parts = (product(sizes(self.mean), other.radius), product(self.radius, sizes(other.mean)), product(self.uneven(), other.uneven()), scaled(whole, 2 * share))
        radius = [[entry * UP**2 + TINY for entry in row] for row in plus(*parts)]
        return Span(mean, slopes, radius)

    def through(self, by):
        return by.times(self).times(by.transposed())

    def transposed(self):
        return Span(transposed(self.mean), list(map(transposed, self.slopes)), transposed(self.radius))

    def plus(self, other):
        mean = plus(self.mean, other.mean)
        slopes = [plus(a, b) for a, b in zip(self.slopes, other.slopes)]
        rounded = scaled(plus(sizes(mean), *map(sizes, slopes)), 2 * EPS)
        return Span(mean, slopes, scaled(plus(self.radius, other.radius, rounded), UP))

    def negated(self):
        return Span(scaled(self.mean, -1.0), [scaled(slope, -1.0) for slope in self.slopes], self.radius)


def is_positive(matrix, error) -> bool:
    """Whether a symmetric matrix with entries up to `error` off is positive definite: a Cholesky decomposition that succeeds, with what it rounds taken from the diagonal (Rump 2006)."""
    size = len(matrix)
    off = max((sum(row) for row in error), default=0.0) * UP
    trace = sum(abs(matrix[i][i]) for i in range(size))
    less = (off + 4 * (size + 3) * EPS * trace) * UP + TINY
    rows = [list(row) for row in matrix]
    for i in range(size):
        rows[i][i] -= less
    for j in range(size):
        pivot = rows[j][j] - sum(rows[j][k] ** 2 for k in range(j))
        if not pivot > 0 or not math.isfinite(pivot):
            return False
        rows[j][j] = math.sqrt(pivot)
        for i in range(j + 1, size):
            rows[i][j] = (rows[i][j] - sum(rows[i][k] * rows[j][k] for k in range(j))) / rows[j][j]
    return True


def nearly_inverse_root(matrix):
    """T with T·matrix·Tᵀ nearly 1; `None` if there is none."""
    size = len(matrix)
    low = [[0.0] * size for _ in range(size)]
    for i in range(size):
        for j in range(i + 1):
            rest = (matrix[i][j] + matrix[j][i]) / 2 - sum(low[i][k] * low[j][k] for k in range(j))
            if i == j and not rest > 0:
                return None
            low[i][j] = math.sqrt(rest) if i == j else rest / low[j][j]
    inverse = [[0.0] * size for _ in range(size)]
    for j in range(size):
        for i in range(j, size):
            inverse[i][j] = ((i == j) - sum(low[i][k] * inverse[k][j] for k in range(j, i))) / low[i][i]
    return inverse


def is_everywhere_positive(span) -> bool:
    """Whether a symmetric matrix is positive definite all over its box: at all ends of its numbers, between which it is affine but for the radius."""
    root = nearly_inverse_root(span.mean)
    if root is None:
        return False
    zeros = [[0.0] * len(root) for _ in root]
    span = span.through(Span(root, [zeros] * len(span.slopes), zeros))
    slopes = [slope for slope in span.slopes if any(map(any, slope))]
    size = len(root)
    largest = plus(sizes(span.mean), *map(sizes, slopes))
    error = [[(max(span.radius[i][j], span.radius[j][i]) + (len(slopes) + 4) * EPS * max(largest[i][j], largest[j][i])) * UP for j in range(size)] for i in range(size)]
    for corner in range(2 ** len(slopes)):
        at = plus(span.mean, *(scaled(slope, 1.0 if corner >> place & 1 else -1.0) for place, slope in enumerate(slopes)))
        if not is_positive([[(at[i][j] + at[j][i]) / 2 for j in range(size)] for i in range(size)], error):
            return False
    return True


class Moments:
    """What a frame makes of second moments over a span of numbers of peers."""

    def __init__(self, box, low, high, heard, time, depth):
        self.is_pair = (low, high) == (2, 2)
        if len(box.classes) != 1 or low < 3 and not self.is_pair:
            raise NotCovered("second moments of peers that differ, or of two together with more")
        # Samples held of how peers differ: in, and out where it is another number.
        self.held_apart = 1 if self.is_pair else 2
        self.box, self.depth = box, depth
        self.part = Part(box, False, [list(box.classes[0])], [], heard, time)
        self.shares, self.heard_by = self.part.heard()
        if len(self.shares) != 1:
            raise NotCovered("samples of which two numbers are heard")
        scene, self.timing = box.scene, Timing(box.scene)
        self.loss = scene.links[0, 1].loss
        if not 0 <= self.loss < 1:
            raise NotCovered("links that lose everything")
        self.bodies = 4 if scene.peers[0].touches else 2
        self.sends = self.timing.sends(0, self.timing.t0, self.timing.t1)
        self.sent = len(self.sends)
        self.position = self.bodies - 2
        # ν is one more number.
        self.count = box.count + 1
        self.nu = [Fraction(1, low - 1), Fraction(0) if high is None else Fraction(1, high - 1)]

    def constant(self, matrix):
        zeros = [[0.0] * len(matrix[0]) for _ in matrix]
        return Span(matrix, [zeros] * self.count, zeros)

    def single(self, affine):
        number = scalar(affine)
        return Span([[number.mean]], [[[slope]] for slope in number.slopes], [[number.radius]])

    def of_nu(self, constant, slope):
        """A matrix of entries that are constants and multiples of ν."""
        entries = [[scalar(between(*(c + s * nu for nu in self.nu), self.count - 1, self.count)) for c, s in zip(*rows)] for rows in zip(constant, slope)]
        pick = lambda of: [[of(entry) for entry in row] for row in entries]
        return Span(pick(lambda e: e.mean), [pick(lambda e, k=k: e.slopes[k]) for k in range(self.count)], pick(lambda e: e.radius))

    def curve(self, of, bend):
        """A function of ν between its values at the ends; half of its second derivative is at most `bend`."""
        span = self.single(between(*map(of, self.nu), self.count - 1, self.count))
        width = float(abs(self.nu[0] - self.nu[1])) / 2
        span.radius[0][0] = (span.radius[0][0] + bend * width * width) * UP
        return span

    def moved(self, rows):
        """Rows over a box as a matrix, with one more number."""
        zeros = [[0.0] * len(rows[0].mean) for _ in rows]
        return Span([row.mean for row in rows], [[row.slopes[k] for row in rows] for k in range(self.box.count)] + [zeros], [row.radius for row in rows])

    def sizes(self):
        """How many rows each kind of motion has."""
        size = self.bodies + self.depth
        return size + 1 - (self.part.reference is not None), size + self.held_apart, *([] if self.is_pair else [1])

    def image(self, common, apart, rest=None):
        """L(Y) of Y = (common, apart, rest), spans."""
        tied = self.part.reference is None
        kept = self.bodies + self.depth
        start = kept + self.sent
        placed = lambda held, free: [row for row in range(kept) if free or row != self.position] + [start + h for h in range(held)]
        begins = lambda held, free: self.constant([[float(place == row) for place in placed(held, free)] for row in range(start + held)])
        both = ((1, tied), (self.held_apart, True))
        common, apart = (span.through(begins(*of)) for span, of in zip((common, apart), both))
        peer = self.part.first[0]
        t0, t1, step = self.timing.t0, self.timing.t1, self.box.scene.peers[peer].tick
        due = {}
        for tick, sent in self.timing.in_force(*self.part.link(0, 0)):
            number = (sent - self.sends[0]) // self.box.scene.update
            if number < -self.depth:
                raise NotCovered(f"a sample that is missing: {number}")
            due.setdefault(tick, []).append(kept + number)
        for instant in range(self.timing.first_tick(peer, t0), t1, step):
            if instant in self.sends:
                sample = kept + self.sends.index(instant)
                common, apart = (span.through(self.sampled(sample, start + held)) for span, (held, _) in zip((common, apart), both))
            for sample in sorted(due.get(instant, [])):
                if self.is_pair:
                    common, apart = self.delivered_to_pair(common, apart, start, sample)
                else:
                    common, apart, rest = self.delivered(common, apart, rest, start, sample)
            common, apart = (span.through(self.tick(start, held)) for span, (held, _) in zip((common, apart), both))
        common, apart = (span.through(self.ended(start, *of)) for span, of in zip((common, apart), both))
        return (common, apart) if self.is_pair else (common, apart, rest)

    def rows(self, size):
        return [self.part.unit(size, place) for place in range(size)]

    def sampled(self, sample, size):
        rows = self.rows(size)
        x, v, share = rows[self.position], rows[self.position + 1], self.shares[0]
        rows[sample] = x.times(share.entry(0)) + v.times(share.entry(1))
        return self.moved(rows)

    def tick(self, start, held):
        """A tick: what is held first is heard."""
        rows, box, part = self.rows(start + held), self.box, self.part
        peer = part.first[0]
        kc, bc, kt, bt = (box.gain(peer, name) for name in ("kc", "bc", "kt", "bt"))
        of_velocity = lambda gain: scalar(gain.scaled(1 / part.time))
        x, v = rows[self.position : self.position + 2]
        force = rows[start].times(scalar(self.heard_by[0][0])) - (x.times(scalar(kt)) + v.times(of_velocity(bt)))
        if self.bodies == 4:
            grasp = (rows[0] - x).times(scalar(kc)) + (rows[1] - v).times(of_velocity(bc))
            rows[:2], force = part.move("device", peer, rows[:2], part.zeros(start + held) - grasp), force + grasp
        rows[self.position : self.position + 2] = part.move("copy", peer, (x, v), force)
        return self.moved(rows)

    def ended(self, start, held, tied):
        """The rows that are kept, samples a frame older, and without a displacement of everything."""
        rows = self.rows(start + held)
        size, kept = start + held, self.bodies + self.depth
        places = [*range(self.bodies), *range(self.bodies + self.sent, start), *range(start, size)]
        share = self.shares[0].entry(0)
        zero, one = self.part.constant(0), self.part.constant(1)
        by = [one if row in (0, self.position) else zero if row < self.bodies else share for row in range(kept + held)]
        final = [rows[place] if tied else rows[place] - rows[self.position].times(moves) for place, moves in zip(places, by)]
        if not tied:
            del final[self.position]
        return self.moved(final)

    def delivered_to_pair(self, common, apart, held, sample):
        q = Fraction(self.loss)
        exact = lambda number: self.single(Affine(number, (Fraction(0),) * self.count))
        row = lambda sign: self.constant([[1.0 if column == sample else sign * (column == held) for column in range(held + 1)]])
        unit = self.constant([[float(column == held)] for column in range(held + 1)])
        missed = exact(Fraction(1, 2)).times(common.through(row(-1.0)).plus(apart.through(row(1.0))))
        noise = exact(q * (1 - q)).times(missed).through(unit)

        def taken(sign):
            entries = [[Fraction(i == j) for j in range(held + 1)] for i in range(held + 1)]
            entries[held][held], entries[held][sample] = q, sign * (1 - q)
            return self.of_nu(entries, [[0] * (held + 1) for _ in entries])

        return common.through(taken(1)).plus(noise), apart.through(taken(-1)).plus(noise)

    def delivered(self, common, apart, rest, held, sample):
        q = Fraction(self.loss)
        p, nu = 1 - q, lambda: self.of_nu([[0]], [[1]])
        row = lambda size, *entries: [[float(sum(by for place, by in entries if place == column)) for column in range(size)]]
        c, a = held + 1, held + 2
        mu = self.curve(lambda nu: nu / (1 + nu), 1.0)
        rest_of_mu = self.curve(lambda nu: 1 / (1 + nu), 1.0)
        steep = self.curve(lambda nu: 1 / (1 - nu), 8.0)
        of_rest = self.of_nu([[Fraction(1, 2)]], [[-1]]).plus(rest_of_mu.times(self.of_nu([[Fraction(1, 2)]], [[-Fraction(1, 2)]])))
        in_and_out = self.of_nu(row(a, (held, 1)), row(a, (held + 1, 1)))
        sigma = mu.times(common.through(self.constant(row(c, (sample, 1), (held, -1)))))
        sigma = sigma.plus(rest_of_mu.times(apart.through(self.constant(row(a, (sample, 1), (held + 1, -1))))))
        sigma = sigma.plus(rest_of_mu.times(rest_of_mu).times(steep).times(apart.through(in_and_out)))
        sigma = sigma.plus(of_rest.times(rest))
        exact = lambda number: self.single(Affine(number, (Fraction(0),) * self.count))
        noise = exact(p * q).times(sigma)
        of_links = nu().times(noise)

        def taken(size, entries, slopes=()):
            constant = [[Fraction(i == j) for j in range(size)] for i in range(size)]
            slope = [[Fraction(0)] * size for _ in range(size)]
            for i, j, by in entries:
                constant[i][j] = by
            for i, j, by in slopes:
                slope[i][j] = by
            return self.of_nu(constant, slope)

        out = lambda span, by: span.through(by.transposed())
        in_less_out = self.of_nu(row(a, (held, 1)), row(a, (held + 1, -1)))
        # [1, −ν; −ν, 1] is (1, −ν) times itself, and 1 − ν² at the second place.
        less = self.of_nu([[1]], [[-1]]).times(self.of_nu([[1]], [[1]]))
        common = common.through(taken(c, [(held, held, q), (held, sample, p)])).plus(out(of_links, self.constant(row(c, (held, 1)))))
        apart = apart.through(taken(a, [(held, held, q), (held + 1, held + 1, q), (held + 1, sample, p)], [(held, sample, -p)]))
        apart = apart.plus(out(of_links, in_less_out)).plus(out(less.times(of_links), self.constant(row(a, (held + 1, 1)))))
        return common, apart, exact(q * q).times(rest).plus(noise)
