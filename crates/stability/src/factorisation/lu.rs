//! Systems of linear equations: Gaussian elimination with the largest pivot of each column (Higham 2002, Section 9.1).

use std::ops::{Add, Div, Mul, Sub};

use num_complex::Complex64;

use crate::matrix::Dense;

/// An entry of a factorised matrix, real or complex.
pub trait Entry: Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + From<f64> {
    /// Returns the sum of the absolute values of real and imaginary part, between the modulus and √2 times the modulus.
    fn size(self) -> f64;
}

impl Entry for f64 {
    fn size(self) -> f64 {
        self.abs()
    }
}

impl Entry for Complex64 {
    fn size(self) -> f64 {
        self.l1_norm()
    }
}

/// P·A = L·U of a square matrix A: L is lower triangular with ones on the diagonal, U is upper triangular, P exchanges rows.
///
/// Computed solutions are exact for a matrix within a small multiple of n·ε·|L|·|U| of A (Higham 2002, Theorem 9.4). If A is singular, solutions
/// are not finite or very large.
#[derive(Clone, Debug)]
pub struct Lu<T> {
    /// L below the diagonal, U on and above it.
    factors: Dense<T>,
    /// Row of A for each row of the factors.
    rows: Vec<usize>,
}

impl<T: Entry> Lu<T> {
    /// Factorises a square matrix.
    #[must_use]
    pub fn of(matrix: &Dense<T>) -> Self {
        Self::with_least_pivot(matrix, T::default())
    }

    /// Factorises as [`Lu::of`], with `least` in place of pivots that are zero: the factors of a singular matrix are the factors of a regular matrix nearby.
    pub(crate) fn with_least_pivot(matrix: &Dense<T>, least: T) -> Self {
        let size = matrix.rows();
        let (mut factors, mut rows) = (matrix.clone(), (0..size).collect::<Vec<_>>());
        for pivot in 0..size {
            let larger = |largest: usize, row: usize| if factors[(row, pivot)].size() > factors[(largest, pivot)].size() { row } else { largest };
            let largest = (pivot + 1..size).fold(pivot, larger);
            rows.swap(pivot, largest);
            // Whole rows are exchanged, the finished part of L included, so L belongs to the final order of rows.
            for column in 0..size {
                let entry = factors[(pivot, column)];
                factors[(pivot, column)] = factors[(largest, column)];
                factors[(largest, column)] = entry;
            }
            if factors[(pivot, pivot)].size() <= 0.0 {
                factors[(pivot, pivot)] = least;
            }
            let row = factors.row(pivot)[pivot..].to_vec();
            for below in pivot + 1..size {
                let entries = &mut factors.row_mut(below)[pivot..];
                let factor = entries[0] / row[0];
                entries[0] = factor;
                for (entry, above) in entries[1..].iter_mut().zip(&row[1..]) {
                    *entry = *entry - factor * *above;
                }
            }
        }
        Self { factors, rows }
    }

    /// Returns x with A·x = b.
    pub(crate) fn solve(&self, right: &[T]) -> Vec<T> {
        let size = self.rows.len();
        let mut x: Vec<T> = self.rows.iter().map(|row| right[*row]).collect();
        // Forward substitution with L, whose diagonal is 1 and not stored.
        for row in 1..size {
            x[row] = x[row] - sum(&self.factors.row(row)[..row], &x[..row]);
        }
        for row in (0..size).rev() {
            x[row] = (x[row] - sum(&self.factors.row(row)[row + 1..], &x[row + 1..])) / self.factors[(row, row)];
        }
        x
    }

    /// Returns x with Aᵀ·x = b.
    pub(crate) fn solve_transposed(&self, right: &[T]) -> Vec<T> {
        let size = self.rows.len();
        // Aᵀ = UᵀLᵀP: first Uᵀ from the top, then Lᵀ from the bottom, then the exchange of rows is undone.
        let mut y = right.to_vec();
        for row in 0..size {
            y[row] = y[row] / self.factors[(row, row)];
            let value = y[row];
            subtract(&mut y[row + 1..], value, &self.factors.row(row)[row + 1..]);
        }
        for row in (1..size).rev() {
            let value = y[row];
            subtract(&mut y[..row], value, &self.factors.row(row)[..row]);
        }
        let mut x = vec![T::default(); size];
        for (value, row) in y.into_iter().zip(&self.rows) {
            x[*row] = value;
        }
        x
    }

