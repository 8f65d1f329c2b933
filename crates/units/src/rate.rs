//! Data rates.

use core::fmt;
use core::num::NonZeroU64;
use core::time::Duration;

use crate::Bytes;

/// A data rate \[bit/s\], never zero. An unlimited rate is `Option::<Rate>::None`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Rate(NonZeroU64);

impl Rate {
    /// Returns the rate of `bits` per second, or `None` for zero.
    #[must_use]
    pub const fn bits_per_sec(bits: u64) -> Option<Self> {
        match NonZeroU64::new(bits) {
            Some(bits) => Some(Self(bits)),
            None => None,
        }
    }

    /// Returns the rate \[bit/s\].
    #[must_use]
    pub const fn as_bits_per_sec(self) -> u64 {
        self.0.get()
    }

    /// Returns the time for sending `size` at this rate: 8·size/rate, rounded **up** to a nanosecond, so that no window of time carries more bits than the
    /// rate allows. Saturates at 584 years.
    #[must_use]
    pub fn serialisation_time(self, size: Bytes) -> Duration {
        self.transmission_time(u128::from(size.get()) * 8 * 1_000_000_000)
    }

    /// Returns the time for sending the rest of a packet, rounded up to a nanosecond. `giga_bits` is the rest \[bit\] times 10⁹, as returned by
    /// [`Rate::bits_sent`], so that a change of the rate in the middle of a packet rounds nothing. Saturates at 584 years.
    #[must_use]
    pub fn transmission_time(self, giga_bits: u128) -> Duration {
        // Rounded up: a packet that ends within a nanosecond occupies the whole nanosecond.
        let nanos = giga_bits.div_ceil(u128::from(self.0.get()));
        Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
    }

    /// Returns the amount sent in `span` in units of 10⁻⁹ bit, which makes the product of nanoseconds and bit/s exact. Saturates; a span of at most 584
    /// years never does.
    #[must_use]
    pub fn bits_sent(self, span: Duration) -> u128 {
        span.as_nanos().saturating_mul(u128::from(self.0.get()))
    }
}

impl fmt::Display for Rate {
    /// Writes the rate in the largest SI unit without a fraction: `10Mbit`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bits = self.0.get();
        let (value, unit) = [(1_000_000_000, "Gbit"), (1_000_000, "Mbit"), (1_000, "kbit")]
            .into_iter()
            // Only exact units: 1500 bit/s stays 1500bit, and does not become 1.5kbit.
            .find(|(scale, _)| bits.is_multiple_of(*scale))
            .map_or((bits, "bit"), |(scale, unit)| (bits / scale, unit));
        write!(f, "{value}{unit}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packet_that_does_not_divide_takes_the_nanosecond_it_began() {
        // 1 byte at 3 bit/s: 8/3 s = 2 666 666 666.67 ns.
        let rate = Rate::bits_per_sec(3).unwrap();
        assert_eq!(rate.serialisation_time(Bytes::new(1)), Duration::from_nanos(2_666_666_667));
    }

    #[test]
    fn the_largest_packet_at_the_lowest_rate_saturates() {
        let rate = Rate::bits_per_sec(1).unwrap();
        assert_eq!(rate.serialisation_time(Bytes::new(u64::MAX)), Duration::from_nanos(u64::MAX));
    }

    #[test]
    fn the_highest_rate_over_the_longest_span_saturates() {
        let rate = Rate::bits_per_sec(u64::MAX).unwrap();
        assert_eq!(rate.bits_sent(Duration::from_nanos(u64::MAX)), u128::from(u64::MAX) * u128::from(u64::MAX));
        assert_eq!(rate.bits_sent(Duration::MAX), u128::MAX);
    }

    #[test]
    fn prints_the_largest_exact_unit() {
        let print = |bits| alloc::format!("{}", Rate::bits_per_sec(bits).unwrap());
        assert_eq!([print(10_000_000), print(1_500), print(64_000)], ["10Mbit", "1500bit", "64kbit"]);
    }
}
