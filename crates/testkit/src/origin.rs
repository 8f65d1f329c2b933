//! Readings of the clocks of the system that stand for the beginning of a run.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Time of day at the beginning of every run: the first of January 2027, 0:00 UTC, as time since the beginning of 1970.
pub(crate) const DAY: Duration = Duration::from_secs(1_798_761_600);

/// Returns the instant of the standard library that stands for the beginning of a run whose clock is that of the test kit.
///
/// An instant of the standard library can only be made from the clock. The choice has no visible effect: programs take differences of instants and compare
/// instants, and all instants of a run are sums of this instant and virtual time.
#[expect(clippy::disallowed_methods, reason = "there is no other way to an `Instant`; only differences to it are used")]
pub(crate) fn base() -> Instant {
    static BASE: OnceLock<Instant> = OnceLock::new();
    *BASE.get_or_init(|| {
        // A test bed with virtual clocks makes its readings of this instant, and must not be asked for the reading.
        #[cfg(feature = "facade")]
        let _outside = cohaptic_sockets::outside();
        Instant::now()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `date -u -d @1798761600`.
    #[test]
    fn the_day_is_the_first_of_2027() {
        // From 1970 to 2027 there are 57 years, 14 of them leap years: 1972 to 2024.
        assert_eq!(DAY.as_secs(), (57 * 365 + 14) * 86_400);
    }
}
