//! A peer's own clock: it may start late and run fast or slow.

use core::time::Duration;

use cohaptic_units::Instant;
use cohaptic_units::print::SixDigits;

/// How fast a clock runs: a signed number of parts per billion, positive for a fast clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Drift(i64);

/// Why a drift is refused.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error("a clock drift of {} is out of range: expected at most 0.1 either way, 10 %", SixDigits(*fraction))]
pub struct DriftError {
    /// The drift asked for.
    pub fraction: f64,
}

impl Drift {
    /// The drift of a clock that gains `fraction` seconds in a second, rounded to 10⁻⁹.
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

    /// Parts per billion.
    #[must_use]
    pub const fn parts_per_billion(self) -> i64 {
        self.0
    }
}

/// When a peer ticks.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Clock {
    /// The period of the control tick on the peer's own clock, Tc; above zero.
    pub tick: Duration,
    /// The instant of tick 0.
    pub offset: Duration,
    /// How fast the peer's clock runs.
    pub drift: Drift,
}

impl Clock {
    /// A clock without offset or drift.
    #[must_use]
    pub const fn regular(tick: Duration) -> Self {
        Self { tick, offset: Duration::ZERO, drift: Drift(0) }
    }

    /// The instant of tick `k`: offset + k·Tc/(1 + drift), rounded down to a nanosecond, without accumulating the rounding. `None` beyond the
    /// end of time.
    #[must_use]
    pub fn instant(&self, tick: u64) -> Option<Instant> {
        // 10⁹/(10⁹ + ppb) is at most 1/0.9: the product below needs at most 64 + 64 bits, or it is beyond the end of time anyway.
        let local = self.tick.as_nanos().checked_mul(u128::from(tick))?;
        let nanos = if self.drift.0 == 0 {
            local
        } else {
            local.checked_mul(1_000_000_000)? / u128::from(1_000_000_000_u64.saturating_add_signed(self.drift.0))
        };
        Instant::ZERO.checked_add(self.offset)?.checked_add(Duration::from_nanos(u64::try_from(nanos).ok()?))
    }

    /// What the peer's own clock shows at tick `k`: k·Tc, saturating.
    #[must_use]
    pub fn local_time(&self, tick: u64) -> Instant {
        let nanos = self.tick.as_nanos().saturating_mul(u128::from(tick));
        Instant::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
    }

    /// The shortest and the longest span between two ticks. They differ by at most a nanosecond.
    #[must_use]
    pub fn spans(&self) -> (Duration, Duration) {
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
        // A million ticks of a clock 20 ppm fast: 1000 s / 1.00002 = 999.980 000 399 992 s, rounded down.
        assert_eq!(clock.instant(1_000_000), Some(Instant::from_nanos(999_980_000_399 + 300_000)));
        let (short, long) = clock.spans();
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
