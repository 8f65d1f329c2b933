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
    for _ in 0..3 {
        w = solved(matrix, shift, w);
        let length = w.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
        w.iter_mut().for_each(|entry| *entry /= length);
    }
    let led: Vec<Complex64> = (0..size).map(|column| (0..size).map(|row| w[row] * matrix[(row, column)]).sum()).collect();
    // Rayleigh's quotient.
    let value: Complex64 = led.iter().zip(&w).map(|(led, w)| led * w.conj()).sum();
    let residual = led.iter().zip(&w).map(|(led, w)| (led - value * w).norm()).collect();
    LeftEigenvector { value, entries: w, residual }
}

/// x with x·(A − λ) = b, by elimination with the largest pivot of each column.
fn solved(matrix: &Matrix, value: Complex64, mut right: Vec<Complex64>) -> Vec<Complex64> {
    let size = matrix.rows();
    let entry = |row: usize, column: usize| matrix[(column, row)] - if row == column { value } else { Complex64::ZERO };
    let mut rows: Vec<Vec<Complex64>> = (0..size).map(|row| (0..size).map(|column| entry(row, column)).collect()).collect();
    for pivot in 0..size {
        let larger = |largest: usize, row: usize| if rows[row][pivot].norm() > rows[largest][pivot].norm() { row } else { largest };
        let largest = (pivot..size).fold(pivot, larger);
        rows.swap(pivot, largest);
        right.swap(pivot, largest);
        let (above, below) = rows.split_at_mut(pivot + 1);
        let (above, of_right) = (&above[pivot], right[pivot]);
        for (row, right) in below.iter_mut().zip(&mut right[pivot + 1..]) {
            let factor = row[pivot] / above[pivot];
            row.iter_mut().zip(above).for_each(|(entry, above)| *entry -= factor * above);
            *right -= factor * of_right;
        }
    }
    for row in (0..size).rev() {
        let known: Complex64 = (row + 1..size).map(|column| rows[row][column] * right[column]).sum();
        right[row] = (right[row] - known) / rows[row][row];
    }
    right
}
