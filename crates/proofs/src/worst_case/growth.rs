//! A lower bound of a spectral radius that rounding cannot invalidate, without eigenvalues.
//!
//! The trace of a power is the sum of the eigenvalues' powers, hence ρ(M) >= (|tr Mᵏ|/n)^(1/k) for every Jordan form. As k grows the bound becomes sharp, to
//! ln(n)/k, wherever the terms of the trace do not cancel. With k = 2, 4, 8, … by squaring, the terms of a complex pair cannot cancel twice running, since
//! cos 2x = 2cos²x − 1. The terms of more eigenvalues of the same modulus can cancel each time (a cyclic permutation of three: tr M^(2^j) = 0 for all j), but
//! the traces of Mᵏ·M, Mᵏ·M², …, Mᵏ·Mⁿ cannot all cancel (Turán 1953, second main theorem).
//!
//! Rounding: the exact power is 2^s·(N + E), N computed, ‖E‖₂ <= e. Its square is N² + NE + EN + E², and N² is computed to within γₙ‖N‖_F², so that
//! e' = 2‖N‖₂e + e² + γₙ‖N‖_F². The trace of N + E is within n·e of that of N, in addition to the rounding of its own sum. Relative to N the error doubles with
//! every squaring, but its root of order k does not grow.

use cohaptic_stability::Matrix;
use cohaptic_stability::numerics::{UNDERFLOW, gamma, outward, real};

use super::norm::{Sharpness, frobenius_norm, norm_above};
use crate::worst_case::root::{root_above, root_below};

/// Largest number of squarings. At the power 2^36 the slack ln(n)/k is about 10⁻¹⁰.
const MOST_SQUARINGS: u32 = 36;

/// A computed matrix, and an upper bound of its distance from the exact matrix in the 2-norm.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Approximate {
    pub matrix: Matrix,
    pub error: f64,
}

impl Approximate {
    /// Returns the product self·other, with an error that covers the errors of both factors and the rounding of the product. `norm` and `other_norm` are upper
    /// bounds of the 2-norms of the two computed factors.
    pub(super) fn times(&self, norm: f64, other: &Self, other_norm: f64) -> Self {
        let product = self.matrix.times(&other.matrix);
        let frobenius = frobenius_norm(&self.matrix) * frobenius_norm(&other.matrix);
        // Two more operations in γ cover the roundings of the Frobenius norms themselves.
        let size = real(self.matrix.rows());
        let rounding = gamma(self.matrix.rows() + 2) * frobenius * (1.0 + gamma(self.matrix.entries().len() + 2)) + size * size * UNDERFLOW;
        let error = outward(norm * other.error + self.error * other_norm + self.error * other.error + rounding);
        Self { matrix: product, error }
    }

    /// Returns an upper bound of the 2-norm of the exact matrix; `computed` is an upper bound of the 2-norm of the computed matrix.
    pub(super) fn norm(&self, computed: f64) -> f64 {
        outward(computed + self.error)
    }

    fn scaled_by_power_of_two(&self, exponent: i32) -> Self {
        let factor = libm::ldexp(1.0, exponent);
        Self { matrix: self.matrix.scaled(factor), error: self.error * factor + UNDERFLOW }
    }
}

/// Returns a lower bound of ρ^(1/`length`), with ρ the spectral radius of the exact matrix, a product of `length` factors. Ends early, with the best bound so
/// far, once ρ^(1/`length`) is known to be at most `enough`.
pub(super) fn radius_below(product: &Approximate, length: usize, enough: f64) -> f64 {
    let size = real(product.matrix.rows());
    let largest = product.matrix.largest();
    if largest == 0.0 || !largest.is_finite() {
        return 0.0;
    }
    let shift = libm::frexp(largest).1.clamp(-1000, 1000);
    let base = product.scaled_by_power_of_two(-shift);
    let base_exponent = f64::from(shift);
    let mut shifts: Vec<(Approximate, f64)> = Vec::new();
    let mut power = base.clone();
    let (mut exponent, mut factors, mut best) = (base_exponent, 1.0, 0.0_f64);
    for _ in 0..MOST_SQUARINGS {
        let norm = norm_above(&power.matrix, Sharpness { enough: 0.0, beyond: 0.02, useless: f64::INFINITY });
        // ρ(M)ᵏ = ρ(Mᵏ) <= ‖Mᵏ‖.
        let above = root_above(power.norm(norm), exponent, factors * real(length));
        if above <= enough || norm == 0.0 {
            break;
        }
        // Once n times the error exceeds half of the norm, the trace says little about the exact power.
        let (share, sure) = (trace_share(&power), power.error * size < 0.5 * norm);
        best = best.max(root_below(share, exponent, factors * real(length)));
        // A trace that is small compared with the norm is a sign of cancelling eigenvalues: then the shifted powers are tried.
        if share < 0.05 / size * norm && sure {
            if shifts.is_empty() {
                shifts = powers(&base);
            }
            for (extra, (other, other_norm)) in shifts.iter().enumerate() {
                let moved = power.times(norm, other, *other_norm);
                let (more, moved_exponent) = (real(extra + 1), base_exponent * real(extra + 1));
                best = best.max(root_below(trace_share(&moved), exponent + moved_exponent, (factors + more) * real(length)));
            }
        }
        if !sure {
            break;
        }
        let squared = power.times(norm, &power, norm);
        let largest = squared.matrix.largest();
        if largest == 0.0 || !largest.is_finite() {
            break;
        }
        // Brings the entries back to about 1, so that no power overflows; `exponent` keeps the scale.
        let shift = libm::frexp(largest).1;
        power = squared.scaled_by_power_of_two(-shift);
        exponent = 2.0 * exponent + f64::from(shift);
        factors *= 2.0;
    }
    best
}

