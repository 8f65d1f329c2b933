//! Regularised incomplete gamma functions P(a, x) and Q(a, x) = 1 − P(a, x), each accurate where it is small.
//!
//! The power series (DLMF 8.7.1) is used below the mean, the continued fraction (DLMF 8.9.2) above the mean, and Temme's uniform expansion (DLMF
//! 8.12.3–8.12.4) near the mean of large shapes. Relative errors were below 10⁻¹³ in every comparison with mpmath; see the tests.

use core::f64::consts::PI;

use super::log_gamma::log_gamma_1p;
use super::temme;

/// Values of P, Q and x·dP/dx = x^a·e^(−x)/Γ(a) at one point.
#[derive(Clone, Copy, Debug)]
pub(in crate::laws::delay) struct Gamma {
    /// P(a, x).
    pub(in crate::laws::delay) below: f64,
    /// Q(a, x).
    pub(in crate::laws::delay) above: f64,
    /// x·dP/dx.
    pub(in crate::laws::delay) slope: f64,
}

/// Returns P, Q and the slope for a > 0 and finite x ≥ 0.
pub(in crate::laws::delay) fn incomplete(a: f64, x: f64) -> Gamma {
    if x <= 0.0 {
        return Gamma { below: 0.0, above: 1.0, slope: 0.0 };
    }
    let excess = (x - a) / a;
    let half_square = -log_1p_minus(excess);
    let slope = slope(a, x, half_square);
    if a >= temme::LEAST_SHAPE && 2.0 * half_square <= temme::LARGEST_ETA {
        let eta = libm::copysign(libm::sqrt(2.0 * half_square), excess);
        let half = 0.5 * libm::erfc(eta.abs() * libm::sqrt(0.5 * a));
        // The factor of the sum, e^(−aη²/2)/√(2πa), is that of the density without Stirling's correction.
        let rest = libm::exp(-a * half_square) / libm::sqrt(2.0 * PI * a) * temme::sum(a, eta);
        let (near, far) = if eta < 0.0 { (half - rest, 1.0 - half + rest) } else { (half + rest, 1.0 - half - rest) };
        return if eta < 0.0 { Gamma { below: near, above: far, slope } } else { Gamma { below: far, above: near, slope } };
    }
    if x < a + 1.0 {
        // For a small shape P is close to 1, and 1 − P would lose the digits of Q.
        if a < 1.0 {
            return small_shape(a, x, slope);
        }
        let below = slope / a * power_series(a, x);
        return Gamma { below, above: 1.0 - below, slope };
    }
    let above = slope * continued_fraction(a, x);
    Gamma { below: 1.0 - above, above, slope }
}

/// Returns x^a·e^(−x)/Γ(a). `half_square` is (x − a)/a − ln(x/a).
fn slope(a: f64, x: f64, half_square: f64) -> f64 {
    if a < 8.0 {
        return a * libm::exp(a * libm::log(x) - x - log_gamma_1p(a));
    }
    // Γ(a) = √(2π/a)·(a/e)^a·e^s(a): the large parts of the exponent cancel before anything is computed.
    libm::exp(-a * half_square - stirling(a)) * libm::sqrt(a / (2.0 * PI))
}

/// Returns ln Γ(a) − (a − ½)·ln a + a − ½·ln 2π for a ≥ 8 (DLMF 5.11.1), from Bernoulli numbers up to B₁₈, with an error below 10⁻¹⁷.
fn stirling(a: f64) -> f64 {
    const TERMS: [f64; 9] = [
        1.0 / 12.0,
        -1.0 / 360.0,
        1.0 / 1260.0,
        -1.0 / 1680.0,
        1.0 / 1188.0,
        -691.0 / 360_360.0,
        1.0 / 156.0,
        -3617.0 / 122_400.0,
        43_867.0 / 244_188.0,
    ];
    let inverse = 1.0 / a;
    inverse * TERMS.iter().rev().fold(0.0, |sum, term| sum * inverse * inverse + term)
}

/// Returns ln(1 + y) − y for y > −1, without cancellation near zero: with r = y/(2 + y), ln(1 + y) = 2·artanh r, and y − 2r = y·r.
pub(in crate::laws::delay) fn log_1p_minus(y: f64) -> f64 {
    if y.abs() > 0.4 {
        return libm::log1p(y) - y;
    }
    let r = y / (2.0 + y);
    let square = r * r;
    // |r| ≤ ¼, so the first omitted term is below 10⁻¹⁸ of the first term.
    let odd = (0..14).rev().fold(0.0, |sum, k| sum * square + 1.0 / f64::from(2 * k + 3));
    2.0 * r * square * odd - y * r
}

/// Returns Σ xⁿ/((a + 1)…(a + n)), DLMF 8.7.1.
fn power_series(a: f64, x: f64) -> f64 {
    let (mut term, mut sum, mut n) = (1.0, 1.0, a);
    while term > sum * 1e-17 {
        n += 1.0;
        term *= x / n;
        sum += term;
    }
    sum
}

/// Returns P, Q and the slope for a < 1 and x < a + 1. With P = e^w·(1 + a·s), w = a·ln x − ln Γ(1 + a) and s = Σ (−x)ⁿ/(n!·(a + n)), Q needs no difference
/// of close numbers even where a is small and P is close to 1.
fn small_shape(a: f64, x: f64, slope: f64) -> Gamma {
    let (mut power, mut sum, mut n) = (1.0, 0.0, 0.0);
    loop {
        n += 1.0;
        power *= -x / n;
        let term: f64 = power / (a + n);
        sum += term;
        if term.abs() <= 1e-17 * sum.abs() {
            break;
        }
    }
    let w = a * libm::log(x) - log_gamma_1p(a);
    let scale = libm::exp(w);
    let above = -libm::expm1(w) - scale * a * sum;
    Gamma { below: slope / a * power_series(a, x), above, slope }
}

/// Returns Γ(a, x)·e^x/x^a by the continued fraction of DLMF 8.9.2, evaluated by Lentz's method (Thompson & Barnett 1986).
fn continued_fraction(a: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / b;
    let mut h = d;
    let mut i = 0.0;
    loop {
        i += 1.0;
        let numerator = -i * (i - a);
        b += 2.0;
        d = numerator * d + b;
        // Lentz's method replaces a zero denominator by a tiny number, which cancels in the next step.
        if d.abs() < TINY {
            d = TINY;
        }
        c = b + numerator / c;
        if c.abs() < TINY {
            c = TINY;
        }
        d = 1.0 / d;
        let factor = d * c;
        h *= factor;
        // The bound is a safeguard: near the mean of a large shape, where convergence is slow, Temme's expansion is used instead.
        if (factor - 1.0).abs() < 2e-16 || i > 10_000.0 {
            return h;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::laws::delay::tests::reference;

    #[test]
    fn both_tails_agree_with_the_reference() {
        for &(a, x, below, above) in reference::GAMMA {
            let at = incomplete(a, x);
            assert!((at.below / below - 1.0).abs() < 1e-13, "P({a}, {x}) = {} is not {below}: {:e}", at.below, at.below / below - 1.0);
            assert!((at.above / above - 1.0).abs() < 1e-13, "Q({a}, {x}) = {} is not {above}: {:e}", at.above, at.above / above - 1.0);
        }
    }
}
