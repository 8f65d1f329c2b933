//! An upper bound of the 2-norm that rounding cannot invalidate, as sharp as the caller asks.
//!
//! With G = MᵀM the 2-norm is ‖G^m‖₂^(1/2m) <= ‖G^m‖_F^(1/2m), and the Frobenius norm is above the 2-norm by at most √n, so that the bound is sharp to
//! n^(1/4m). Squaring G over and over doubles m each time.
//!
//! The Frobenius norm of M is an upper bound, and the length of the longest row is a lower bound. Both cost little compared with a product and come first,
//! because they decide most cases.
//!
//! Rounding: write Ĝ for the computed G^m, m = 2^j, and δⱼ = ‖Ĝ − G^m‖_F / ‖G^m‖₂. A product of computed matrices is within γₙ‖·‖_F‖·‖_F of the exact
//! one, and ‖·‖_F² <= n‖·‖₂², so δ₀ <= nγₙ and δ₍ⱼ₊₁₎ <= 2δⱼ + δⱼ² + nγₙ(1 + δⱼ)². While δⱼ <= 1/8 this gives δⱼ <= 2^(j+1)·nγₙ·(5/4) + …; the worst case
//! below, n = 1000 and j = 16, has δ < 10⁻⁴. From ‖G^m‖₂ <= ‖Ĝ‖_F/(1 − δⱼ) and the root of order 2m = 2^(j+1) the factor is at most 1 + 2nγₙ. The Frobenius
//! norm itself is a sum of n² squares and good to γ₍ₙ²₊₂₎.

use cohaptic_stability::Matrix;
use cohaptic_stability::numerics::{UNDERFLOW, gamma, outward, real};

use crate::worst_case::root::root_above;

/// Largest number of squarings. After so many, n^(1/4m) is below 1 + 10⁻⁵ for every size in use.
const MOST_SQUARINGS: u32 = 17;

/// The sharpness that a caller needs of a bound of a norm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sharpness {
    /// Threshold: any bound of at most this value is sharp enough.
    pub enough: f64,
    /// Relative error of the bound that is sharp enough if the norm is above `enough`.
    pub beyond: f64,
    /// Threshold: if the norm is at least this value, any bound is sharp enough.
    pub useless: f64,
}

/// Buffers for the powers of a matrix, reused from call to call.
#[derive(Clone, Debug, Default)]
pub(super) struct Norms {
    power: Matrix,
    next: Matrix,
}

/// Returns an upper bound of the 2-norm of the matrix.
pub(super) fn norm_above(matrix: &Matrix, sharpness: Sharpness) -> f64 {
    Norms::default().above(matrix, sharpness)
}

impl Norms {
    /// Returns an upper bound of the 2-norm of the matrix; infinite if an entry is not finite.
    pub(super) fn above(&mut self, matrix: &Matrix, sharpness: Sharpness) -> f64 {
        let size = real(matrix.rows().max(matrix.columns()));
        let largest = matrix.largest();
        if largest == 0.0 {
            return 0.0;
        }
        if !largest.is_finite() {
            return f64::INFINITY;
        }
        let own = libm::frexp(largest).1.clamp(-1000, 1000);
        scale(matrix, libm::ldexp(1.0, -own), &mut self.power);
        // The Frobenius norm (upper bound) and the longest row (lower bound) cost the second power of the size, a squaring costs the third.
        let longest = (0..matrix.rows()).map(|row| self.power.row(row).iter().map(|entry| entry * entry).sum::<f64>()).fold(0.0, f64::max).sqrt();
        let square_sum = gamma(matrix.rows() * matrix.columns() + 2);
        let mut best = outward(libm::ldexp(outward(frobenius_norm(&self.power) * (1.0 + square_sum)), own)) + UNDERFLOW;
        if best <= sharpness.enough || libm::ldexp(longest, own) >= sharpness.useless {
            return best;
        }
        let rounding = outward(1.0 + 2.0 * size * gamma(matrix.rows() + 2) + square_sum);
        let mut exponent = 2.0 * f64::from(own);
        let mut doubled = 2.0;
        for squaring in 0..=MOST_SQUARINGS {
            gram_into(&self.power, &mut self.next);
            std::mem::swap(&mut self.power, &mut self.next);
            let frobenius = frobenius_norm(&self.power);
            best = best.min(outward(root_above(frobenius, exponent, doubled) * rounding) + UNDERFLOW);
            // The eigenvalues of G^m are not negative, so the largest is at least the sum of their squares divided by their sum. This lower bound only decides
            // when to stop; the returned bound does not depend on it.
            let sum: f64 = (0..self.power.rows()).map(|place| self.power[(place, place)]).sum();
            let at_least = best * libm::exp2(libm::log2(frobenius / sum) / doubled);
            let decided = at_least >= sharpness.useless || (at_least > sharpness.enough && best <= at_least * (1.0 + sharpness.beyond));
            // Logarithm of n^(1/4m), the largest ratio of the bound to the norm.
            let slack = libm::log(size) / (2.0 * doubled);
            if squaring == MOST_SQUARINGS || slack < 1e-5 || best <= sharpness.enough || decided {
                break;
            }
            let shift = libm::frexp(frobenius).1;
            scale_in_place(&mut self.power, libm::ldexp(1.0, -shift));
            exponent = 2.0 * (exponent + f64::from(shift));
            doubled *= 2.0;
        }
        best
    }
}