/// Returns a lower bound of |tr|/n of the exact matrix, at least 0. The spectral radius of the exact matrix is at least this value too.
fn trace_share(power: &Approximate) -> f64 {
    let size = real(power.matrix.rows());
    let diagonal = || (0..power.matrix.rows()).map(|place| power.matrix[(place, place)]);
    let sizes: f64 = diagonal().map(f64::abs).sum();
    let error = outward(size * power.error + gamma(power.matrix.rows() + 2) * sizes);
    ((diagonal().sum::<f64>().abs() - error) / size * (1.0 - f64::EPSILON)).max(0.0)
}

/// Returns M, M², …, Mⁿ, each with an upper bound of the 2-norm of the computed matrix.
fn powers(base: &Approximate) -> Vec<(Approximate, f64)> {
    let norm_of = |of: &Approximate| norm_above(&of.matrix, Sharpness { enough: 0.0, beyond: 0.02, useless: f64::INFINITY });
    let base_norm = norm_of(base);
    let mut powers = vec![(base.clone(), base_norm)];
    while powers.len() < base.matrix.rows() {
        let (last, norm) = &powers[powers.len() - 1];
        let next = last.times(*norm, base, base_norm);
        let norm = norm_of(&next);
        powers.push((next, norm));
    }
    powers
}

#[cfg(test)]
mod tests {
    use super::*;

    fn below(matrix: Matrix) -> f64 {
        radius_below(&Approximate { matrix, error: 0.0 }, 1, 0.0)
    }

    fn of(rows: &[&[f64]]) -> Matrix {
        Matrix::from_fn(rows.len(), rows.len(), |i, j| rows[i][j])
    }

    #[test]
    fn it_is_below_and_close() {
        let check = |matrix: Matrix, radius: f64, relative: f64| {
            let bound = below(matrix);
            assert!(bound <= radius && bound >= radius * (1.0 - relative), "{bound:e} for {radius:e}");
        };
        check(of(&[&[-0.7]]), 0.7, 1e-13);
        check(of(&[&[2.0, 1.0], &[1.0, 1.0]]), (3.0 + 5.0_f64.sqrt()) / 2.0, 1e-9);
        // A Jordan block, a rotation by one radian, a complex pair beside a smaller real one, and far from normal.
        check(of(&[&[1.0, 1.0], &[0.0, 1.0]]), 1.0, 1e-6);
        let (s, c) = (libm::sin(1.0), libm::cos(1.0));
        check(of(&[&[c, -s], &[s, c]]), 1.0 + 1e-15, 1e-8);
        check(of(&[&[c, -s, 3.0], &[s, c, 1.0], &[0.0, 0.0, -0.9]]), 1.0 + 1e-15, 1e-6);
        // Here ‖N‖² is a thousand times ‖N²‖, and the error outgrows the power after five squarings: ln(n)/k is ln(2)/16 at worst. In the coordinates of
        // a certificate there is no such matrix.
        check(of(&[&[0.5, 100.0], &[0.0, 0.4]]), 0.5, 0.05);
    }

    /// Every trace of M^(2^j) is zero or tiny: only the shifted powers show the radius.
    #[test]
    fn cyclic_permutations_do_not_hide() {
        for size in 2..=7 {
            let cyclic = Matrix::from_fn(size, size, |i, j| if (j + 1) % size == i { 3.0 } else { 0.0 });
            let bound = below(cyclic);
            assert!(bound <= 3.0 && bound > 3.0 * (1.0 - 1e-8), "{size}: {bound}");
        }
    }

    #[test]
    fn a_nilpotent_matrix_has_none_and_an_error_is_taken_off() {
        assert_eq!(below(of(&[&[0.0, 5.0], &[0.0, 0.0]])).to_bits(), 0.0_f64.to_bits());
        let bound = radius_below(&Approximate { matrix: of(&[&[0.5]]), error: 0.01 }, 1, 0.0);
        assert!(bound <= 0.49 && bound > 0.46, "{bound}");
        // The root of the number of factors.
        let bound = radius_below(&Approximate { matrix: of(&[&[8.0]]), error: 0.0 }, 3, 0.0);
        assert!(bound <= 2.0 && bound > 2.0 - 1e-12);
    }
}
