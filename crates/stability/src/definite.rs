//! Check that a symmetric matrix with errors is positive definite. Every certificate of this project ends with this check.
//!
//! The check follows Rump 2006, "Verification of positive definiteness". If the Cholesky factorisation of a symmetric matrix B runs to its end in floating
//! point, then B + D >= 0 for some symmetric D with ‖D‖₂ <= γ₍ₙ₊₁₎/(1 − γ₍ₙ₊₁₎)·tr B, for any order of the sums. The check factorises B = M − cI, as computed.
//! Here c exceeds the sum of three errors: the bound above, the error of M, and the rounding of the subtraction. If the factorisation runs to its end, then
//! M > 0. The 2-norm of a symmetric error is at most the largest sum of absolute values of a row. M is first scaled by powers of two, which is exact. The
//! diagonal of M is then near 1, and one c suits quantities of very different size.

use crate::Matrix;
use crate::factorisation::cholesky;
use crate::rounding::{UNDERFLOW, UNIT, gamma, outward, real};

/// Returns whether every symmetric matrix that differs from `symmetric` by at most `error`, entry by entry, is positive definite. `false` may also mean that
/// the check could not decide.
pub fn is_positive(symmetric: &Matrix, error: &Matrix) -> bool {
    let size = symmetric.rows();
    let diagonal: Vec<f64> = (0..size).map(|place| symmetric[(place, place)]).collect();
    // The comparisons are written so that NaN fails the check.
    if !(diagonal.iter().all(|entry| *entry > 0.0 && entry.is_finite()) && error.is_finite()) {
        return false;
    }
    // The diagonal matrix D of powers of two scales M to D·M·D, whose diagonal is between 1/2 and 2.
    let halves: Vec<f64> = diagonal.iter().map(|entry| libm::ldexp(1.0, -libm::frexp(*entry).1.div_euclid(2))).collect();
    let scaled = |of: &Matrix| Matrix::from_fn(size, size, |i, j| of[(i, j)] * halves[i] * halves[j]);
    let (mut matrix, error) = (scaled(symmetric), scaled(error));
    let trace: f64 = (0..size).map(|place| matrix[(place, place)]).sum();
    let rows = (0..size).map(|row| error.row(row).iter().sum::<f64>() + real(size) * UNDERFLOW).fold(0.0, f64::max);
    let share = gamma(size + 1) / (1.0 - gamma(size + 1));
    // The last terms: the diagonal's subtraction rounds once, at most at 2 + c; underflow in the factorisation (Rump 2006, eq. 2.4 bounds it by less).
    let shift = outward(share * trace * (1.0 + gamma(size)) + rows * (1.0 + gamma(size))) + 4.0 * UNIT + 8.0 * real(size * size) * UNDERFLOW;
    if shift >= 0.5 || shift.is_nan() {
        return false;
    }
    for place in 0..size {
        matrix[(place, place)] -= shift;
    }
    cholesky(&matrix).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Determinants of 1e-12 and −1e-12: both factorise, or fail to, by the last digits alone.
    #[test]
    fn positive_definite_is_told_from_indefinite_near_singular() {
        let near = |d: f64| Matrix::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 1.0 - d });
        let none = Matrix::zeros(2, 2);
        assert!(is_positive(&near(1e-12), &none) && !is_positive(&near(-1e-12), &none) && !is_positive(&near(0.0), &none));
        // An error that could make it indefinite.
        assert!(!is_positive(&near(1e-12), &Matrix::from_fn(2, 2, |_, _| 1e-12)));
        // Entries of very different size are no obstacle.
        let uneven = Matrix::from_fn(2, 2, |i, j| [[1e-20, 0.5e-5], [0.5e-5, 1e10]][i][j]);
        assert!(is_positive(&uneven, &none));
    }
}
