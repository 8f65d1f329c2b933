//! An upper bound of the 2-norm that rounding cannot invalidate, as sharp as it has to be.
//!
//! With G = MᵀM the 2-norm is ‖G^m‖₂^(1/2m) <= ‖G^m‖_F^(1/2m), and the Frobenius norm is above the 2-norm by at most √n, so that the bound is sharp to
//! n^(1/4m). Squaring G over and over doubles m each time.
//!
//! Rounding: write Ĝ for the computed G^m, m = 2^j, and δⱼ = ‖Ĝ − G^m‖_F / ‖G^m‖₂. A product of computed matrices is within γₙ‖·‖_F‖·‖_F of the exact
//! one, and ‖·‖_F² <= n‖·‖₂², so δ₀ <= nγₙ and δ₍ⱼ₊₁₎ <= 2δⱼ + δⱼ² + nγₙ(1 + δⱼ)². While δⱼ <= 1/8 this gives δⱼ <= 2^(j+1)·nγₙ·(5/4) + …; the worst case
//! below, n = 1000 and j = 16, has δ < 10⁻⁴. From ‖G^m‖₂ <= ‖Ĝ‖_F/(1 − δⱼ) and the root of order 2m = 2^(j+1) the factor is at most 1 + 2nγₙ. The Frobenius
//! norm itself is a sum of n² squares and good to γ₍ₙ²₊₂₎.

use super::rounding::{UNDERFLOW, gamma, outward, real, root_above};
use crate::Matrix;

/// Squarings after which n^(1/4m) is below 1 + 10⁻⁵ for every size that can be worked with.
const MOST_SQUARINGS: u32 = 17;

/// How sharp a norm has to be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sharpness {
    /// A bound at or below this is good enough.
    pub enough: f64,
    /// The relative error that is good enough once the norm is known to be above `enough`.
    pub beyond: f64,
}

/// At least the 2-norm of the matrix.
pub(super) fn norm_above(matrix: &Matrix, sharpness: Sharpness) -> f64 {
    let size = real(matrix.rows().max(matrix.columns()));
    let largest = matrix.largest();
    if largest == 0.0 {
        return 0.0;
    }
    if !largest.is_finite() {
        return f64::INFINITY;
    }
    let rounding = outward(1.0 + 2.0 * size * gamma(matrix.rows() + 2) + gamma(matrix.rows() * matrix.columns() + 2));
    let own = libm::frexp(largest).1;
    let scaled = matrix.scaled(libm::ldexp(1.0, -own.clamp(-1000, 1000)));
    let mut power = gram(&scaled);
    let mut exponent = 2.0 * f64::from(own.clamp(-1000, 1000));
    let mut doubled = 2.0;
    let mut best = f64::INFINITY;
    for squaring in 0..=MOST_SQUARINGS {
        let frobenius = frobenius_norm(&power);
        let above = outward(root_above(frobenius, exponent, doubled) * rounding) + UNDERFLOW;
        best = best.min(above);
        // How far above the norm the bound can be at most: n^(1/4m).
        let slack = libm::log(size) / (2.0 * doubled);
        if best <= sharpness.enough || slack < 1e-5 || (best * (1.0 - 1.5 * slack) > sharpness.enough && slack < sharpness.beyond) {
            break;
        }
        if squaring < MOST_SQUARINGS {
            let shift = libm::frexp(frobenius).1;
            power = squared(&power.scaled(libm::ldexp(1.0, -shift)));
            exponent = 2.0 * (exponent + f64::from(shift));
            doubled *= 2.0;
        }
    }
    best
}

/// The root of the sum of the squares, of a matrix whose entries are neither huge nor all tiny.
pub(super) fn frobenius_norm(matrix: &Matrix) -> f64 {
    matrix.entries().iter().map(|entry| entry * entry).sum::<f64>().sqrt()
}

/// MᵀM, symmetric to the bit.
pub(super) fn gram(matrix: &Matrix) -> Matrix {
    let size = matrix.columns();
    let mut product = Matrix::zeros(size, size);
    for inner in 0..matrix.rows() {
        let row = matrix.row(inner);
        for (place, factor) in row.iter().enumerate() {
            for (sum, entry) in product.row_mut(place)[place..].iter_mut().zip(&row[place..]) {
                *sum += factor * entry;
            }
        }
    }
    mirror(&mut product);
    product
}

/// The square of a symmetric matrix: its Gram matrix.
fn squared(symmetric: &Matrix) -> Matrix {
    gram(symmetric)
}

/// The upper triangle copied onto the lower one.
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

    const SHARP: Sharpness = Sharpness { enough: 0.0, beyond: 0.0 };

    #[test]
    fn it_is_above_and_close() {
        let check = |matrix: &Matrix, norm: f64| {
            let above = norm_above(matrix, SHARP);
            assert!(above >= norm && above <= norm * (1.0 + 2e-5), "{above:e} for {norm:e}");
        };
        check(&Matrix::identity(1).scaled(-3.0), 3.0);
        // All singular values alike: where the Frobenius norm is farthest off.
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
        assert!(norm_above(&matrix, Sharpness { enough: 1.0001, beyond: 0.5 }) <= 1.0001);
        assert!(norm_above(&matrix, Sharpness { enough: 0.5, beyond: 0.1 }) <= 1.2);
    }
}