    /// Returns X with A·X = B.
    pub fn solve_all(&self, right: &Dense<T>) -> Dense<T> {
        let mut solutions = Dense::zeros(right.rows(), right.columns());
        for column in 0..right.columns() {
            let entries: Vec<T> = (0..right.rows()).map(|row| right[(row, column)]).collect();
            for (row, value) in self.solve(&entries).into_iter().enumerate() {
                solutions[(row, column)] = value;
            }
        }
        solutions
    }

    /// Returns A⁻¹.
    pub fn inverse(&self) -> Dense<T> {
        let size = self.rows.len();
        self.solve_all(&Dense::from_fn(size, size, |row, column| T::from(if row == column { 1.0 } else { 0.0 })))
    }
}

/// Returns Σ a·b.
fn sum<T: Entry>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::default(), |sum, (a, b)| sum + *a * *b)
}

/// Subtracts `factor` times each number of `numbers` from the entry of `from` at the same place.
fn subtract<T: Entry>(from: &mut [T], factor: T, numbers: &[T]) {
    for (entry, number) in from.iter_mut().zip(numbers) {
        *entry = *entry - factor * *number;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;
    use crate::matrix::ComplexMatrix;

    /// Hilbert's matrix of three rows times 60; the constant after it is 60 times the inverse of this matrix. All entries are whole numbers.
    const HILBERT: [[f64; 3]; 3] = [[60.0, 30.0, 20.0], [30.0, 20.0, 15.0], [20.0, 15.0, 12.0]];
    const INVERSE: [[f64; 3]; 3] = [[9.0, -36.0, 30.0], [-36.0, 192.0, -180.0], [30.0, -180.0, 180.0]];

    #[test]
    fn an_inverse_in_whole_numbers_is_found() {
        let found = Lu::of(&Matrix::from_fn(3, 3, |row, column| HILBERT[row][column])).inverse();
        for (place, found) in found.entries().iter().enumerate() {
            let expected = INVERSE[place / 3][place % 3] / 60.0;
            // The condition number is 524, so that errors are some roundings of a thousandth of 10⁻¹².
            assert!((found - expected).abs() < 1e-12, "{place}: {found} for {expected}");
        }
    }

    #[test]
    fn both_ways_to_solve_undo_the_product() {
        // The first pivot is zero, so that rows are exchanged; (1 + i)·x is undone by complex divisions.
        let a = ComplexMatrix::from_fn(4, 4, |row, column| {
            let (row, column) = (f64::from(u32::try_from(row).unwrap()), f64::from(u32::try_from(column).unwrap()));
            Complex64::new(libm::sin(3.0 * row * column + row - column), row - 2.0 * column)
        });
        let x = [Complex64::new(1.0, 1.0), Complex64::new(-2.0, 0.5), Complex64::new(0.0, 3.0), Complex64::new(0.25, 0.0)];
        let lu = Lu::of(&a);
        let product = |of: &dyn Fn(usize, usize) -> Complex64| (0..4).map(|i| (0..4).map(|j| of(i, j) * x[j]).sum()).collect::<Vec<Complex64>>();
        for (name, found) in [("A", lu.solve(&product(&|i, j| a[(i, j)]))), ("its transpose", lu.solve_transposed(&product(&|i, j| a[(j, i)])))] {
            for (found, expected) in found.iter().zip(x) {
                assert!((found - expected).norm() < 1e-13, "{name}: {found} for {expected}");
            }
        }
    }

    #[test]
    fn of_a_singular_matrix_nothing_finite_comes_out_unless_asked_for() {
        let singular = Matrix::from_fn(2, 2, |row, column| [[1.0, 2.0], [2.0, 4.0]][row][column]);
        assert!(!Lu::of(&singular).inverse().is_finite());
        // The null vector (2, −1) grows by the inverse of the pivot.
        let grown = Lu::with_least_pivot(&singular, 1e-16).solve(&[1.0, 1.0]);
        assert!((grown[0] / grown[1] + 2.0).abs() < 1e-15 && grown[1].abs() > 1e15, "{grown:?}");
    }
}
