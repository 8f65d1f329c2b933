//! Coordinates in which a matrix is nearly diagonal; nothing here has to be right, since [`super::discs`] checks what comes of them.
//!
//! Eigenvectors of the large eigenvalues, one column each. All others, of samples on their way for the most part, are small eigenvalues that are often defective: their invariant subspace gets coordinates
//! y = R·x of a quadratic form xᵀRᵀRx that falls as fast as those eigenvalues nearly do, in which every entry of it is small.

use cohaptic_stability::numerics::{ComplexMatrix, Lu, cholesky, eigenvector, orthogonal_complement, triangle_inverse};
use cohaptic_stability::{Matrix, eigenvalues};
use num_complex::Complex64;

/// Eigenvalues of at least this share of the largest have eigenvectors of their own.
const LARGE: f64 = 0.4;
/// The form of the others falls as if they were larger by this factor, and by a share of the largest. Measured on maps of five scenes: between 0.05 and 0.4, 1.1 and 2, 0.01 and 0.1 these leave the least undecided.
const FASTER: f64 = 1.3;
const LEAST: f64 = 0.1;
/// Eigenvalues below this are small whatever the others are: a matrix may have none but zeros.
const SMALL: f64 = 0.05;
/// Matrices with larger entries are divided by them.
const HUGE: f64 = 1e30;

/// Coordinates: columns that are nearly eigenvectors, and the inverse of that matrix.
pub(super) struct Basis {
    pub(super) right: ComplexMatrix,
    pub(super) left: ComplexMatrix,
}

impl Basis {
    /// `None` where numbers overflow or eigenvectors coincide.
    pub(super) fn of(matrix: &Matrix) -> Option<Self> {
        if !matrix.is_finite() {
            return None;
        }
        // Coordinates are those of any multiple: squares of entries shall not overflow.
        let largest = matrix.largest();
        let scaled = matrix.scaled(if largest > HUGE { 1.0 / largest } else { 1.0 });
        let (matrix, size) = (&scaled, matrix.rows());
        let values = eigenvalues(matrix);
        let modulus = |value: &Complex64| libm::hypot(value.re, value.im);
        let largest = values.iter().map(modulus).fold(0.0, f64::max);
        let least = (LARGE * largest).max(SMALL);
        // Of two that are conjugate, the upper one: they have conjugate eigenvectors.
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
        let rest = if columns.len() == size { Matrix::zeros(size, 0) } else { rest(matrix, &upper, fall, size - columns.len())? };
        let right = ComplexMatrix::from_fn(size, size, |row, column| match columns.get(column) {
            Some(vector) => vector[row],
            None => Complex64::from(rest[(row, column - columns.len())]),
        });
        let left = Lu::of(&right).inverse();
        left.entries().iter().all(|entry| entry.is_finite()).then_some(Self { right, left })
    }
}

/// The subspace, of that dimension, of all eigenvalues but some and their conjugates, as columns in which the matrix shrinks it by `fall`.
fn rest(matrix: &Matrix, others: &[Complex64], fall: f64, dimension: usize) -> Option<Matrix> {
    let size = matrix.rows();
    // It is orthogonal to the left eigenvectors of the others.
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
    let within = basis.transposed().times(&matrix.times(&basis));
    let form = series(within.scaled(1.0 / fall), Matrix::identity(dimension))?;
    Some(basis.times(&triangle_inverse(&cholesky(&form)?)))
}

/// Σ (Aʲ)ᵀ·Q·Aʲ by doubling; `None` if it does not end.
fn series(mut factor: Matrix, mut sum: Matrix) -> Option<Matrix> {
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

/// X with A·X = B, nearly.
pub(super) fn solved(matrix: &Matrix, right: &Matrix) -> Option<Matrix> {
    let solution = Lu::of(matrix).solve_all(right);
    solution.is_finite().then_some(solution)
}
