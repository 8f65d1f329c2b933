//! Clock of a peer, with offset and drift.

use core::time::Duration;

use cohaptic_units::Instant;
use cohaptic_units::print::SixDigits;

/// Drift of a clock: a signed number of parts per billion, positive for a fast clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Drift(i64);

/// Error of a drift out of range.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error("a clock drift of {} is out of range: expected at most 0.1 either way, 10 %", SixDigits(*fraction))]
pub struct DriftError {
    /// Drift asked for, in seconds per second.
    pub fraction: f64,
}

impl Drift {
    /// Returns the drift of a clock that gains `fraction` seconds per second, rounded to 10⁻⁹.
    ///
    /// # Errors
    ///
    /// [`DriftError`] beyond ±0.1 or for a NaN.
    pub fn from_fraction(fraction: f64) -> Result<Self, DriftError> {
        if fraction.abs() <= 0.1 {
            #[expect(clippy::cast_possible_truncation, reason = "at most 10^8 in size")]
            Ok(Self(libm::round(fraction * 1e9) as i64))
        } else {
            Err(DriftError { fraction })
        }
    }

    /// Returns the drift in parts per billion.
    #[must_use]
    pub const fn parts_per_billion(self) -> i64 {
        self.0
    }
}

/// Ticks of a peer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Clock {
    /// Period Tc of the tick on the peer's own clock, above zero.
    pub tick: Duration,
    /// Instant of tick 0.
    pub offset: Duration,
    /// Drift of the peer's clock.
    pub drift: Drift,
}

impl Clock {
    /// Returns a clock without offset and drift.
    #[must_use]
    pub const fn regular(tick: Duration) -> Self {
        Self { tick, offset: Duration::ZERO, drift: Drift(0) }
    }

    /// Returns the instant of tick `tick` = k: offset + k·Tc/(1 + drift), rounded down to a nanosecond. The rounding does not accumulate. `None` if the
    /// instant cannot be represented.
    #[must_use]
    pub fn instant(&self, tick: u64) -> Option<Instant> {
        // 10⁹/(10⁹ + ppb) is at most 1/0.9: the product below needs at most 64 + 64 bits, or it is beyond the end of time anyway.
        let local = self.tick.as_nanos().checked_mul(u128::from(tick))?;
        let nanos = if self.drift.0 == 0 {
            local
        } else {
            local.checked_mul(1_000_000_000)? / u128::from(1_000_000_000_u64.saturating_add_signed(self.drift.0))
        };
        // Every step is checked: beyond the last representable instant there is no tick.
        Instant::ZERO.checked_add(self.offset)?.checked_add(Duration::from_nanos(u64::try_from(nanos).ok()?))
    }

    /// Returns the time on the peer's own clock at tick `tick` = k: k·Tc, saturating.
    #[must_use]
    pub fn local_time(&self, tick: u64) -> Instant {
        let nanos = self.tick.as_nanos().saturating_mul(u128::from(tick));
        Instant::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
    }

    /// Returns the shortest and the longest span between two ticks. The spans differ by at most a nanosecond.
    #[must_use]
    pub fn spans(&self) -> (Duration, Duration) {
        // Instants are rounded down, so each span is one of the two neighbouring whole numbers of nanoseconds.
        let scaled = self.tick.as_nanos() * 1_000_000_000;
        let speed = u128::from(1_000_000_000_u64.saturating_add_signed(self.drift.0));
        let nanos = |value: u128| Duration::from_nanos(u64::try_from(value).unwrap_or(u64::MAX));
        (nanos(scaled / speed), nanos(scaled.div_ceil(speed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: Duration = Duration::from_millis(1);

    #[test]
    fn a_regular_clock_ticks_on_the_millisecond() {
        assert_eq!(Clock::regular(TICK).instant(7), Some(Instant::from_nanos(7_000_000)));
    }

    #[test]
    fn a_fast_clock_ticks_early_without_accumulating_the_rounding() {
        let clock = Clock { tick: TICK, offset: Duration::from_micros(300), drift: Drift::from_fraction(20e-6).unwrap() };
        // A million ticks of a clock 20 ppm fast last 1000 s / 1.00002 = 999.980 000 399 992 s, rounded down.
        assert_eq!(clock.instant(1_000_000), Some(Instant::from_nanos(999_980_000_399 + 300_000)));
        let (short, long) = clock.spans();
        // Rounding down makes some spans one nanosecond longer than others, and no span any other length.
        for k in 0..10_000 {
            let span = clock.instant(k + 1).unwrap() - clock.instant(k).unwrap();
            assert!(span == short || span == long, "tick {k} lasts {span:?}");
        }
    }

    #[test]
    fn the_end_of_time_is_none() {
        assert_eq!(Clock::regular(TICK).instant(u64::MAX), None);
        assert_eq!(Clock::regular(TICK).local_time(u64::MAX), Instant::MAX);
    }

    #[test]
    fn a_clock_ten_percent_off_is_the_limit() {
        assert!(Drift::from_fraction(0.1).is_ok());
        assert!(Drift::from_fraction(-0.11).is_err());
        assert!(Drift::from_fraction(f64::NAN).is_err());
    }
}
