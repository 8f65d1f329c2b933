//! Coordinates of a nearly diagonal matrix. Inexact coordinates cost verdicts but never make a verdict wrong, since [`super::discs`] checks them.
//!
//! Each large eigenvalue gets its eigenvector as a column. The small eigenvalues belong mostly to samples in transit and are often defective: their
//! eigenvectors do not span their invariant subspace. The subspace gets coordinates y = R·x of a quadratic form xᵀRᵀRx with nearly the fall of the small
//! eigenvalues. In these coordinates every entry of the matrix on the subspace is small.

use cohaptic_stability::numerics::{ComplexMatrix, Lu, cholesky, eigenvector, orthogonal_complement, triangle_inverse};
use cohaptic_stability::{Matrix, eigenvalues};
use num_complex::Complex64;

/// Share of the largest modulus. An eigenvalue from this share on gets its eigenvector as a column.
const LARGE: f64 = 0.4;
/// Factor by which the quadratic form falls more slowly than the small eigenvalues; [`LEAST`] adds a share of the largest modulus. On maps of five scenes these
/// values of `LARGE`, `FASTER` and `LEAST` left the least area undecided, among values from 0.05 to 0.4, from 1.1 to 2 and from 0.01 to 0.1.
const FASTER: f64 = 1.3;
const LEAST: f64 = 0.1;
/// Modulus below which an eigenvalue always counts as small. A nilpotent matrix has zeros only, and a share of the largest modulus would mean nothing.
const SMALL: f64 = 0.05;
/// Size of an entry above which the matrix is divided by its largest entry.
const HUGE: f64 = 1e30;

/// Coordinates V with nearly eigenvectors as columns (`right`), and nearly the inverse W of V (`left`).
pub(super) struct Basis {
    pub(super) right: ComplexMatrix,
    pub(super) left: ComplexMatrix,
}

impl Basis {
    /// Returns coordinates of a square matrix; `None` if numbers overflow or eigenvectors coincide.
    pub(super) fn of(matrix: &Matrix) -> Option<Self> {
        if !matrix.is_finite() {
            return None;
        }
        // A matrix and its multiples have the same eigenvectors. The division keeps squares of the entries from overflowing.
        let largest = matrix.largest();
        let scaled = matrix.scaled(if largest > HUGE { 1.0 / largest } else { 1.0 });
        let (matrix, size) = (&scaled, matrix.rows());
        let values = eigenvalues(matrix);
        let modulus = |value: &Complex64| libm::hypot(value.re, value.im);
        let largest = values.iter().map(modulus).fold(0.0, f64::max);
        let least = (LARGE * largest).max(SMALL);
        // Conjugate eigenvalues have conjugate eigenvectors, so the eigenvalue in the upper half plane gives both columns.
        let upper: Vec<Complex64> = values.iter().copied().filter(|value| modulus(value) >= least && value.im >= 0.0).collect();
        let small = values.iter().map(modulus).filter(|modulus| *modulus < least).fold(0.0, f64::max);
        let fall = (FASTER * small + LEAST * largest).max(SMALL);
        let mut columns = Vec::new();
        for (place, value) in upper.iter().enumerate() {
            let vector = eigenvector(matrix, *value, place)?;
            let conjugate = (value.im > 0.0).then(|| vector.iter().map(Complex64::conj).collect::<Vec<_>>());
            columns.push(vector);
            columns.extend(conjugate);
        }
        // The invariant subspace of the small eigenvalues fills the columns left by the eigenvectors.
        let rest = if columns.len() == size { Matrix::zeros(size, 0) } else { rest(matrix, &upper, fall, size - columns.len())? };
        let right = ComplexMatrix::from_fn(size, size, |row, column| match columns.get(column) {
            Some(vector) => vector[row],
            None => Complex64::from(rest[(row, column - columns.len())]),
        });
        // Coordinates with coinciding or overflowed columns have no finite inverse.
        let left = Lu::of(&right).inverse();
        left.entries().iter().all(|entry| entry.is_finite()).then_some(Self { right, left })
    }
}

/// Returns a basis, as columns, of the invariant subspace of all eigenvalues but `others` and their conjugates. In this basis the matrix shrinks vectors by at
/// least the factor `fall`. `None` if the subspace does not have the given dimension or the series for the quadratic form does not converge.
fn rest(matrix: &Matrix, others: &[Complex64], fall: f64, dimension: usize) -> Option<Matrix> {
    let size = matrix.rows();
    // The invariant subspace is orthogonal to the left eigenvectors of all `others`.
    let transposed = matrix.transposed();
    let mut left = Vec::new();
    for (place, value) in others.iter().enumerate() {
        let vector = eigenvector(&transposed, *value, place)?;
        left.push(vector.iter().map(|entry| entry.re).collect());
        if value.im > 0.0 {
            left.push(vector.iter().map(|entry| entry.im).collect());
        }
    }
    let basis = orthogonal_complement(left, size, 0.0);
    if basis.columns() != dimension {
        return None;
    }
    // The form Σ (Aʲ)ᵀ·Aʲ, with A the restricted matrix over `fall`, falls by `fall²` under the matrix: its Cholesky factor R is the change of coordinates.
    let within = basis.transposed().times(&matrix.times(&basis));
    let form = series(within.scaled(1.0 / fall), Matrix::identity(dimension))?;
    Some(basis.times(&triangle_inverse(&cholesky(&form)?)))
}

/// Returns Σ (Aʲ)ᵀ·Q·Aʲ over all j ≥ 0, by doubling; `None` if the series does not converge within 64 doublings.
fn series(mut factor: Matrix, mut sum: Matrix) -> Option<Matrix> {
    // After k doublings `sum` holds the first 2ᵏ terms and `factor` is A to the power 2ᵏ, so the next 2ᵏ terms are factorᵀ·sum·factor.
    for _ in 0..64 {
        let more = factor.transposed().times(&sum.times(&factor));
        let (before, added) = (sum.largest(), more.largest());
        sum = Matrix::from_fn(sum.rows(), sum.columns(), |row, column| sum[(row, column)] + more[(row, column)]);
        if !sum.is_finite() {
            return None;
        }
        if added <= 1e-17 * before {
            return Some(sum);
        }
        factor = factor.times(&factor);
    }
    None
}

/// Returns X with A·X ≈ B; `None` if an entry of X is not finite.
pub(super) fn solved(matrix: &Matrix, right: &Matrix) -> Option<Matrix> {
    let solution = Lu::of(matrix).solve_all(right);
    solution.is_finite().then_some(solution)
}
