//! Conversions of virtual time to the monotonic clock and to the time of day.

use std::time::{Duration, Instant as StdInstant, SystemTime, UNIX_EPOCH};

use ::quinn::TimeSource;
use ::quinn::rustls::pki_types::UnixTime;
use ::quinn::rustls::time_provider::TimeProvider;
use cohaptic_units::Instant;

use crate::context;
use crate::origin::{DAY, base};

/// Converts virtual time to quinn's clock.
pub(super) fn to_std(at: Instant) -> StdInstant {
    base() + at.saturating_duration_since(Instant::ZERO)
}

/// Converts quinn's clock to virtual time.
pub(super) fn from_std(at: StdInstant) -> Instant {
    Instant::ZERO.saturating_add(at.saturating_duration_since(base()))
}

/// Time of day in a test bed, for tokens and certificates. Every run begins on the first of January 2027, at midnight UTC.
///
/// Outside the run, [`TimeProvider`] returns no time, and [`TimeSource`] returns that midnight.
#[derive(Clone, Copy, Debug)]
pub struct TestTime;

impl TestTime {
    fn since_1970() -> Option<Duration> {
        let now = context::shared()?.with(|core| core.now());
        Some(DAY + now.saturating_duration_since(Instant::ZERO))
    }
}

impl TimeProvider for TestTime {
    fn current_time(&self) -> Option<UnixTime> {
        Self::since_1970().map(UnixTime::since_unix_epoch)
    }
}

impl TimeSource for TestTime {
    fn now(&self) -> SystemTime {
        UNIX_EPOCH + Self::since_1970().unwrap_or(DAY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn virtual_time_comes_back_from_quinns_clock_to_the_nanosecond() {
        for nanos in [0, 1, 999_999_999, 12_345_678_901_234_567] {
            let at = Instant::from_nanos(nanos);
            assert_eq!(from_std(to_std(at)), at);
        }
    }
}
