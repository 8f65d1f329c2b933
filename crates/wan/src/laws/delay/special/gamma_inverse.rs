//! Inverse of the incomplete gamma functions.
//!
//! In w = ln x both ln P and ln Q are concave (the density of the logarithm of a gamma variable is log-concave). Newton's method therefore converges from
//! any start, after its first step from one side. Halley's correction makes the last steps cubic.

use super::gamma::incomplete;
use super::log_gamma::log_gamma_1p;
use crate::laws::delay::tail::Tail;

/// Returns x with P(a, x) = p or Q(a, x) = q. `z` is the normal quantile of the same tail, from which the search begins.
pub(in crate::laws::delay) fn inverse(a: f64, tail: Tail, z: f64) -> f64 {
    // P(a, x) = x^a/Γ(a + 1) · (1 − x·a/(a + 1) + …): for x below 10⁻¹⁷ only the first term is visible.
    let leading = match tail {
        Tail::Below(p) => (libm::log(p) + log_gamma_1p(a)) / a,
        Tail::Above(q) => (libm::log1p(-q) + log_gamma_1p(a)) / a,
    };
    if leading < -39.0 {
        return libm::exp(leading);
    }
    let mut log_x = start(a, tail, z, leading);
    for _ in 0..100 {
        let step = step(a, log_x, tail);
        log_x += step;
        // The next step would be of the order of the cube of this step, or of the size of rounding errors.
        if step.abs() < 1e-6 || step.abs() <= 4e-16 * log_x.abs() {
            break;
        }
    }
    // One more step is applied to x itself, because ln x of a large x has lost the last digits of x.
    let x = libm::exp(log_x);
    x + x * libm::expm1(step_at(a, x, tail))
}

/// Returns a first ln x: from Wilson & Hilferty (1931) in the middle, the first term of the series in the lower tail, and the first term of the asymptotic
/// expansion in the upper tail.
fn start(a: f64, tail: Tail, z: f64, leading: f64) -> f64 {
    let cube = 1.0 - 1.0 / (9.0 * a) + z / (3.0 * libm::sqrt(a));
    if a > 0.5 && cube > 0.3 {
        return libm::log(a) + 3.0 * libm::log(cube);
    }
    match tail {
        Tail::Above(q) if q < 0.1 * a => {
            // Q ≈ e^(−x)·x^(a − 1)/Γ(a).
            let beyond = -libm::log(q) + libm::log(a) - log_gamma_1p(a);
            libm::log((beyond + (a - 1.0) * libm::log(beyond.max(1.0))).max(0.1))
        }
        Tail::Above(_) | Tail::Below(_) => leading.min(libm::log(a + 1.0)),
    }
}

/// Returns the step of [`step_at`] for a logarithm.
fn step(a: f64, log_x: f64, tail: Tail) -> f64 {
    step_at(a, libm::exp(log_x), tail)
}

/// Returns Halley's step in ln x towards ln P = ln p or ln Q = ln q, or Newton's step where Halley's correction is too large.
fn step_at(a: f64, x: f64, tail: Tail) -> f64 {
    let at = incomplete(a, x);
    // Error of the logarithm divided by its slope, and second derivative divided by the first.
    let (newton, curvature) = match tail {
        Tail::Below(p) => (-libm::log(at.below / p) * at.below / at.slope, a - x - at.slope / at.below),
        Tail::Above(q) => (libm::log(at.above / q) * at.above / at.slope, a - x + at.slope / at.above),
    };
    let halley = 1.0 + 0.5 * newton * curvature;
    let step = if halley > 0.5 && halley < 2.0 { newton / halley } else { newton };
    // NaN arises where a probability underflows, and ends the search. The bound keeps a first step within a factor of e^20 of x.
    if step.is_nan() { 0.0 } else { step.clamp(-20.0, 20.0) }
}
