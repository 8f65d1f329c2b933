//! Load of a link. Under an easy load no packet waits, and the link's queue need not be simulated.

use core::time::Duration;

use cohaptic_units::Bytes;

use super::bottleneck::giga_bits;
use super::{Bottleneck, Discipline, Service, TokenBucket};

/// Packets of one size, offered to a link at distances of at least `gap`. The offering program promises both; debug assertions check the promise.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Load {
    /// Size of each packet.
    pub size: Bytes,
    /// Least time between two packets; zero if unknown.
    pub gap: Duration,
}

impl Load {
    /// Returns a load of packets of `size`, with possibly several offers at once.
    #[must_use]
    pub(crate) const fn of(size: Bytes) -> Self {
        Self { size, gap: Duration::ZERO }
    }
}

impl Bottleneck {
    /// Returns the transmission time of each packet of the load, if each packet leaves before the offer of the next packet. No packet then waits, and no
    /// discipline and no limit has any effect. Returns `None` if a packet may wait.
    pub(crate) fn time_without_wait(&self, load: Load) -> Option<Duration> {
        let Self { service: Service::Rate(rate), framing, limit: _, discipline } = self else { return None };
        // Without waiting packets the average of RED is zero, not below a threshold of zero: RED then may drop packets.
        if matches!(discipline, Discipline::Red(red) if red.min() == Bytes::ZERO) {
            return None;
        }
        let time = rate.transmission_time(giga_bits(framing.on_the_line(load.size)));
        // A departure makes room for a simultaneous offer, so an equal time suffices.
        (time <= load.gap).then_some(time)
    }
}

impl TokenBucket {
    /// Returns whether each packet of the load finds enough tokens: the bucket begins full, and a packet's tokens come back before the next packet.
    pub(crate) fn lets_all_pass(&self, load: Load) -> bool {
        let needed = giga_bits(self.framing.on_the_line(load.size));
        // Each packet's tokens come back within the gap, so every packet finds a full bucket.
        let buckets = [Some((self.rate, self.burst)), self.peak.map(|peak| (peak.rate, peak.burst))];
        buckets.into_iter().flatten().all(|(rate, burst)| needed <= giga_bits(burst) && needed <= rate.bits_sent(load.gap))
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_units::{Probability, Rate};

    use super::*;
    use crate::stages::queue::{CoDel, DualPi2, FqCoDel, Framing, Peak, Pie, QueueLimit, Red};

    /// Returns a load of 64 bytes, which take 512 µs at 1 Mbit/s.
    fn load(micros: u64) -> Load {
        Load { size: Bytes::new(64), gap: Duration::from_micros(micros) }
    }

    #[test]
    fn a_line_is_free_when_the_next_packet_comes_as_the_one_before_leaves() {
        let line = |discipline| Bottleneck {
            discipline,
            limit: Some(QueueLimit::Packets(0)),
            ..Bottleneck::at_rate(Rate::bits_per_sec(1_000_000).unwrap())
        };
        let red = |min| Discipline::Red(Red::new(Bytes::new(min), Bytes::new(1000), Probability::ONE, 0.1, Bytes::new(64), false).unwrap());
        for discipline in [
            Discipline::TailDrop,
            Discipline::HeadDrop,
            Discipline::CoDel(CoDel::default()),
            Discipline::FqCoDel(FqCoDel::default()),
            Discipline::Pie(Pie::default()),
            Discipline::DualPi2(DualPi2::default()),
            red(1),
        ] {
            assert_eq!(line(discipline).time_without_wait(load(512)), Some(Duration::from_micros(512)), "{discipline:?}");
            assert_eq!(line(discipline).time_without_wait(load(511)), None, "{discipline:?}");
        }
        assert_eq!(line(red(0)).time_without_wait(load(512)), None);
    }

    #[test]
    fn a_bucket_lets_pass_what_comes_back_in_time() {
        let rate = Rate::bits_per_sec(1_000_000).unwrap();
        let bucket = |burst, peak| TokenBucket { rate, burst: Bytes::new(burst), peak, framing: Framing::default(), limit: None };
        assert!(bucket(64, None).lets_all_pass(load(512)));
        assert!(!bucket(64, None).lets_all_pass(load(511)));
        assert!(!bucket(63, None).lets_all_pass(load(9_999)));
        let peak = |bits, burst| Some(Peak { rate: Rate::bits_per_sec(bits).unwrap(), burst: Bytes::new(burst) });
        assert!(bucket(128, peak(2_000_000, 64)).lets_all_pass(load(512)));
        assert!(!bucket(128, peak(999_999, 64)).lets_all_pass(load(512)));
        assert!(!bucket(128, peak(2_000_000, 63)).lets_all_pass(load(512)));
    }
}
