"""The spectral radius of a matrix of mpmath numbers, to more than 50 digits, in three steps that check one another.

1. LAPACK in double gives all eigenvalues roughly; those whose modulus is within 0.1 % of the largest are gathered into clusters.
2. For each cluster the invariant subspace (M·X = X·L, one column an eigenvalue, so that repeated, defective and nearly equal ones do no harm) is
   refined by Newton's method with a fixed Jacobian from double and residuals from integer arithmetic, until the residual is below 10⁻⁸⁵. The
   eigenvalues of the small L come from mpmath.
3. That nothing larger was overlooked: ρ ≤ ‖M^(2^k)‖^(2^−k) for every k, by repeated squaring of M.
"""

import math

import mpmath
import numpy as np
import scipy.linalg
from mpmath import mp, mpf

BITS = 400
RESIDUAL = mpf(10) ** -85


def integers(matrix, scale):
    """Numbers over scale as integers in units of 2^−BITS."""
    return np.vectorize(lambda x: int(mpmath.nint(mpmath.ldexp(mpf(x) / scale, BITS))), otypes=[object])(matrix)


def shift(array, bits=BITS):
    return array >> bits


def doubles(array):
    return np.vectorize(lambda x: float(mpmath.ldexp(mpf(x), -BITS)), otypes=[float])(array)


def from_double(array):
    """Doubles as integers in units of 2^−BITS, exactly but for the last bit."""

    def one(x):
        mantissa, exponent = math.frexp(x)
        places = exponent + BITS - 53
        whole = int(mantissa * 2**53)
        return whole << places if places >= 0 else whole >> -places

    return np.vectorize(one, otypes=[object])(array)


def clusters(values, largest):
    """The eigenvalues near the largest modulus, gathered by distance; of a conjugate pair of clusters the upper one."""
    near = [complex(value) for value in values if abs(value) >= largest * (1 - 1e-3)]
    groups = []
    for value in near:
        touching = [g for g in groups if any(abs(value - other) < 1e-3 * largest for other in g)]
        for g in touching:
            groups.remove(g)
        groups.append(sum(touching, []) + [value])
    return [g for g in groups if np.mean(g).imag >= -1e-9 * largest]


def refine(operator, matrix, group):
    """The eigenvalues of a cluster. `matrix` is the double matrix, `operator` multiplies a pair of integer arrays (real, imaginary) by it."""
    n = len(matrix)
    centre = np.mean(group)
    # Take in more neighbours until there is a gap around the cluster.
    rough = np.diag(scipy.linalg.schur(matrix, output="complex")[0])
    far = np.sort(abs(rough - centre))
    m = len(group)
    while m < n and far[m] < 10 * far[m - 1] + 1e-6 * abs(centre):
        m += 1
    bound = math.inf if m == n else math.sqrt(max(far[m - 1], 1e-3 * far[m]) * far[m])
    _, basis, found = scipy.linalg.schur(matrix, output="complex", sort=lambda value: abs(value - centre) <= bound)
    if found != m:
        raise ArithmeticError("a cluster is not well separated")
    start = basis[:, :m]
    jacobian = np.block([[matrix - centre * np.eye(n), -start], [start.conj().T, np.zeros((m, m))]])
    factors = scipy.linalg.lu_factor(jacobian)
    vectors = from_double(start.real), from_double(start.imag)
    small = start.conj().T @ matrix @ start
    block = from_double(small.real), from_double(small.imag)
    smallest, stalled = None, 0
    for _ in range(200):
        image = operator(vectors)
        residual = (
            image[0] - shift(vectors[0].dot(block[0]) - vectors[1].dot(block[1])),
            image[1] - shift(vectors[0].dot(block[1]) + vectors[1].dot(block[0])),
        )
        size = max(abs(x) for part in residual for x in part.ravel())
        if size < int(mpmath.ldexp(RESIDUAL, BITS)):
            values = mpmath.matrix(
                [[mpmath.mpc(mpmath.ldexp(mpf(block[0][i, j]), -BITS), mpmath.ldexp(mpf(block[1][i, j]), -BITS)) for j in range(m)] for i in range(m)]
            )
            if m == 1:
                return [values[0, 0]]
            return mpmath.eig(values, left=False, right=False)
        if smallest is not None and size >= smallest:
            stalled += 1
            if stalled > 5:
                break
        smallest = size if smallest is None else min(size, smallest)
        # Bring the residual to about 1 before it becomes a double.
        exponent = size.bit_length()
        right = np.vectorize(lambda x: float(mpmath.ldexp(mpf(x), -exponent)), otypes=[float])
        wanted = np.vstack([-(right(residual[0]) + 1j * right(residual[1])), np.zeros((m, m))])
        change = scipy.linalg.lu_solve(factors, wanted)

        def back(part):
            return np.vectorize(lambda x: int(mpmath.nint(mpmath.ldexp(mpf(float(x)), exponent))), otypes=[object])(part)

        vectors = vectors[0] + back(change[:n].real), vectors[1] + back(change[:n].imag)
        block = block[0] + back(change[n:].real), block[1] + back(change[n:].imag)
    raise ArithmeticError("the refinement does not converge")


def upper_bound(matrix, squarings=24):
    """A bound of the spectral radius from above: ‖M^K‖^(1/K), K = 2^squarings, in the infinity norm. Integers up to 130 states, doubles beyond."""
    exact = len(matrix) <= 130
    log = mpf(0)
    power = matrix
    weight = mpf(1)
    for _ in range(squarings + 1):
        size = max(sum(abs(x) for x in row) for row in power)
        if size == 0:
            return mpf(0)
        if exact and weight == 1:
            power = integers(power, size)
            unit = mpf(size)
        elif exact:
            unit = mpmath.ldexp(mpf(size), -BITS)
            power = np.vectorize(lambda x: (x << BITS) // size, otypes=[object])(power)
        else:
            unit = mpf(size)
            power = np.array(power / size, dtype=float)
        log += mpmath.log(unit) * weight
        last = log
        power = shift(power.dot(power)) if exact else power @ power
        weight /= 2
    return mpmath.exp(last)


def spectral_radius(matrix):
    """The largest modulus of an eigenvalue of a matrix of mpmath numbers, and all eigenvalues whose modulus is within 0.1 % of it."""
    scale = max(abs(x) for x in matrix.ravel())
    if scale == 0:
        return mpf(0), []
    double = np.array(matrix / scale, dtype=float)
    rough = scipy.linalg.eigvals(double)
    exact = integers(matrix, scale)

    def operator(pair):
        return shift(exact.dot(pair[0])), shift(exact.dot(pair[1]))

    values = []
    for group in clusters(rough, max(abs(rough))):
        values += refine(operator, double, group)
    values = [value * scale for value in values]
    largest = max(abs(value) for value in values)
    bound = upper_bound(matrix)
    # The numbers of the bound's constant: ‖M^K‖ may exceed ρ^K by a factor that the K-th root takes away.
    assert bound < largest * (1 + mpf(10) ** -4), f"something larger was overlooked: {mpmath.nstr(bound, 12)} above {mpmath.nstr(largest, 12)}"
    if len(matrix) <= 12:
        every = mpmath.eig(mpmath.matrix(matrix.tolist()), left=False, right=False)
        assert abs(max(abs(value) for value in every) - largest) < largest * mpf(10) ** -48
    return largest, values


def digits(value, count=50):
    return mpmath.nstr(value, count, strip_zeros=False, min_fixed=-8, max_fixed=8)
