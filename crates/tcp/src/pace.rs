//! Rate at which Linux would pace a sender. This crate paces nothing; the rate only sets the length of bursts, and a margin of `HyStart`.

use core::time::Duration;

/// Most octets of a burst: 64 KiB less the room that Linux keeps for headers (`sk_gso_max_size`).
pub(crate) const LONGEST_BURST: u64 = 65_536 - 257;

/// Largest margin for a burst.
const MOST_MARGIN: Duration = Duration::from_millis(1);

/// Rate of a sender as a fraction. Each acknowledgement brings a new rate, and few acknowledgements need the quotient.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// Octets of a flight, times a percentage.
    scaled_flight: u64,
    /// Time of a flight \[ns\]. Zero stands for a rate without bound.
    srtt: u64,
}

impl Pace {
    /// Rate before the first round trip: without bound.
    pub(crate) const UNBOUNDED: Self = Self { scaled_flight: 0, srtt: 0 };

    /// Returns `percent` percent of the rate of `flight` octets in `srtt` nanoseconds.
    pub(crate) const fn new(flight: u64, percent: u64, srtt: u64) -> Self {
        Self { scaled_flight: flight.saturating_mul(percent), srtt: if srtt == 0 { 1 } else { srtt } }
    }

    /// Returns the rate \[byte/s\].
    pub(crate) fn rate(self) -> u64 {
        if self.srtt == 0 {
            return u64::MAX;
        }
        // A second has 10⁹ ns, and a percentage is a hundredth. The product fits into 64 bits for flights of up to 9 gigabytes.
        self.scaled_flight.checked_mul(10_000_000).map_or_else(
            || u64::try_from(u128::from(self.scaled_flight) * 10_000_000 / u128::from(self.srtt)).unwrap_or(u64::MAX),
            |product| product / self.srtt,
        )
    }

    /// Returns the time by which acknowledgements of one burst may be apart: four of the longest bursts, at most a millisecond.
    pub(crate) fn margin(self) -> Duration {
        Duration::from_nanos((4 * LONGEST_BURST).saturating_mul(1_000_000_000) / self.rate().max(1)).min(MOST_MARGIN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_a_flight_in_a_round_trip() {
        // 14,480 octets in 2 ms are 7.24 MB/s.
        assert_eq!([100, 200].map(|percent| Pace::new(14_480, percent, 2_000_000).rate()), [7_240_000, 14_480_000]);
        assert_eq!((Pace::UNBOUNDED.rate(), Pace::UNBOUNDED.margin()), (u64::MAX, Duration::ZERO));
        // 1 TB in 1 s: the product has more than 64 bits.
        assert_eq!(Pace::new(1_000_000_000_000, 120, 1_000_000_000).rate(), 1_200_000_000_000);
        assert_eq!((Pace::new(1 << 40, 200, 0).rate(), Pace::new(0, 200, 5).rate()), (u64::MAX, 0));
        // 261,116 octets at 1 GB/s, and at 100 MB/s more than a millisecond.
        assert_eq!([1_000_000, 100_000].map(|flight| Pace::new(flight, 100, 1_000_000).margin().as_nanos()), [261_116, 1_000_000]);
    }
}
