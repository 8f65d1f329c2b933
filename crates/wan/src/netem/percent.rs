//! A percentage, as written and as rounded by `tc`.

use core::fmt;

use cohaptic_units::Probability;

/// A percentage from 0 to 100.
///
/// The number is kept as written, because `tc` divides by a hundred in binary: not every fraction can be written as a percentage.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default)]
pub struct Percent(f64);

/// Probability 1 in the 32 bits of the kernel.
const ALL: f64 = 4_294_967_295.0;

impl Percent {
    /// 0 %.
    pub const ZERO: Self = Self(0.0);

    /// Makes a percentage. Returns `None` unless `percent` lies in 0..=100.
    #[must_use]
    pub fn new(percent: f64) -> Option<Self> {
        // The sum turns −0 into 0, so equal values print equally.
        (0.0..=100.0).contains(&percent).then_some(Self(percent + 0.0))
    }

    /// Returns the percentage, from 0 to 100.
    #[must_use]
    pub const fn get(self) -> f64 {
        self.0
    }

    /// Returns the fraction, from 0 to 1.
    #[must_use]
    pub const fn fraction(self) -> f64 {
        self.0 / 100.0
    }

    /// Returns the fraction as a probability.
    #[must_use]
    pub(crate) fn probability(self) -> Probability {
        Probability::new(self.fraction()).unwrap_or(Probability::ONE)
    }

    /// Returns the number from `tc` to the kernel for p: rint(p·(2³² − 1)), ties to even.
    #[must_use]
    pub(crate) fn as_u32(self) -> u32 {
        scaled(self.fraction())
    }

    /// Returns the number from `tc` to the kernel for 1 − p, for a complement as the default of another probability: rint((1 − p)·(2³² − 1)).
    #[must_use]
    pub(crate) fn complement_as_u32(self) -> u32 {
        scaled(1.0 - self.fraction())
    }
}

fn scaled(fraction: f64) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the fraction is between 0 and 1")]
    let value = libm::rint(fraction * ALL) as u32;
    value
}

impl fmt::Display for Percent {
    /// Prints the percentage as `tc` reads it: `0.3%`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}%", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentage_is_rounded_as_tc_rounds_it() {
        // Recorded from tc of iproute2 6.1. The product 0.1·(2³² − 1) ends in one half and is rounded to the even neighbour.
        let recorded = [(10.0, 0x1999_999a), (5.0, 0x0ccc_cccd), (1.0, 0x028f_5c29), (1e-7, 4), (0.1, 0x0041_8937), (100.0, u32::MAX), (0.0, 0)];
        for (percent, kernel) in recorded {
            assert_eq!(Percent::new(percent).unwrap().as_u32(), kernel, "{percent} %");
        }
    }

    #[test]
    fn what_is_no_percentage_is_refused() {
        for value in [-0.1, 100.000_001, f64::NAN, f64::INFINITY] {
            assert_eq!(Percent::new(value), None);
        }
        assert!(Percent::new(-0.0).unwrap().get().is_sign_positive());
    }
}
