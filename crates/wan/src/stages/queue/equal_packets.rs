//! Queue of packets of one size with drops of the newest packet, without keeping packets: the departure of each packet, and whether there is room for the
//! packet.
//!
//! A packet leaves at D(n) = max(a(n), D(n−1)) + S, with a the instant of its offer and S its transmission time (Lindley 1952). Packets of one size leave at
//! distances of S as long as the transmitter is busy, so the latest departure tells the number of waiting packets.

use core::time::Duration;

use cohaptic_units::{Bytes, Instant, Rate};

use super::bottleneck::giga_bits;
use super::{Bottleneck, Discipline, QueueLimit, Service};

/// Queue and transmitter for packets of one size \[ns\].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct EqualPackets {
    /// Transmission time of a packet \[ns\].
    service: u64,
    /// Largest amount of work \[ns\] before an admitted packet. A packet behind more work is dropped.
    most: u64,
}

impl EqualPackets {
    /// Returns the queue for packets of `size`, or `None` if departures depend on more than the latest departure.
    pub(crate) fn new(bottleneck: &Bottleneck, size: Bytes) -> Option<Self> {
        let Bottleneck { service: Service::Rate(rate), framing, limit, discipline: Discipline::TailDrop } = bottleneck else { return None };
        let line = Line { rate: *rate, bits: giga_bits(framing.on_the_line(size)) };
        let service = line.service();
        let most = match *limit {
            None => return Some(Self { service, most: u64::MAX }),
            // With n packets inside, the remaining work is more than (n − 1)·S and at most n·S. Another packet is admitted if n − 1 < limit.
            Some(QueueLimit::Packets(packets)) => service.saturating_mul(packets),
            // Another packet is admitted if the n − 1 waiting packets and the packet itself fit.
            Some(QueueLimit::Bytes(bytes)) => bytes.get().checked_div(size.get()).map_or(u64::MAX, |packets| service.saturating_mul(packets)),
            Some(QueueLimit::Time(wait)) => line.most_work(wait),
        };
        // Departures beyond the end of time all saturate at the end, and no longer tell the number of waiting packets.
        (service == 0 || most < END).then_some(Self { service, most })
    }

    /// Returns the departure of a packet offered `now`, or `None` if there is no room for the packet. `departure` is the departure of the previous packet, and
    /// becomes the departure of this packet.
    #[inline(always)]
    pub(crate) fn offer(&self, now: Instant, departure: &mut Instant) -> Option<Instant> {
        // Remaining work of the transmitter: zero if the latest packet has left.
        let work = departure.as_nanos().saturating_sub(now.as_nanos());
        if work > self.most {
            return None;
        }
        *departure = now.max(*departure).saturating_add_nanos(self.service);
        Some(*departure)
    }
}

/// Half of the range of an instant \[ns\].
const END: u64 = u64::MAX / 2;

/// Rate of a transmitter, and the bits of a packet in transmission, in 10⁻⁹ bit.
#[derive(Clone, Copy)]
struct Line {
    rate: Rate,
    bits: u128,
}

impl Line {
    /// Returns the transmission time of a packet \[ns\].
    fn service(self) -> u64 {
        nanos(self.rate.transmission_time(self.bits))
    }

    /// Returns the most work \[ns\] that may lie before a packet with its turn within `wait`. More work never makes a turn earlier, so bisection finds the
    /// bound.
    fn most_work(self, wait: Duration) -> u64 {
        let (mut holds, mut fails) = (0, self.service().max(1));
        // Doubles the bracket until `fails` is too much work; `holds` never is.
        while self.turn(fails) <= wait {
            (holds, fails) = (fails, fails.saturating_mul(2));
            if fails >= END {
                return END;
            }
        }
        while fails - holds > 1 {
            let middle = holds.midpoint(fails);
            if self.turn(middle) <= wait { holds = middle } else { fails = middle }
        }
        holds
    }

    /// Returns the wait of a packet behind `work` \[ns\]. `work` is a sum of times, each rounded up to nanoseconds. The wait is computed from the sum of the
    /// bits and rounded once, like the wait of the stage with packets.
    fn turn(self, work: u64) -> Duration {
        let service = self.service();
        // A packet without transmission time leaves no work, so no packet waits.
        if service == 0 || work == 0 {
            return Duration::ZERO;
        }
        // `inside` packets wait. The packet in transmission has been sent for `since`, and `first` of its bits remain.
        let inside = work.div_ceil(service) - 1;
        let since = (inside + 1) * service - work;
        let first = self.bits.saturating_sub(self.rate.bits_sent(Duration::from_nanos(since)));
        self.rate.transmission_time(first + u128::from(inside) * self.bits)
    }
}

