//! The characteristic matrix at one point z, and its inverse.

use num_complex::Complex64;

use super::delayed_loop::DelayedLoop;

/// The inverse of A(z) = z − now − Σ kernel(z)·matrix, and numbers of its evaluation.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub(super) z: Complex64,
    /// det A divided by its modulus.
    pub(super) direction: Complex64,
    /// A⁻¹, row by row.
    pub(super) inverse: Vec<Complex64>,
    /// Moduli of the kernels at z, indexed like the terms of the loop.
    pub(super) sizes: Vec<f64>,
    /// Bound of the 2-norm of the rounding error of the entries of A and of the elimination.
    pub(super) rounding: f64,
}

impl DelayedLoop {
    /// Evaluates and inverts A at z; `None` if A is singular to the last digit, or if its entries are too large.
    pub(super) fn point(&self, z: Complex64) -> Option<Point> {
        let size = self.now.rows();
        let mut matrix: Vec<Complex64> = self.now.entries().iter().map(|entry| Complex64::from(-entry)).collect();
        for place in 0..size {
            matrix[place * size + place] += z;
        }
        let mut error = z.norm() + self.now_norm;
        let mut sizes = Vec::with_capacity(self.terms.len());
        for term in &self.terms {
            let value = term.kernel.jet(z).value;
            for (entry, factor) in matrix.iter_mut().zip(term.matrix.entries()) {
                *entry -= value * factor;
            }
            sizes.push(value.norm());
            error += value.norm() * term.norm;
        }
        // The bound covers sums of one term per kernel, and Gauss–Jordan elimination with pivots, whose growth is taken as the size (Higham 2002, 9.3).
        let dimension = f64::from(u32::try_from(size).unwrap_or(u32::MAX));
        let rounding = 8.0 * f64::EPSILON * (dimension + f64::from(u32::try_from(sizes.len()).unwrap_or(u32::MAX))) * error;
        let direction = invert(&mut matrix, size)?;
        Some(Point { z, direction, inverse: matrix, sizes, rounding })
    }

    /// Returns the step F/F' = 1/tr(A⁻¹·A') of Newton's method, with A' = 1 − Σ kernel'·matrix (Jacobi's formula).
    // tr(A⁻¹·M) = Σ A⁻¹(row, column)·M(column, row) needs no product of matrices.
    pub(super) fn newton_step(&self, point: &Point) -> Complex64 {
        let size = self.now.rows();
        let mut trace: Complex64 = (0..size).map(|place| point.inverse[place * size + place]).sum();
        for term in &self.terms {
            let slope = term.kernel.jet(point.z).slope;
            for row in 0..size {
                for column in 0..size {
                    trace -= point.inverse[row * size + column] * term.matrix[(column, row)] * slope;
                }
            }
        }
        trace.inv()
    }
}

impl Point {
    /// Returns a bound of the nuclear norm (the sum of the singular values) of A⁻¹: the sum of the lengths of the columns.
    pub(super) fn nuclear(&self, size: usize) -> f64 {
        (0..size).map(|column| (0..size).map(|row| self.inverse[row * size + column].norm_sqr()).sum::<f64>().sqrt()).sum()
    }

    /// Returns a bound of the nuclear norm of A⁻¹·matrix: the sum of the lengths of the columns.
    pub(super) fn nuclear_with(&self, matrix: &crate::Matrix) -> f64 {
        let size = matrix.rows();
        let mut total = 0.0;
        for column in 0..size {
            let mut square = 0.0;
            for row in 0..size {
                let entry: Complex64 = (0..size).map(|inner| self.inverse[row * size + inner] * matrix[(inner, column)]).sum();
                square += entry.norm_sqr();
            }
            total += square.sqrt();
        }
        total
    }
}

/// Inverts a matrix in place by Gauss–Jordan elimination with row exchanges, and returns the determinant divided by its modulus; `None` if a pivot is too
/// small or too large.
fn invert(matrix: &mut [Complex64], size: usize) -> Option<Complex64> {
    let mut direction = Complex64::new(1.0, 0.0);
    let mut exchanges = Vec::with_capacity(size);
    for step in 0..size {
        // The largest entry of the column as pivot keeps the growth of rounding errors small.
        let mut pivot_row = step;
        for row in step + 1..size {
            if matrix[row * size + step].norm_sqr() > matrix[pivot_row * size + step].norm_sqr() {
                pivot_row = row;
            }
        }
        let pivot = matrix[pivot_row * size + step];
        let length = pivot.norm();
        if !(length > f64::MIN_POSITIVE && length < 1e300) {
            return None;
        }
        direction *= pivot / length;
        exchanges.push(pivot_row);
        if pivot_row != step {
            // An exchange of two rows changes the sign of the determinant.
            direction = -direction;
            for column in 0..size {
                matrix.swap(step * size + column, pivot_row * size + column);
            }
        }
        // The column of the pivot becomes a column of the inverse in place: the unit vector there takes part in the same row operations.
        matrix[step * size + step] = Complex64::new(1.0, 0.0);
        let inverse = pivot.inv();
        for column in 0..size {
            matrix[step * size + column] *= inverse;
        }
        for row in (0..size).filter(|row| *row != step) {
            let factor = matrix[row * size + step];
            matrix[row * size + step] = Complex64::default();
            for column in 0..size {
                let change = factor * matrix[step * size + column];
                matrix[row * size + column] -= change;
            }
        }
    }
    // Exchanges of rows of A are exchanges of columns of the inverse, undone from the last to the first.
    for (step, pivot_row) in exchanges.into_iter().enumerate().rev() {
        if step != pivot_row {
            for row in 0..size {
                matrix.swap(row * size + step, row * size + pivot_row);
            }
        }
    }
    Some(direction / direction.norm())
}
