//! Bounds of the rounding errors of one operation and of sums of products.
//!
//! With u = 2⁻⁵³, a sum of k products, in any order, is within γₖ·Σ|aᵢ·bᵢ| of the exact one, γₖ = k·u/(1 − k·u) (Higham 2002, Section 3.1). Bounds are
//! themselves computed in floating point; a formula of a few additions, products and quotients of numbers that are not negative has a relative error of
//! at most its number of operations times u, and [`outward`] adds more than that.

/// Half the distance from 1 to the next number: the largest relative error of one rounding.
pub const UNIT: f64 = f64::EPSILON / 2.0;

/// Bound of the error by underflow of a few operations on numbers near 1.
pub const UNDERFLOW: f64 = f64::MIN_POSITIVE;

/// Returns γₖ rounded up, for k operations. Infinite if k·u is 1/2 or more.
pub fn gamma(operations: usize) -> f64 {
    let share = real(operations) * UNIT;
    if share < 0.5 { share / (1.0 - share) * (1.0 + 8.0 * UNIT) } else { f64::INFINITY }
}

/// Returns a bound rounded up, so that it holds although the formula that gave it rounded up to fifty times. The formula's numbers must not be negative.
pub fn outward(bound: f64) -> f64 {
    bound * (1.0 + 64.0 * UNIT)
}

/// Converts a count to a floating-point number, exactly for counts up to 2^53.
#[expect(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
pub const fn real(count: usize) -> f64 {
    count as f64
}