/// Returns a span in nanoseconds, or the largest number if the span is longer.
pub(crate) fn nanos(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use alloc::collections::VecDeque;
    use alloc::vec::Vec;

    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;
    use crate::packet::{Exit, Marks, Packet, PacketInfo};
    use crate::stages::queue::limit::strategies::limits;
    use crate::stages::queue::{BottleneckStage, Framing};

    /// Returns the departure of each packet by the stage that keeps packets, or `None` for a dropped packet.
    fn by_stage(bottleneck: &Bottleneck, size: Bytes, offered: &[Instant]) -> Vec<Option<Instant>> {
        let mut stage = BottleneckStage::new(bottleneck.clone());
        let mut fates = alloc::vec![None; offered.len()];
        let (mut released, mut outputs) = (VecDeque::new(), Vec::new());
        let mut pass = |stage: &mut BottleneckStage<usize>, until: Instant, fates: &mut Vec<Option<Instant>>| {
            while let Some(at) = stage.next_at(None).filter(|at| *at <= until) {
                stage.release(at, None, &mut released, &mut outputs);
                released.drain(..).for_each(|packet| fates[packet.item] = Some(at));
            }
        };
        for (place, now) in offered.iter().enumerate() {
            pass(&mut stage, *now, &mut fates);
            let mut outputs = Vec::new();
            stage.offer(*now, Packet::new(place as u64, PacketInfo::from(size), Marks::default(), place), || 0, None, &mut outputs);
            assert!(outputs.iter().all(|output| matches!(output.exit, Exit::Dropped(..)) && output.packet.item == place));
        }
        pass(&mut stage, Instant::MAX, &mut fates);
        fates
    }

    /// With a limit of zero time and packets without bits the transmitter is free at once, and no packet is dropped.
    #[test]
    fn packets_of_no_bits_never_wait() {
        let rate = Rate::bits_per_sec(8_000_000).unwrap();
        let limit = Some(QueueLimit::Time(Duration::ZERO));
        let bottleneck = Bottleneck { service: Service::Rate(rate), framing: Framing::default(), limit, discipline: Discipline::TailDrop };
        let queue = EqualPackets::new(&bottleneck, Bytes::new(0)).unwrap();
        let mut departure = Instant::ZERO;
        let offered = [Instant::ZERO; 3];
        let fates: Vec<Option<Instant>> = offered.iter().map(|now| queue.offer(*now, &mut departure)).collect();
        assert_eq!(fates, [Some(Instant::ZERO); 3]);
        assert_eq!(fates, by_stage(&bottleneck, Bytes::new(0), &offered));
    }

    properties! {
        /// Departures and drops equal those of the stage that keeps packets. Gaps range from zero to longer than the queue, and rates include times on the
        /// line that are rounded and times that are not.
        #[test]
        fn departures_and_drops_are_those_of_the_queue(
            limit in limits(3_000_000),
            rate in prop_oneof![Just(8_000_000_u64), 1_000_u64..20_000_000, 1_000_000_000_u64..4_000_000_000],
            size in 0_u64..300,
            gaps in prop::collection::vec(prop_oneof![Just(0_u64), 0_u64..200_000, 0_u64..3_000_000], 1..60),
        ) {
            let rate = Rate::bits_per_sec(rate).unwrap();
            let bottleneck = Bottleneck { service: Service::Rate(rate), framing: Framing::default(), limit, discipline: Discipline::TailDrop };
            let offered: Vec<Instant> =
                gaps.iter().scan(0, |at, gap| { *at += gap; Some(Instant::from_nanos(*at)) }).collect();
            let queue = EqualPackets::new(&bottleneck, Bytes::new(size)).expect("nothing is near the end of time");
            let mut departure = Instant::ZERO;
            let fates: Vec<Option<Instant>> = offered.iter().map(|now| queue.offer(*now, &mut departure)).collect();
            prop_assert_eq!(fates, by_stage(&bottleneck, Bytes::new(size), &offered));
        }
    }
}
