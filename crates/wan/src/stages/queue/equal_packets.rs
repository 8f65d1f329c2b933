//! A queue of packets of one size that drops the newest, as numbers: when each packet leaves, and whether there is room for it.
//!
//! A packet leaves at D(n) = max(a(n), D(n−1)) + S, where a is when it is offered and S its time on the line (Lindley 1952). Packets of one size leave S
//! after each other as long as the line is busy, so the latest departure says how many wait: no packet needs to be kept.

use core::time::Duration;

use cohaptic_units::{Bytes, Instant, Rate};

use super::bottleneck::giga_bits;
use super::{Bottleneck, Discipline, QueueLimit, Service};

/// The queue and the line of packets of one size \[ns\].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct EqualPackets {
    /// The time of a packet on the line.
    service: u64,
    /// A packet that finds more than this to be sent is dropped.
    most: u64,
}

impl EqualPackets {
    /// The queue for packets of that size; `None` if departures depend on more than the latest one.
    pub(crate) fn new(bottleneck: &Bottleneck, size: Bytes) -> Option<Self> {
        let Bottleneck { service: Service::Rate(rate), framing, limit, discipline: Discipline::TailDrop } = bottleneck else { return None };
        let line = Line { rate: *rate, bits: giga_bits(framing.on_the_line(size)) };
        let service = line.service();
        let most = match *limit {
            None => return Some(Self { service, most: u64::MAX }),
            // n packets inside are more than (n − 1)·S of work and at most n·S. Another is admitted if n − 1 < limit.
            Some(QueueLimit::Packets(packets)) => service.saturating_mul(packets),
            // It is admitted if the n − 1 that wait and itself fit.
            Some(QueueLimit::Bytes(bytes)) => bytes.get().checked_div(size.get()).map_or(u64::MAX, |packets| service.saturating_mul(packets)),
            Some(QueueLimit::Time(wait)) => line.most_work(wait),
        };
        // Departures beyond the end of time are all at the end, and say nothing about how many wait.
        (service == 0 || most < END).then_some(Self { service, most })
    }

    /// When a packet leaves that is offered `now`, if there is room for it. `departure` is that of the packet before, then its own.
    #[inline(always)]
    pub(crate) fn offer(&self, now: Instant, departure: &mut Instant) -> Option<Instant> {
        let work = departure.as_nanos().saturating_sub(now.as_nanos());
        if work > self.most {
            return None;
        }
        *departure = now.max(*departure).saturating_add_nanos(self.service);
        Some(*departure)
    }
}

/// Half of the time that an instant counts \[ns\].
const END: u64 = u64::MAX / 2;

/// A rate, and what a packet takes of it in 10⁻⁹ bit.
#[derive(Clone, Copy)]
struct Line {
    rate: Rate,
    bits: u128,
}

impl Line {
    /// The time of a packet on the line \[ns\].
    fn service(self) -> u64 {
        nanos(self.rate.transmission_time(self.bits))
    }

    /// The most work \[ns\] that a packet may find whose turn is to come within `wait`: that turn is later the more work there is.
    fn most_work(self, wait: Duration) -> u64 {
        let (mut holds, mut fails) = (0, self.service().max(1));
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

    /// How long a packet waits for its turn that finds that much work: the times on the line are rounded up to nanoseconds each, their bits are not.
    fn turn(self, work: u64) -> Duration {
        let service = self.service();
        // A packet without a time on the line leaves no work behind, so nothing waits for it.
        if service == 0 || work == 0 {
            return Duration::ZERO;
        }
        let inside = work.div_ceil(service) - 1;
        let since = (inside + 1) * service - work;
        let first = self.bits.saturating_sub(self.rate.bits_sent(Duration::from_nanos(since)));
        self.rate.transmission_time(first + u128::from(inside) * self.bits)
    }
}

/// A span \[ns\], or the longest.
pub(crate) fn nanos(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use alloc::collections::VecDeque;
    use alloc::vec::Vec;

    use proptest::prelude::*;

    use super::*;
    use crate::packet::{Exit, Marks, Packet, PacketInfo};
    use crate::stages::queue::limit::strategies::limits;
    use crate::stages::queue::{BottleneckStage, Framing};

    /// What becomes of each packet by the stage that keeps packets: when it leaves, or that it is dropped.
    fn by_stage(bottleneck: &Bottleneck, size: Bytes, offered: &[Instant]) -> Vec<Option<Instant>> {
        let mut stage = BottleneckStage::new(bottleneck.clone());
        let mut fates = alloc::vec![None; offered.len()];
        let (mut released, mut outputs) = (VecDeque::new(), Vec::new());
        let mut pass = |stage: &mut BottleneckStage<usize>, until: Instant, fates: &mut Vec<Option<Instant>>| {
            while let Some(at) = stage.next_at().filter(|at| *at <= until) {
                stage.release(at, &mut released, &mut outputs);
                released.drain(..).for_each(|packet| fates[packet.item] = Some(at));
            }
        };
        for (place, now) in offered.iter().enumerate() {
            pass(&mut stage, *now, &mut fates);
            let mut outputs = Vec::new();
            stage.offer(*now, Packet::new(place as u64, PacketInfo::from(size), Marks::default(), place), || 0, &mut outputs);
            assert!(outputs.iter().all(|output| matches!(output.exit, Exit::Dropped(..)) && output.packet.item == place));
        }
        pass(&mut stage, Instant::MAX, &mut fates);
        fates
    }

    /// A limit of no time and packets of no bits: the line is free at once, and nothing is dropped.
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

    proptest! {
        /// Departures and drops are those of the stage that keeps packets, with gaps from none to longer than the queue, at rates whose time on the line
        /// is rounded or not.
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
