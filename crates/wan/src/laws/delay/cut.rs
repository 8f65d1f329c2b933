//! Mean and standard deviation of a law cut at a floor: moments of max(X, c), for X with mean 0, standard deviation 1 and no least value.

use super::special::normal;

/// Mean and standard deviation.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Moments {
    pub(super) mean: f64,
    pub(super) sd: f64,
}

impl Moments {
    /// Moments of an uncut law.
    pub(super) const STANDARD: Self = Self { mean: 0.0, sd: 1.0 };
}

/// Returns the moments of the cut normal law, for c ≤ 0. With P = Φ(c) and d = φ(c): E = d + c·P and E² = c²·P + c·d + 1 − P.
pub(super) fn normal(cut: f64) -> Moments {
    let (probability, density) = (normal::below(cut), normal::density(cut));
    // Far below the mean nothing is cut. The products below would be NaN for c = −∞.
    if probability == 0.0 {
        return Moments::STANDARD;
    }
    let mean = density + cut * probability;
    Moments { mean, sd: libm::sqrt(1.0 + (cut * (cut * probability + density) - probability - mean * mean)) }
}

/// Returns the moments of the cut Laplace law, for c ≤ 0. In units of its scale 1/√2 and with t = −c·√2: E = e^(−t)/2 and E² = 2 − (1 + t)·e^(−t).
pub(super) fn laplace(cut: f64) -> Moments {
    let t = -cut * core::f64::consts::SQRT_2;
    let lost = libm::exp(-t);
    if lost == 0.0 {
        return Moments::STANDARD;
    }
    let mean = 0.5 * lost;
    Moments { mean: mean * core::f64::consts::FRAC_1_SQRT_2, sd: libm::sqrt(1.0 - 0.5 * ((1.0 + t) * lost + mean * mean)) }
}