fn scale(matrix: &Matrix, factor: f64, scaled: &mut Matrix) {
    reshape(scaled, matrix.rows(), matrix.columns());
    for row in 0..matrix.rows() {
        for (entry, source) in scaled.row_mut(row).iter_mut().zip(matrix.row(row)) {
            *entry = source * factor;
        }
    }
}

fn scale_in_place(matrix: &mut Matrix, factor: f64) {
    for row in 0..matrix.rows() {
        for entry in matrix.row_mut(row) {
            *entry *= factor;
        }
    }
}

fn reshape(matrix: &mut Matrix, rows: usize, columns: usize) {
    if (matrix.rows(), matrix.columns()) != (rows, columns) {
        *matrix = Matrix::zeros(rows, columns);
    }
}

/// Returns the root of the sum of the squares of all entries. The squares must not overflow or all underflow.
pub(super) fn frobenius_norm(matrix: &Matrix) -> f64 {
    matrix.entries().iter().map(|entry| entry * entry).sum::<f64>().sqrt()
}

/// Returns MᵀM, symmetric to the bit. For a symmetric matrix MᵀM is the square.
pub(super) fn gram(matrix: &Matrix) -> Matrix {
    let mut product = Matrix::default();
    gram_into(matrix, &mut product);
    product
}

fn gram_into(matrix: &Matrix, product: &mut Matrix) {
    let size = matrix.columns();
    reshape(product, size, size);
    for place in 0..size {
        product.row_mut(place).fill(0.0);
    }
    for inner in 0..matrix.rows() {
        let row = matrix.row(inner);
        for (place, factor) in row.iter().enumerate() {
            for (sum, entry) in product.row_mut(place)[place..].iter_mut().zip(&row[place..]) {
                *sum += factor * entry;
            }
        }
    }
    mirror(product);
}

/// Copies the upper triangle of a square matrix onto the lower triangle.
pub(super) fn mirror(matrix: &mut Matrix) {
    for row in 0..matrix.rows() {
        for column in 0..row {
            matrix[(row, column)] = matrix[(column, row)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHARP: Sharpness = Sharpness { enough: 0.0, beyond: 0.0, useless: f64::INFINITY };

    #[test]
    fn it_is_above_and_close() {
        let check = |matrix: &Matrix, norm: f64| {
            let above = norm_above(matrix, SHARP);
            assert!(above >= norm && above <= norm * (1.0 + 2e-5), "{above:e} for {norm:e}");
        };
        check(&Matrix::identity(1).scaled(-3.0), 3.0);
        // All singular values equal: the case in which the Frobenius norm is largest compared with the 2-norm.
        check(&Matrix::identity(12).scaled(0.3), 0.3);
        check(&Matrix::identity(3).scaled(1e-300), 1e-300);
        check(&Matrix::identity(3).scaled(1e300), 1e300);
        // [1 1; 0 1] has the golden ratio.
        check(&Matrix::from_fn(2, 2, |i, j| if i <= j { 1.0 } else { 0.0 }), (1.0 + 5.0_f64.sqrt()) / 2.0);
        // A column times a row has the product of their lengths.
        check(&Matrix::from_fn(5, 5, |i, j| real(i) * (real(j) + 1.0)), (30.0_f64 * 55.0).sqrt() * (1.0 - 1e-15));
        assert_eq!(norm_above(&Matrix::zeros(3, 3), SHARP).to_bits(), 0.0_f64.to_bits());
        assert!(norm_above(&Matrix::identity(2).scaled(f64::NAN), SHARP).is_infinite());
    }

    #[test]
    fn it_decides_against_a_threshold() {
        let matrix = Matrix::identity(12);
        assert!(norm_above(&matrix, Sharpness { enough: 1.0001, beyond: 0.5, useless: f64::INFINITY }) <= 1.0001);
        assert!(norm_above(&matrix, Sharpness { enough: 0.5, beyond: 0.1, useless: f64::INFINITY }) <= 1.2);
        // For a norm above `useless` the bound need not be sharp, but must still be a bound.
        let crude = norm_above(&matrix, Sharpness { useless: 0.9, ..SHARP });
        assert!((1.0..=12.0_f64.sqrt() * (1.0 + 1e-9)).contains(&crude));
    }
}
