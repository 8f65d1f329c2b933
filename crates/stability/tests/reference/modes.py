"""Two other ways to a spectral radius, for scenes whose full matrix would be too large: many equal peers, and very long delays.

N equal peers on equal links: the matrix that averages the others has the eigenvalues λ = 1 (once) and −1/(N − 1) (N − 1 times), so the whole is one peer
that hears λ times itself, for both λ. `make.py` checks this against the full matrix at N = 5.
"""

import mpmath
import numpy as np
import scipy.linalg
from mpmath import mp, mpf

from plant import Exact, Maps
from radius import spectral_radius


class One:
    """One of N equal peers in a scene without phases, offsets or compute delay: its plant over one frame under a held input.

    `a` (4 by 4) maps (xH, vH, xO, vO) over `ticks` ticks with its own feedback closed, `b` is the effect of a held target KT·xd + BT·vd = 1, `c` the gains
    (0, 0, KT, BT).
    """

    def __init__(self, scene, count):
        first = scene.peers[0]
        assert scene.identical and not first.compute_delay
        self.maps = Maps(Exact, scene, first, count)
        self.touches = first.touches
        self.count = count
        self.ticks = scene.update // first.tick
        self.delay = -(-scene.links[None if None in scene.links else (0, 1)].delay // first.tick)
        self.c = np.array([mpf(0), mpf(0), self.maps.kt, self.maps.bt], dtype=object)
        m = self.maps
        self.tick_a, self.tick_b = Exact.zeros(4, 4), Exact.zeros(4)
        zero = mpf(0)
        kc, bc = (m.kc, m.bc) if self.touches else (zero, zero)
        fc = np.array([kc, bc, -kc, -bc], dtype=object)
        ft = np.array([zero, zero, m.kt, m.bt], dtype=object)
        for row in (0, 1):
            self.tick_a[row, :2] = m.device[0][row]
            self.tick_a[row] = self.tick_a[row] - m.device[1][row] * fc
            self.tick_a[2 + row, 2:] = m.copy[0][row]
            self.tick_a[2 + row] = self.tick_a[2 + row] + m.copy[1][row] * (fc - ft)
            self.tick_b[2 + row] = m.copy[1][row]

    def over(self, ticks):
        a, b = np.array([[mpf(int(i == j)) for j in range(4)] for i in range(4)], dtype=object), Exact.zeros(4)
        for _ in range(ticks):
            a, b = self.tick_a @ a, self.tick_a @ b + self.tick_b
        return a, b

    def factors(self):
        """The eigenvalues λ of the averaging matrix."""
        return mpf(1), mpf(-1) / (self.count - 1)

    def monodromy(self, factor):
        """The matrix of one frame: state (plant, scalar target held, targets in flight). A whole frame begins with a sample."""
        frames, rest = divmod(self.delay, self.ticks)
        # In force at tick `rest` of this frame is the sample of `frames` frames ago.
        n = 4 + 1 + frames
        identity = np.array([[mpf(int(i == j)) for j in range(n)] for i in range(n)], dtype=object)
        fresh = Exact.zeros(n)
        fresh[:4] = factor * self.c
        targets = [identity[4 + place] for place in range(frames + 1)] + [fresh]  # held, oldest in flight, …, new
        a, b = self.over(rest)
        plant = a @ identity[:4] + np.outer(b, targets[0])
        a, b = self.over(self.ticks - rest)
        plant = a @ plant + np.outer(b, targets[1])
        return np.vstack([plant, np.array(targets[1:])])

    def relative(self, matrix):
        """The matrix of λ = 1 without the displacement of everything: positions from the copy's, the target less KT times it.

        Of peers that touch nothing each device is left out too, in both blocks."""
        e = Exact.zeros(len(matrix))
        e[2] = mpf(1)
        e[4:] = self.maps.kt
        if self.touches:
            e[0] = mpf(1)
        assert all(abs(x) < 1e-60 for x in matrix @ e - e)
        matrix = matrix - np.outer(e, matrix[2])
        keep = [i for i in range(len(matrix)) if i != 2]
        return matrix[keep][:, keep]

    def radius(self):
        """The spectral radius of the relative motion of N peers, from two small blocks."""
        radii = []
        for factor in self.factors():
            matrix = self.monodromy(factor)
            if factor == 1:
                matrix = self.relative(matrix)
            if not self.touches:
                matrix = matrix[1:, 1:]  # the device's position
            radii.append(spectral_radius(matrix)[0])
        return max(radii)

    def rigid_modes(self):
        return 1 if self.touches else 1 + self.count

    # Very long delays: the roots of z^D·p(z) = λ·q(z).

    def polynomial(self, factor):
        """The coefficients, highest first, of z^D·p(z) − λ·q(z), p the characteristic polynomial of the plant over a frame and q/p its response from
        the held target to its own (Leverrier and Faddeev). The delay must be a whole number D of frames."""
        frames, rest = divmod(self.delay, self.ticks)
        assert rest == 0
        a, b = self.over(self.ticks)
        p, q = [mpf(1)], []
        adjugate = np.array([[mpf(int(i == j)) for j in range(4)] for i in range(4)], dtype=object)
        for k in range(1, 5):
            q.append(self.c @ (adjugate @ b))
            moved = a @ adjugate
            p.append(-sum(moved[i, i] for i in range(4)) / k)
            adjugate = moved + p[k] * np.array([[mpf(int(i == j)) for j in range(4)] for i in range(4)], dtype=object)
        whole = p + [mpf(0)] * frames
        for place, coefficient in enumerate(reversed(q)):
            whole[len(whole) - 1 - place] -= factor * coefficient
        return whole

    def radius_by_roots(self):
        radii = []
        for factor in self.factors():
            # What a displacement leaves as it is: of everything (λ = 1), and of a device that touches nothing.
            known = int(factor == 1) + int(not self.touches)
            radii.append(max(abs(root) for root in other_roots(self.polynomial(factor), known)))
        return max(radii)


def divided(coefficients):
    """The polynomial divided by (z − 1), which must leave no remainder."""
    result, carry = [], mpf(0)
    for coefficient in coefficients:
        carry += coefficient
        result.append(carry)
    assert abs(result[-1]) < mpf(10) ** -(mp.dps - 20), "1 is not a root"
    return result[:-1]


def other_roots(coefficients, known):
    """All roots but `known` times 1, each polished on its own from those in double, and checked to be as many as the degree and no two the same."""
    quotient = coefficients
    for _ in range(known):
        quotient = divided(quotient)
    degree = len(coefficients) - 1
    rough = scipy.linalg.eigvals(np.array(companion(quotient), dtype=float))
    terms = [(degree - k, c) for k, c in enumerate(coefficients) if c != 0]
    with mpmath.workdps(70):
        roots = []
        for start in rough:
            if start.imag < 0:
                continue  # the conjugate of another
            z = mpmath.mpc(start)
            for _ in range(100):
                # Newton's method for f/(z − 1)^known, without dividing.
                powers = [(c * z**k, k) for k, c in terms]
                value = sum(term for term, _ in powers)
                if value == 0:
                    break
                change = 1 / (sum(k * term for term, k in powers) / z / value - known / (z - 1))
                z -= change
                if abs(change) < mpf(10) ** -55:
                    break
            else:
                raise ArithmeticError("a root does not converge")
            roots.append(z)
            if abs(z.imag) > mpf(10) ** -40:
                roots.append(z.conjugate())
    assert len(roots) == degree - known
    ordered = sorted(roots, key=lambda z: (float(z.real), float(z.imag)))
    for k, z in enumerate(ordered):
        for other in ordered[k + 1 :]:
            if other.real - z.real > 1e-6:
                break
            assert abs(other - z) > mpf(10) ** -20, "a root was found twice"
    return roots


def companion(coefficients):
    n = len(coefficients) - 1
    matrix = [[0.0] * n for _ in range(n)]
    matrix[0] = [float(-c / coefficients[0]) for c in coefficients[1:]]
    for k in range(1, n):
        matrix[k][k - 1] = 1.0
    return matrix
