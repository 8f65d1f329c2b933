//! Bounds of rounding errors: what one rounding costs, and what many do.
//!
//! With u = 2⁻⁵³, a sum of k products, in any order, is within γₖ·Σ|aᵢ·bᵢ| of the exact one, γₖ = k·u/(1 − k·u) (Higham 2002, Section 3.1). Bounds are
//! themselves computed in floating point; a formula of a few additions, products and quotients of numbers that are not negative has a relative error of
//! at most its number of operations times u, and [`outward`] adds more than that.

/// Half the distance from 1 to the next number: the largest relative error of one rounding.
pub(crate) const UNIT: f64 = f64::EPSILON / 2.0;

/// More than any underflow of a few operations on numbers near 1 can cost.
pub(crate) const UNDERFLOW: f64 = f64::MIN_POSITIVE;

/// γₖ, itself rounded up.
pub(crate) fn gamma(operations: usize) -> f64 {
    let share = real(operations) * UNIT;
    if share < 0.5 { share / (1.0 - share) * (1.0 + 8.0 * UNIT) } else { f64::INFINITY }
}

/// A bound that a formula of at most fifty roundings of non-negative numbers gave, rounded up.
pub(crate) fn outward(bound: f64) -> f64 {
    bound * (1.0 + 64.0 * UNIT)
}

/// At least (x·2^`exponent`)^(1/k): for a bound from above. `x` is not negative.
pub(crate) fn root_above(x: f64, exponent: f64, k: f64) -> f64 {
    root(x, exponent, k, 1.0)
}

/// At most (x·2^`exponent`)^(1/k): for a bound from below. `x` is not negative.
pub(crate) fn root_below(x: f64, exponent: f64, k: f64) -> f64 {
    root(x, exponent, k, -1.0)
}

/// 2^((log₂ x + exponent)/k). The logarithm is good to one unit in the last place of at most 1100, the sum and quotient round once each, and an error d of
/// the argument of 2^ is a relative error below d of the result.
fn root(x: f64, exponent: f64, k: f64, side: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let logarithm = libm::log2(x);
    let slack = 4.0 * UNIT * (2.0 + (logarithm.abs() + exponent.abs()) / k);
    let root = libm::exp2((logarithm + exponent) / k) * (1.0 + side * slack);
    // A root that underflowed is bounded by the smallest ordinary number.
    if side > 0.0 { root.max(f64::MIN_POSITIVE) } else { root }
}

/// A count as a number.
#[expect(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
pub(crate) const fn real(count: usize) -> f64 {
    count as f64
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
