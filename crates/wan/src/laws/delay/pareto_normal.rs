//! Mixture of a normal and a Pareto law as in netem: Q(u) = Φ⁻¹(u)/4 + (1 − u)^(−1/3), both terms of the same u.
//!
//! `paretonormal.dist` adds ¼ of a normal number to ¾ of netem's Pareto number, which is 4/3·((1 − u)^(−1/3) − 3/2). The table scales the sum as if its
//! standard deviation were 1; this module uses the true deviation.

use super::cut::Moments;
use super::special::{normal, quadrature, root};

/// Mean of Q: the mean of (1 − U)^(−1/3), ∫ q^(−1/3) dq, plus the mean of Φ⁻¹(U)/4, zero.
pub(super) const MEAN: f64 = 1.5;

/// Standard deviation of Q, √(1/16 + 3/4 + ½·E[Z·X]), where E[Z·X] = ∫ z·Φ(−z)^(−1/3)·φ(z) dz = 0.587470748478335… (40 digits of mpmath).
pub(super) const SD: f64 = 1.051_777_245_541_644;

/// Returns Q(Φ(z)). `above` is the probability above z.
pub(super) fn at(z: f64, above: f64) -> f64 {
    0.25 * z + 1.0 / libm::cbrt(above)
}

/// Returns z with Q(Φ(z)) = x, between −38 and 37.
pub(super) fn normal_of(x: f64) -> f64 {
    root::increasing(|z| at(z, normal::below(-z)) - x, -38.0, 37.0)
}

/// Returns the moments of max((Q − MEAN)/SD, c) for c ≤ 0: the moments without a cut, plus the addition of the cut below the z with Q = c.
pub(super) fn cut_moments(cut: f64) -> Moments {
    let end = normal_of(MEAN + SD * cut);
    let begin = -38.0;
    // The cut lies below every drawn value.
    if end <= begin {
        return Moments::STANDARD;
    }
    let standard = |z: f64| (at(z, normal::below(-z)) - MEAN) / SD;
    let mean = quadrature::integral(begin, end, |z| (cut - standard(z)) * normal::density(z));
    // c² − s² as a product, so no digits cancel near the cut.
    let square = quadrature::integral(begin, end, |z| (cut - standard(z)) * (cut + standard(z)) * normal::density(z));
    Moments { mean, sd: libm::sqrt(1.0 + (square - mean * mean)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_deviation_are_those_of_the_quantiles() {
        let moment = |k: i32| quadrature::integral(-12.0, 24.0, |z| at(z, normal::below(-z)).powi(k) * normal::density(z));
        assert!((moment(1) / MEAN - 1.0).abs() < 1e-14);
        assert!((moment(2) / (MEAN * MEAN + SD * SD) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn the_inverse_inverts() {
        for i in -300..=300 {
            let z = 0.1 * f64::from(i);
            let again = normal_of(at(z, normal::below(-z)));
            assert!((again - z).abs() < 1e-13 * z.abs().max(1.0), "{z}: {again}");
        }
    }
}
