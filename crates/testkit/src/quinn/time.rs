//! Conversions of virtual time to the monotonic clock and to the time of day.

use std::sync::OnceLock;
use std::time::{Duration, Instant as StdInstant, SystemTime, UNIX_EPOCH};

use ::quinn::TimeSource;
use ::quinn::rustls::pki_types::UnixTime;
use ::quinn::rustls::time_provider::TimeProvider;
use cohaptic_units::Instant;

use crate::context;

/// Time of day at the beginning of every run: the first of January 2027, 0:00 UTC \[s since 1970\].
const DAY: u64 = 1_798_761_600;

/// Returns the instant that stands for [`Instant::ZERO`] on quinn's clock.
///
/// An instant of the standard library can only be made from the clock. The choice has no visible effect: quinn takes differences of instants and compares
/// instants, and all instants of quinn are sums of this instant and virtual time.
#[expect(clippy::disallowed_methods, reason = "there is no other way to an `Instant`; only differences to it are used")]
fn base() -> StdInstant {
    static BASE: OnceLock<StdInstant> = OnceLock::new();
    *BASE.get_or_init(StdInstant::now)
}

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
        Some(Duration::from_secs(DAY) + now.saturating_duration_since(Instant::ZERO))
    }
}

impl TimeProvider for TestTime {
    fn current_time(&self) -> Option<UnixTime> {
        Self::since_1970().map(UnixTime::since_unix_epoch)
    }
}

impl TimeSource for TestTime {
    fn now(&self) -> SystemTime {
        UNIX_EPOCH + Self::since_1970().unwrap_or(Duration::from_secs(DAY))
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

    /// `date -u -d @1798761600`.
    #[test]
    fn the_day_is_the_first_of_2027() {
        // From 1970 to 2027 there are 57 years, 14 of them leap years: 1972 to 2024.
        assert_eq!(DAY, (57 * 365 + 14) * 86_400);
    }
}
