//! A point in simulated time.

use core::fmt;
use core::ops::{Add, AddAssign, Sub};
use core::time::Duration;

/// A point in time, counted in nanoseconds since the scene began.
///
/// The count is a `u64`: a scene may last 584 years. Spans are [`core::time::Duration`]; a negative span does not exist.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Instant(u64);

impl Instant {
    /// The beginning of the scene.
    pub const ZERO: Self = Self(0);
    /// The last instant that can be counted, 584.5 years after the beginning.
    pub const MAX: Self = Self(u64::MAX);

    /// The instant a number of nanoseconds after the beginning.
    #[must_use]
    #[inline]
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the beginning.
    #[must_use]
    #[inline]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// Seconds since the beginning, rounded to the nearest `f64` \[s\].
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a reading for people and for sampling hand forces: rounded to the nearest f64 on purpose")]
    pub const fn as_secs_f64(self) -> f64 {
        // One division, correctly rounded for counts below 2^53 ns (104 days), so that 0.001 s reads as the double nearest to 0.001.
        self.0 as f64 / 1e9
    }

    /// The instant `span` later, or `None` beyond [`Instant::MAX`].
    #[must_use]
    #[inline]
    pub fn checked_add(self, span: Duration) -> Option<Self> {
        let nanos = u64::try_from(span.as_nanos()).ok()?;
        self.0.checked_add(nanos).map(Self)
    }

    /// The instant `span` later, or [`Instant::MAX`] if that cannot be counted.
    #[must_use]
    #[inline]
    pub fn saturating_add(self, span: Duration) -> Self {
        self.checked_add(span).unwrap_or(Self::MAX)
    }

    /// The instant a number of nanoseconds later, or [`Instant::MAX`] if that cannot be counted.
    #[must_use]
    #[inline]
    pub const fn saturating_add_nanos(self, nanos: u64) -> Self {
        Self(self.0.saturating_add(nanos))
    }

    /// The span since `earlier`, or `None` if `earlier` is later than `self`.
    #[must_use]
    #[inline]
    pub const fn checked_duration_since(self, earlier: Self) -> Option<Duration> {
        match self.0.checked_sub(earlier.0) {
            Some(nanos) => Some(Duration::from_nanos(nanos)),
            None => None,
        }
    }

    /// The span since `earlier`, zero if `earlier` is later than `self`.
    #[must_use]
    #[inline]
    pub const fn saturating_duration_since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }
}

impl Add<Duration> for Instant {
    type Output = Self;

    /// # Panics
    ///
    /// Beyond [`Instant::MAX`], 584 years after the beginning.
    #[inline]
    fn add(self, span: Duration) -> Self {
        self.checked_add(span).expect("an instant is within 584 years of the beginning")
    }
}

impl AddAssign<Duration> for Instant {
    fn add_assign(&mut self, span: Duration) {
        *self = *self + span;
    }
}

impl Sub for Instant {
    type Output = Duration;

    /// # Panics
    ///
    /// If `earlier` is later than `self`: negative spans do not exist.
    #[inline]
    fn sub(self, earlier: Self) -> Duration {
        self.checked_duration_since(earlier).expect("the subtrahend is not later than the minuend")
    }
}

impl fmt::Debug for Instant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Display for Instant {
    /// Exact, in seconds without trailing zeros: `0.024s`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        crate::print::Seconds(*self).fmt(f)?;
        f.write_str("s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_read_as_the_nearest_double() {
        assert_eq!(Instant::from_nanos(1_000_000).as_secs_f64().to_bits(), 0.001_f64.to_bits());
        assert_eq!(Instant::from_nanos(24_000_000).as_secs_f64().to_bits(), 0.024_f64.to_bits());
    }

    #[test]
    fn the_edge_of_time_is_an_answer_not_a_wrap() {
        assert_eq!(Instant::MAX.checked_add(Duration::from_nanos(1)), None);
        assert_eq!(Instant::ZERO.checked_add(Duration::from_nanos(u64::MAX)), Some(Instant::MAX));
        assert_eq!(Instant::ZERO.checked_add(Duration::MAX), None);
        assert_eq!(Instant::ZERO.checked_duration_since(Instant::from_nanos(1)), None);
        assert_eq!(Instant::MAX.saturating_add(Duration::from_secs(1)), Instant::MAX);
    }
}
