//! Points in simulated time.

use core::fmt;
use core::ops::{Add, AddAssign, Sub};
use core::time::Duration;

/// A point in time, counted in nanoseconds since the scene began.
///
/// The count is a `u64`, enough for 584 years. A span between two instants is a [`core::time::Duration`] and never negative.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Instant(u64);

impl Instant {
    /// Beginning of the scene.
    pub const ZERO: Self = Self(0);
    /// Last instant with a count, 584.5 years after the beginning.
    pub const MAX: Self = Self(u64::MAX);

    /// Returns the instant `nanos` nanoseconds after the beginning.
    #[must_use]
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// Returns the time since the beginning \[ns\], exactly.
    #[must_use]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// Returns the time since the beginning \[s\], rounded to the nearest `f64`.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a reading for people and for sampling hand forces: rounded to the nearest f64 on purpose")]
    pub const fn as_secs_f64(self) -> f64 {
        // A single division, correctly rounded for counts below 2^53 ns (104 days). A multiplication by 1e-9 would round twice, and 1 ms would not read as
        // 0.001.
        self.0 as f64 / 1e9
    }

    /// Returns the instant `span` later, or `None` beyond [`Instant::MAX`].
    #[must_use]
    #[inline]
    pub fn checked_add(self, span: Duration) -> Option<Self> {
        // A span may be longer than 584 years, and no instant is so late.
        let nanos = u64::try_from(span.as_nanos()).ok()?;
        self.0.checked_add(nanos).map(Self)
    }

    /// Returns the instant `span` later, or [`Instant::MAX`] if the sum is beyond [`Instant::MAX`].
    #[must_use]
    #[inline]
    pub fn saturating_add(self, span: Duration) -> Self {
        self.checked_add(span).unwrap_or(Self::MAX)
    }

    /// Returns the instant `nanos` nanoseconds later, or [`Instant::MAX`] if the sum is beyond [`Instant::MAX`].
    #[must_use]
    #[inline]
    pub const fn saturating_add_nanos(self, nanos: u64) -> Self {
        Self(self.0.saturating_add(nanos))
    }

    /// Returns the span since `earlier`, or `None` if `earlier` is later than `self`.
    #[must_use]
    #[inline]
    pub const fn checked_duration_since(self, earlier: Self) -> Option<Duration> {
        match self.0.checked_sub(earlier.0) {
            Some(nanos) => Some(Duration::from_nanos(nanos)),
            None => None,
        }
    }

    /// Returns the span since `earlier`, or zero if `earlier` is later than `self`.
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
    /// If the sum is beyond [`Instant::MAX`], 584 years after the beginning.
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
    /// If `earlier` is later than `self`, because no negative span exists.
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
