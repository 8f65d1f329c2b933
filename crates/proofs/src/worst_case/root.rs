//! Roots of numbers beyond the range of floating point, rounded to one side.

use cohaptic_stability::numerics::UNIT;

/// Returns an upper bound of (x·2^`exponent`)^(1/k), for `x` of at least zero.
pub(crate) fn root_above(x: f64, exponent: f64, k: f64) -> f64 {
    root(x, exponent, k, 1.0)
}

/// Returns a lower bound of (x·2^`exponent`)^(1/k), for `x` of at least zero.
pub(crate) fn root_below(x: f64, exponent: f64, k: f64) -> f64 {
    root(x, exponent, k, -1.0)
}

/// Returns 2^((log₂ x + exponent)/k), moved by the bound of its error: up if `side` is 1, down if `side` is −1. The logarithm, at most 1100 in size, is
/// accurate to one unit in the last place, the sum and the quotient round once each, and an error d of the argument of 2^ is a relative error below d of the
/// result.
fn root(x: f64, exponent: f64, k: f64, side: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let logarithm = libm::log2(x);
    let slack = 4.0 * UNIT * (2.0 + (logarithm.abs() + exponent.abs()) / k);
    let root = libm::exp2((logarithm + exponent) / k) * (1.0 + side * slack);
    // A root that underflowed is at most the smallest normal number; zero would be no upper bound.
    if side > 0.0 { root.max(f64::MIN_POSITIVE) } else { root }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_enclose() {
        for (x, exponent, k) in [(2.0, 0.0, 2.0), (1e-300, 5.0, 7.0), (0.7, -40.0, 1024.0), (1.5, 12345.0, 1e6), (3.0, 0.0, 1.0)] {
            let (below, above) = (root_below(x, exponent, k), root_above(x, exponent, k));
            assert!(below < above && above - below < 1e-12 * above);
        }
        assert!(root_below(2.0, 0.0, 2.0).powi(2) <= 2.0 && root_above(2.0, 0.0, 2.0).powi(2) >= 2.0);
        assert!(root_below(3.0, 0.0, 1.0) <= 3.0 && root_above(3.0, 0.0, 1.0) >= 3.0);
        assert_eq!(root_above(0.0, 3.0, 2.0).to_bits(), 0.0_f64.to_bits());
    }
}
