//! The shape of a Weibull law from its coefficient of variation.

use super::log_gamma::log_gamma_ratio;
use super::root;

/// 1/k of the Weibull law whose standard deviation is `variation` times its mean: 1 + CV² = Γ(1 + 2/k)/Γ(1 + 1/k)². The right side increases with
/// 1/k from 1 without bound, so there is exactly one. For 0 < variation ≤ 100.
pub(in crate::law) fn inverse_shape(variation: f64) -> f64 {
    let target = libm::log1p(variation * variation);
    // ln of the right side is π²/6·t² for small t and below 2·ln 2·t for large: the root lies between half of one and the sum of both.
    let small = variation * libm::sqrt(6.0) / core::f64::consts::PI;
    root::increasing(|t| log_gamma_ratio(t) - target, 0.1 * small, 2.0 * small + target + 1.0)
}
