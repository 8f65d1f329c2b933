//! Coordinates in which a matrix is nearly diagonal; nothing here has to be right, since [`super::discs`] checks what comes of them.
//!
//! Eigenvectors of the large eigenvalues, one column each. All others, of samples on their way for the most part, are small eigenvalues that are often defective: their invariant subspace gets coordinates
//! y = R·x of a quadratic form xᵀRᵀRx that falls as fast as those eigenvalues nearly do, in which every entry of it is small.

use faer::c64;
use faer::linalg::solvers::{DenseSolveCore, Solve};

use crate::Matrix;
use crate::worst_case::symmetric::{cholesky, triangle_inverse};

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
    pub(super) right: faer::Mat<c64>,
    pub(super) left: faer::Mat<c64>,
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
        let decomposition = dense(matrix).eigen().ok()?;
        let (values, vectors) = (decomposition.S(), decomposition.U());
        let modulus = |place: usize| libm::hypot(values[place].re, values[place].im);
        let largest = (0..size).map(modulus).fold(0.0, f64::max);
        let least = (LARGE * largest).max(SMALL);
        let large: Vec<usize> = (0..size).filter(|place| modulus(*place) >= least).collect();
        let small = (0..size).map(modulus).filter(|modulus| *modulus < least).fold(0.0, f64::max);
        let fall = (FASTER * small + LEAST * largest).max(SMALL);
        let rest = if large.len() == size { Matrix::zeros(size, 0) } else { rest(matrix, least, fall, size - large.len())? };
        let right = faer::Mat::from_fn(size, size, |row, column| match large.get(column) {
            Some(place) => vectors[(row, *place)],
            None => c64::new(rest[(row, column - large.len())], 0.0),
        });
        let left = right.partial_piv_lu().inverse();
        let finite = (0..size).all(|row| (0..size).all(|column| left[(row, column)].re.is_finite() && left[(row, column)].im.is_finite()));
        finite.then_some(Self { right, left })
    }
}

/// The subspace of the eigenvalues below `large`, of that dimension, as columns in which the matrix shrinks it by `fall`.
fn rest(matrix: &Matrix, large: f64, fall: f64, dimension: usize) -> Option<Matrix> {
    let size = matrix.rows();
    // It is orthogonal to the left eigenvectors of the others.
    let decomposition = dense(&matrix.transposed()).eigen().ok()?;
    let (values, vectors) = (decomposition.S(), decomposition.U());
    let mut others: Vec<Vec<f64>> = Vec::new();
    for place in (0..size).filter(|place| values[*place].im >= 0.0 && libm::hypot(values[*place].re, values[*place].im) >= large) {
        others.push((0..size).map(|row| vectors[(row, place)].re).collect());
        if values[place].im > 0.0 {
            others.push((0..size).map(|row| vectors[(row, place)].im).collect());
        }
    }
    if others.len() + dimension != size {
        return None;
    }
    let orthogonal = faer::Mat::from_fn(size, others.len(), |row, column| others[column][row]).qr().compute_Q();
    let basis = Matrix::from_fn(size, dimension, |row, column| orthogonal[(row, others.len() + column)]);
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

fn dense(of: &Matrix) -> faer::Mat<f64> {
    faer::Mat::from_fn(of.rows(), of.columns(), |row, column| of[(row, column)])
}

/// X with A·X = B, nearly.
pub(super) fn solved(matrix: &Matrix, right: &Matrix) -> Option<Matrix> {
    let solution = dense(matrix).partial_piv_lu().solve(dense(right));
    let solution = Matrix::from_fn(solution.nrows(), solution.ncols(), |row, column| solution[(row, column)]);
    solution.is_finite().then_some(solution)
}
