//! A spectral radius with a bound of its error, and the verdict from the radius.

/// A spectral radius with a bound of its error: the true radius lies within `value ± error`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Radius {
    /// The largest modulus of an eigenvalue, as computed; infinite if the numbers overflowed.
    pub value: f64,
    /// Largest distance of the true radius from the value, zero or more. Infinite if nothing is known of the radius. An infinite value with a finite error
    /// means that the radius is above 1 and has no known upper bound.
    pub error: f64,
}

/// Verdict from a spectral radius.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Verdict {
    /// The radius is below 1: every disturbance of the relative motion dies out.
    Stable,
    /// The radius cannot be distinguished from 1 within its error.
    Marginal,
    /// Nothing is known of the radius: numbers overflowed, or the errors grew far above 1.
    Overflow,
    /// The radius is above 1: some disturbance grows.
    Unstable,
}

impl Radius {
    /// A radius of which nothing is known.
    pub(crate) const UNKNOWN: Self = Self { value: f64::INFINITY, error: f64::INFINITY };

    /// Returns a radius of at least `low` without an upper bound.
    pub(crate) fn at_least(low: f64) -> Self {
        // An infinite value without error says only that the radius is above 1, which is enough for a verdict.
        if low > 1.0 { Self { value: f64::INFINITY, error: 0.0 } } else { Self::UNKNOWN }
    }

    /// Returns the verdict: [`Verdict::Marginal`] if the interval includes 1, [`Verdict::Overflow`] if the interval also reaches 2^52. Compared with 2^52, 1 is
    /// rounding.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let (low, high) = self.bounds();
        if high < 1.0 {
            Verdict::Stable
        } else if low > 1.0 {
            Verdict::Unstable
        } else if high < 1.0 / f64::EPSILON {
            Verdict::Marginal
        } else {
            Verdict::Overflow
        }
    }

    /// Returns the interval around the radius: from 0 to infinity if nothing is known of the radius.
    #[must_use]
    pub fn bounds(&self) -> (f64, f64) {
        let (low, high) = (self.value - self.error, self.value + self.error);
        // A comparison with NaN is false, so NaN gives the whole interval.
        (if low > 0.0 { low } else { 0.0 }, if high >= 0.0 { high } else { f64::INFINITY })
    }

    /// Returns the radius of the matrix times `factor`, a power of two above 1.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        let (low, high) = self.bounds();
        if (factor * high).is_finite() { Self { value: factor * self.value, error: factor * self.error } } else { Self::at_least(factor * low) }
    }

    /// Returns the radius over a number of frames: the power of this radius, with the error from its interval.
    #[must_use]
    pub fn over(self, frames: u32) -> Self {
        if frames == 1 {
            return self;
        }
        let power = |base: f64| libm::pow(base, f64::from(frames));
        // The power rises with its base, so the powers of the bounds are bounds of the power.
        let (low, high) = self.bounds();
        let (value, low, high) = (power(self.value), power(low), power(high));
        let rounding = f64::EPSILON * f64::from(frames);
        if high.is_finite() {
            Self { value, error: (high - value).max(value - low) + rounding * value }
        } else {
            Self::at_least(low * (1.0 - rounding))
        }
    }

    /// Returns the radius of two independent systems together: the larger radius, with an error covering both intervals.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        // The maximum of two numbers lies between the maximum of the lower bounds and the maximum of the upper bounds.
        let ((one_low, one_high), (other_low, other_high)) = (self.bounds(), other.bounds());
        let (low, high) = (one_low.max(other_low), one_high.max(other_high));
        if high.is_finite() {
            let value = self.value.max(other.value);
            Self { value, error: (high - value).max(value - low) }
        } else {
            Self::at_least(low)
        }
    }
}

/// Returns the larger of two radii, with `BOUND` with an error covering both. Without `BOUND` the errors are ignored, and NaN counts as the largest.
pub(crate) fn worse<const BOUND: bool>(one: Radius, other: Radius) -> Radius {
    if BOUND {
        one.or(other)
    } else if other.value > one.value || other.value.is_nan() {
        other
    } else {
        one
    }
}

impl Verdict {
    /// Returns the name of the verdict in JSON and CSV: `stable`, `marginal`, `overflow` or `unstable`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Marginal => "marginal",
            Self::Overflow => "overflow",
            Self::Unstable => "unstable",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_needs_the_whole_interval_on_one_side() {
        let verdict = |value, error| Radius { value, error }.verdict();
        assert_eq!(verdict(0.9, 0.05), Verdict::Stable);
        assert_eq!(verdict(0.9, 0.1), Verdict::Marginal);
        assert_eq!(verdict(1.1, 0.05), Verdict::Unstable);
        assert_eq!(verdict(1.0, 0.0), Verdict::Marginal);
        assert_eq!(verdict(f64::INFINITY, 1.0), Verdict::Unstable);
    }

    #[test]
    fn what_has_no_bound_is_not_marginal() {
        let verdict = |value, error| Radius { value, error }.verdict();
        for (value, error) in [(f64::INFINITY, f64::INFINITY), (f64::NAN, 0.0), (0.5, f64::NAN), (0.5, f64::INFINITY), (1e100, 1e103)] {
            assert_eq!(verdict(value, error), Verdict::Overflow, "{value} {error}");
        }
    }

    /// 2 to the power of 2000 is no number, and above 1 all the same; 0.5 within 0.9 may be 1.4, of which nothing follows.
    #[test]
    fn a_power_that_overflows_is_unstable_where_the_radius_is() {
        assert_eq!(Radius { value: 2.0, error: 0.5 }.over(2000).verdict(), Verdict::Unstable);
        assert_eq!(Radius { value: 0.5, error: 0.9 }.over(4_000_000).verdict(), Verdict::Overflow);
    }

    #[test]
    fn beside_an_unstable_system_one_that_overflowed_changes_nothing() {
        let unstable = Radius { value: 2.0, error: 0.5 };
        assert_eq!(unstable.or(Radius::UNKNOWN).verdict(), Verdict::Unstable);
        assert_eq!(Radius::UNKNOWN.or(unstable).or(unstable.over(2000)).verdict(), Verdict::Unstable);
        assert_eq!(Radius { value: 0.5, error: 0.0 }.or(Radius::UNKNOWN).verdict(), Verdict::Overflow);
    }

    #[test]
    fn side_by_side_the_interval_covers_both() {
        let both = Radius { value: 0.9, error: 0.01 }.or(Radius { value: 0.89, error: 0.05 });
        assert!((both.value - 0.9).abs() < 1e-15 && (both.error - 0.04).abs() < 1e-15);
    }
}
