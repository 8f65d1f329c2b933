//! Left eigenvectors of small matrices, by inverse iteration: what tests compare motions with. Nothing here is taken from the analysis but where to look for an eigenvalue.

use cohaptic_stability::{Matrix, eigenvalues};
use num_complex::Complex64;

use crate::properties::count;

/// An eigenvalue λ, a row w of length 1 with w·A = λ·w, and by how much each entry of w·A − λ·w differs from zero.
pub(crate) struct LeftEigenvector {
    pub(crate) value: Complex64,
    pub(crate) entries: Vec<Complex64>,
    pub(crate) residual: Vec<f64>,
}

/// One for each eigenvalue of a matrix, by falling modulus. Eigenvalues that are equal have vectors of their own.
pub(crate) fn left_eigenvectors(matrix: &Matrix) -> impl Iterator<Item = LeftEigenvector> {
    eigenvalues(matrix).into_iter().enumerate().map(|(place, value)| left_eigenvector(matrix, value, place))
}

fn left_eigenvector(matrix: &Matrix, near: Complex64, place: usize) -> LeftEigenvector {
    let size = matrix.rows();
    // Beside the eigenvalue by rounding, so that the system is never singular.
    let shift = near + f64::EPSILON * matrix.frobenius_norm();
    let mut w: Vec<Complex64> = (0..size).map(|row| Complex64::from(libm::sin(count((row + 1) * (place + 3))) + 1.5)).collect();
    let eliminated = Eliminated::new(matrix, shift);
    for _ in 0..3 {
        w = eliminated.solved(&w);
        let length = w.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
        w.iter_mut().for_each(|entry| *entry /= length);
    }
    let led: Vec<Complex64> = (0..size).map(|column| (0..size).map(|row| w[row] * matrix[(row, column)]).sum()).collect();
    // Rayleigh's quotient.
    let value: Complex64 = led.iter().zip(&w).map(|(led, w)| led * w.conj()).sum();
    let residual = led.iter().zip(&w).map(|(led, w)| (led - value * w).norm()).collect();
    LeftEigenvector { value, entries: w, residual }
}

/// (A − λ)ᵀ after elimination with the largest pivot of each column, for any number of right sides.
struct Eliminated {
    /// Pivots and the entries right of them. Left of its pivot, a row has the factors by which the rows above were taken off.
    rows: Vec<Vec<Complex64>>,
    /// Row of the matrix that each row was.
    order: Vec<usize>,
}

impl Eliminated {
    fn new(matrix: &Matrix, value: Complex64) -> Self {
        let size = matrix.rows();
        let entry = |row: usize, column: usize| matrix[(column, row)] - if row == column { value } else { Complex64::ZERO };
        let mut rows: Vec<Vec<Complex64>> = (0..size).map(|row| (0..size).map(|column| entry(row, column)).collect()).collect();
        let mut order: Vec<usize> = (0..size).collect();
        for pivot in 0..size {
            let larger = |largest: usize, row: usize| if rows[row][pivot].norm() > rows[largest][pivot].norm() { row } else { largest };
            let largest = (pivot..size).fold(pivot, larger);
            rows.swap(pivot, largest);
            order.swap(pivot, largest);
            let (above, below) = rows.split_at_mut(pivot + 1);
            let above = &above[pivot];
            for row in below {
                let factor = row[pivot] / above[pivot];
                row[pivot + 1..].iter_mut().zip(&above[pivot + 1..]).for_each(|(entry, above)| *entry -= factor * above);
                row[pivot] = factor;
            }
        }
        Self { rows, order }
    }

    /// x with x·(A − λ) = b.
    fn solved(&self, right: &[Complex64]) -> Vec<Complex64> {
        let mut x: Vec<Complex64> = self.order.iter().map(|&row| right[row]).collect();
        for (row, entries) in self.rows.iter().enumerate() {
            x[row] = (0..row).fold(x[row], |rest, column| rest - entries[column] * x[column]);
        }
        for (row, entries) in self.rows.iter().enumerate().rev() {
            let known: Complex64 = (row + 1..x.len()).map(|column| entries[column] * x[column]).sum();
            x[row] = (x[row] - known) / entries[row];
        }
        x
    }
}
