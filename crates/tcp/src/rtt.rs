//! Estimator of the round trip, and the retransmission timeout that follows from the estimate (RFC 6298).

use core::time::Duration;

use cohaptic_units::Instant;

use crate::TcpConfig;

/// Age above which any new sample replaces the least round trip.
const LEAST_COUNTS: Duration = Duration::from_secs(300);

/// Estimator of RFC 6298 in whole nanoseconds. SRTT is kept times eight and RTTVAR times four, because the gains of 1/8 and 1/4 would otherwise round at each
/// sample.
#[derive(Clone, Debug)]
pub(crate) struct RoundTrips {
    /// Eight times SRTT \[ns\]. Zero before the first sample.
    srtt_8: u64,
    /// Four times RTTVAR \[ns\].
    var_4: u64,
    /// Least round trip, and the instant at which it was measured.
    least: Option<(Duration, Instant)>,
    /// Timeout without doublings \[ns\], kept because each segment sets a timer and few acknowledgements change the estimate.
    base: u64,
    /// Least part of the variation in the timeout \[ns\].
    least_variance: u64,
    /// Bounds of the timeout \[ns\].
    bounds: (u64, u64),
    /// Number of doublings of the timeout since the last sample.
    pub(crate) backoff: u32,
}

impl RoundTrips {
    /// Returns an estimator without samples, with the bounds of `config`.
    pub(crate) fn new(config: &TcpConfig) -> Self {
        let bounds = (nanos(config.least_timeout), nanos(config.greatest_timeout));
        let base = nanos(config.initial_timeout).clamp(bounds.0, bounds.1);
        Self { srtt_8: 0, var_4: 0, least: None, base, least_variance: nanos(config.least_variance), bounds, backoff: 0 }
    }

    /// Takes a measured round trip into the estimate, and ends the doubling of the timeout. A round trip of zero counts as 1 ns.
    pub(crate) fn sample(&mut self, now: Instant, round_trip: Duration) {
        let nanos = nanos(round_trip).max(1);
        if self.srtt_8 == 0 {
            // The first sample R gives SRTT = R and RTTVAR = R/2.
            (self.srtt_8, self.var_4) = (nanos * 8, nanos * 2);
        } else {
            // RTTVAR becomes 3/4·RTTVAR + 1/4·|SRTT − R| with SRTT before this sample. The difference is taken times eight, because SRTT has a fraction of
            // a nanosecond.
            let error_8 = (nanos * 8).abs_diff(self.srtt_8);
            self.var_4 = self.var_4 - self.var_4 / 4 + error_8 / 8;
            self.srtt_8 = self.srtt_8 - self.srtt_8 / 8 + nanos;
        }
        self.base = (self.srtt_8 / 8 + self.var_4.max(self.least_variance)).clamp(self.bounds.0, self.bounds.1);
        self.backoff = 0;
        let is_least = self.least.is_none_or(|(least, at)| round_trip <= least || now.saturating_duration_since(at) > LEAST_COUNTS);
        if is_least {
            self.least = Some((round_trip.max(Duration::from_nanos(1)), now));
        }
    }

    pub(crate) fn srtt(&self) -> Option<Duration> {
        self.srtt_nanos().map(Duration::from_nanos)
    }

    /// Returns SRTT \[ns\], or `None` before the first sample.
    pub(crate) fn srtt_nanos(&self) -> Option<u64> {
        (self.srtt_8 != 0).then_some(self.srtt_8 / 8)
    }

    pub(crate) fn variation(&self) -> Duration {
        Duration::from_nanos(self.var_4 / 4)
    }

    pub(crate) fn least(&self) -> Option<Duration> {
        self.least.map(|(least, _)| least)
    }

    /// Returns SRTT + 4·RTTVAR within the bounds of the configuration, without doubling \[ns\]. Before the first sample, returns the initial timeout.
    pub(crate) const fn base_timeout(&self) -> u64 {
        self.base
    }

    /// Returns the timeout with its doublings, at most the greatest timeout of the configuration \[ns\].
    pub(crate) fn timeout_nanos(&self) -> u64 {
        // At most 30 doublings, as in [`doubled`].
        self.base.saturating_mul(1 << self.backoff.min(30)).min(self.bounds.1)
    }

    /// Returns the timeout with its doublings, at most the greatest timeout of the configuration.
    pub(crate) fn timeout(&self) -> Duration {
        Duration::from_nanos(self.timeout_nanos())
    }
}

/// Returns `base` times 2 to the power of `times`, at most the greatest timeout of `config`.
pub(crate) fn doubled(base: Duration, times: u32, config: &TcpConfig) -> Duration {
    // At most 30 doublings, so that the factor fits into 32 bits.
    base.saturating_mul(1 << times.min(30)).min(config.greatest_timeout)
}

/// Returns the nanoseconds of `span`, at most 1/16 of the range, so that eight times the result does not overflow.
pub(crate) fn nanos(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX / 16).min(u64::MAX / 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_round_trips_by_hand() {
        let config = TcpConfig { least_variance: Duration::ZERO, ..TcpConfig::default() };
        let mut round_trips = RoundTrips::new(&config);
        let mut after = |milliseconds| {
            round_trips.sample(Instant::ZERO, Duration::from_millis(milliseconds));
            [round_trips.srtt().unwrap(), round_trips.variation(), round_trips.timeout()].map(|span| span.as_nanos())
        };
        assert_eq!(after(100), [100_000_000, 50_000_000, 300_000_000]);
        assert_eq!(after(200), [112_500_000, 62_500_000, 362_500_000]);
        assert_eq!(after(100), [110_937_500, 50_000_000, 310_937_500]);
    }

    #[test]
    fn the_variance_has_a_floor_and_doubling_an_end() {
        let mut round_trips = RoundTrips::new(&TcpConfig::default());
        assert_eq!(round_trips.timeout(), Duration::from_secs(1));
        round_trips.sample(Instant::ZERO, Duration::from_millis(10));
        assert_eq!(round_trips.timeout(), Duration::from_millis(210));
        round_trips.backoff = 40;
        assert_eq!(round_trips.timeout(), Duration::from_secs(120));
    }

    /// Also the timeout without doublings lies within the bounds, with and without samples.
    #[test]
    fn no_timeout_is_beyond_the_bounds() {
        let config = TcpConfig { least_timeout: Duration::from_millis(300), greatest_timeout: Duration::from_secs(2), ..TcpConfig::default() };
        for (span, timeout) in [(Duration::from_millis(1), config.least_timeout), (Duration::from_secs(3), config.greatest_timeout)] {
            let mut round_trips = RoundTrips::new(&TcpConfig { initial_timeout: span, ..config.clone() });
            assert_eq!((round_trips.base_timeout(), round_trips.timeout()), (nanos(timeout), timeout));
            round_trips.sample(Instant::ZERO, span);
            assert_eq!((round_trips.base_timeout(), round_trips.timeout()), (nanos(timeout), timeout));
        }
    }
}
