//! Probabilities.

use core::fmt;

/// A probability from 0 to 1, both included.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default)]
pub struct Probability(f64);

/// Error for a number outside 0 to 1.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProbabilityError {
    /// Number as given.
    pub value: f64,
}

impl fmt::Display for ProbabilityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { value } = self;
        write!(f, "{value} is not a probability: expected a number from 0 to 1")
    }
}

impl core::error::Error for ProbabilityError {}

impl Probability {
    /// Probability of an event that never happens.
    pub const ZERO: Self = Self(0.0);
    /// Probability of an event that always happens.
    pub const ONE: Self = Self(1.0);

    /// Returns the probability `value`.
    ///
    /// # Errors
    ///
    /// [`ProbabilityError`] for a number outside 0 to 1, a NaN or an infinity.
    pub fn new(value: f64) -> Result<Self, ProbabilityError> {
        if (0.0..=1.0).contains(&value) { Ok(Self(value)) } else { Err(ProbabilityError { value }) }
    }

    /// Returns the number, from 0 to 1.
    #[must_use]
    pub const fn get(self) -> f64 {
        self.0
    }

    /// Returns whether an event of this probability happens, given 64 uniform random bits.
    ///
    /// For 0 the result is always `false`, for 1 always `true`. Otherwise the top 53 bits decide, and the chance differs from the probability by at most 2⁻⁵³.
    #[must_use]
    #[inline]
    #[expect(clippy::cast_precision_loss, reason = "the top 53 bits of a u64 are exact in an f64")]
    pub fn happens(self, bits: u64) -> bool {
        const TWO_POW_53: f64 = 9_007_199_254_740_992.0;
        // The left side is an integer from 0 to 2^53 - 1, exact as an f64. So 1.0 exceeds all values, and 0.0 none.
        ((bits >> 11) as f64) < self.0 * TWO_POW_53
    }
}

impl fmt::Display for Probability {
    /// Writes the probability in percent: `1.5%`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}%", self.0 * 100.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_never_happens_and_one_always_does() {
        for bits in [0, 1, u64::MAX / 2, u64::MAX] {
            assert!(!Probability::ZERO.happens(bits));
            assert!(Probability::ONE.happens(bits));
        }
    }

    #[test]
    fn a_quarter_is_the_lower_quarter_of_the_bits() {
        let quarter = Probability::new(0.25).unwrap();
        assert!(quarter.happens((1 << 62) - 1));
        assert!(!quarter.happens(1 << 62));
    }

    #[test]
    fn what_is_no_number_is_no_probability() {
        for value in [f64::NAN, f64::INFINITY, -0.1, 1.000_1] {
            assert!(Probability::new(value).is_err());
        }
    }
}
