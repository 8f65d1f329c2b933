//! Samples in flight, in a timing wheel indexed by the tick of the arrival.

use std::collections::BTreeMap;

use cohaptic_units::Instant;

/// Ticks of the wheel, so a second at 1 kHz fits: delays of satellites with queues. Packets with a later arrival are kept in a slower map.
const HORIZON: u64 = 1024;
/// Slots of the wheel: two for each tick.
const SLOTS: usize = 2048;

/// Returns the first slot of a tick: samples in order. The next slot holds overtaking samples.
fn slot(tick: u64) -> usize {
    2 * (tick % HORIZON) as usize
}

/// Samples in flight, by the tick of their arrival.
#[derive(Clone, Debug)]
pub(super) struct InFlight<const A: usize> {
    ticks: Ticks,
    /// Packets with an arrival within [`HORIZON`] ticks. See [`slot`].
    wheel: Box<[Vec<Packet<A>>; SLOTS]>,
    /// Packets with a later arrival, by tick.
    beyond: BTreeMap<u64, Bucket<A>>,
    /// Allocations of emptied slots. The latest allocation is used first, because its memory is most likely in the cache.
    emptied: Vec<Vec<Packet<A>>>,
}

/// Samples with an arrival at the same tick.
#[derive(Clone, Debug)]
pub(super) struct Bucket<const A: usize> {
    /// Samples with arrivals in the order of insertion on each link.
    pub(super) in_order: Vec<Packet<A>>,
    /// Samples with a possible arrival before samples of the same link inserted earlier.
    pub(super) overtaking: Vec<Packet<A>>,
}

impl<const A: usize> Default for Bucket<A> {
    fn default() -> Self {
        Self { in_order: Vec::new(), overtaking: Vec::new() }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Packet<const A: usize> {
    pub(super) arrival: Instant,
    pub(super) sequence: u64,
    /// Place of the sample at the receiver, times the number of runs, plus the run.
    pub(super) place: u32,
    pub(super) receiver: u16,
    /// Number of packets directly before this packet on its link that arrive at the same instant, so that no receiver ever sees these packets: see
    /// [`InFlight::push_in_order`].
    pub(super) stands_for: u16,
    pub(super) position: [f64; A],
    pub(super) velocity: [f64; A],
}

/// Converts spans to ticks, rounded up.
#[derive(Clone, Copy, Debug)]
struct Ticks {
    /// Length of a tick \[ns\].
    nanos: u64,
    /// ⌈2^64/nanos⌉. `None` if a tick has 2^31 ns or more, or 1 ns.
    reciprocal: Option<u64>,
}

impl Ticks {
    fn new(nanos: u64) -> Self {
        Self { nanos, reciprocal: (2..1 << 31).contains(&nanos).then(|| u64::MAX / nanos + 1) }
    }

    /// Returns the number of ticks in `span` \[ns\], rounded up, without a division if possible.
    ///
    /// With r = ⌈2^64/d⌉ = (2^64 + e)/d, 0 ≤ e < d, the product n·r/2^64 is n/d + n·e/(d·2^64), with the same whole part as n/d while n·e < 2^64. This
    /// holds for n and d below 2^32.
    #[inline(always)]
    fn count(self, span: u64) -> u64 {
        match self.reciprocal {
            Some(reciprocal) if span < 1 << 31 => ((u128::from(span + self.nanos - 1) * u128::from(reciprocal)) >> 64) as u64,
            _ => span.div_ceil(self.nanos),
        }
    }
}

impl<const A: usize> InFlight<A> {
    /// Returns a wheel without samples. A tick has `tick_nanos` nanoseconds.
    pub(super) fn new(tick_nanos: u64) -> Self {
        Self { ticks: Ticks::new(tick_nanos), wheel: Box::new(std::array::from_fn(|_| Vec::new())), beyond: BTreeMap::new(), emptied: Vec::new() }
    }

    /// Stores a packet known from the given tick and instant on. `overtakes`: `true` if the packet may arrive before an earlier packet of its link.
    #[inline(always)]
    pub(super) fn push(&mut self, (tick, now): (u64, Instant), packet: Packet<A>, overtakes: bool) {
        // `now` is a multiple of the tick, so this sum is the first tick at or after the arrival.
        let ticks = self.ticks.count(packet.arrival.as_nanos() - now.as_nanos());
        let due = tick.saturating_add(ticks);
        self.packets_at((ticks, due), overtakes).push(packet);
    }

    /// Stores a packet like [`push`](Self::push), of a link that keeps the order of packets. `latest` is the index of the latest packet of the link among
    /// the packets of its tick, and is replaced. `waits`: `true` if the packet arrives together with that packet.
    ///
    /// Of packets that arrive together a receiver sees the newest only, so the newest takes the place of the packet before. Many packets may wait
    /// for a packet with a long delay, and would take more memory than the caches of the processor.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "fewer than 2^32 packets of a tick fit into memory")]
    pub(super) fn push_in_order(&mut self, (tick, now): (u64, Instant), packet: Packet<A>, waits: bool, latest: &mut u32) {
        let ticks = self.ticks.count(packet.arrival.as_nanos() - now.as_nanos());
        let packets = self.packets_at((ticks, tick.saturating_add(ticks)), false);
        // Sequence numbers without a gap tell which packets this packet stands for. The latest packet is elsewhere if it was pushed beyond the wheel.
        if waits
            && let Some(before) = packets.get_mut(*latest as usize)
            && (before.place, before.arrival, before.sequence + 1) == (packet.place, packet.arrival, packet.sequence)
            && before.stands_for < u16::MAX
        {
            *before = Packet { stands_for: before.stands_for + 1, ..packet };
            return;
        }
        *latest = packets.len() as u32;
        packets.push(packet);
    }

    /// Returns the packets due at the tick `due`, `ticks` ticks ahead.
    ///
    /// The caller pushes the packet itself. A packet as an argument would be assembled on the stack and copied in words wider than its fields. Such a copy
    /// stalls the processor.
    #[inline(always)]
    fn packets_at(&mut self, (ticks, due): (u64, u64), overtakes: bool) -> &mut Vec<Packet<A>> {
        if ticks >= HORIZON {
            return self.packets_beyond(due, overtakes);
        }
        // Index by addition, without a branch.
        let packets = &mut self.wheel[slot(due) + usize::from(overtakes)];
        // A slot gives its allocation away when its packets are taken in, so a slot in use for the first time or again takes an emptied one.
        if packets.capacity() == 0 {
            *packets = self.emptied.pop().unwrap_or_default();
        }
        packets
    }

    #[cold]
    fn packets_beyond(&mut self, due: u64, overtakes: bool) -> &mut Vec<Packet<A>> {
        let Bucket { in_order, overtaking } = self.beyond.entry(due).or_default();
        let packets = if overtakes { overtaking } else { in_order };
        if packets.capacity() == 0 {
            *packets = self.emptied.pop().unwrap_or_default();
        }
        packets
    }

    /// Returns all packets in flight, in no particular order.
    pub(super) fn iter(&self) -> impl Iterator<Item = &Packet<A>> {
        self.wheel.iter().flatten().chain(self.beyond.values().flat_map(|bucket| bucket.in_order.iter().chain(&bucket.overtaking)))
    }

    /// Keeps the allocations of a bucket after its packets were taken in.
    pub(super) fn reuse(&mut self, Bucket { in_order, overtaking }: Bucket<A>) {
        for mut packets in [overtaking, in_order] {
            if packets.capacity() > 0 {
                packets.clear();
                self.emptied.push(packets);
            }
        }
    }

    /// Removes and returns the samples due at `tick`; `None` without samples.
    #[inline(always)]
    pub(super) fn due(&mut self, tick: u64) -> Option<Bucket<A>> {
        // Checked at every tick: a tick of the map enters the wheel only when due.
        if !self.beyond.is_empty() {
            self.come_near(tick);
        }
        let slot = slot(tick);
        let (in_order, overtaking) = (std::mem::take(&mut self.wheel[slot]), std::mem::take(&mut self.wheel[slot + 1]));
        (!in_order.is_empty() || !overtaking.is_empty()).then_some(Bucket { in_order, overtaking })
    }

    /// Moves the samples of the map due at `tick` into the wheel, before the samples pushed later.
    #[cold]
    fn come_near(&mut self, tick: u64) {
        if let Some(bucket) = self.beyond.remove(&tick) {
            for (mut packets, slot) in [bucket.in_order, bucket.overtaking].into_iter().zip(slot(tick)..) {
                // The order of insertion is kept: samples of the map were pushed at earlier ticks than all samples of the slot.
                packets.append(&mut self.wheel[slot]);
                let emptied = std::mem::replace(&mut self.wheel[slot], packets);
                if emptied.capacity() > 0 {
                    self.emptied.push(emptied);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples that are on the way for longer than the wheel is wide, and some that are not: memory is used again, and does not grow with time.
    #[test]
    fn late_samples_take_the_memory_of_earlier_ones() {
        let mut in_flight = InFlight::<1>::new(1);
        let packet = |arrival: u64| Packet {
            arrival: Instant::from_nanos(arrival),
            sequence: 0,
            place: 0,
            receiver: 0,
            stands_for: 0,
            position: [0.0],
            velocity: [0.0],
        };
        let mut most = 0;
        for tick in 0..10_000 {
            let now = (tick, Instant::from_nanos(tick));
            for (delay, overtakes) in [(1700, false), (1700, true), (1900, tick % 3 == 0), (7, false)] {
                in_flight.push(now, packet(tick + delay), overtakes);
            }
            if let Some(bucket) = in_flight.due(tick) {
                assert!(bucket.in_order.iter().chain(&bucket.overtaking).all(|packet| packet.arrival == now.1));
                in_flight.reuse(bucket);
            }
            let lists = in_flight.wheel.iter().chain(in_flight.beyond.values().flat_map(|bucket| [&bucket.in_order, &bucket.overtaking]));
            let memory = lists.chain(&in_flight.emptied).filter(|packets| packets.capacity() > 0).count();
            most = most.max(memory);
        }
        // Two for each tick ahead up to the latest arrival.
        assert!(most <= 2 * 1901, "{most} lists");
        assert_eq!(in_flight.iter().count(), 2 * 1700 + 1900 + 7);
    }

    /// Packets of two links that wait in turn, beyond the wheel and within: of packets that arrive together the newest remains, and stands for the
    /// packets directly before.
    #[test]
    fn a_packet_stands_for_those_that_arrive_with_it() {
        let mut in_flight = InFlight::<1>::new(1);
        let mut latest = [0; 2];
        let mut push = |now: u64, place: u32, sequence: u64, arrival: u64, waits: bool| {
            let packet =
                Packet { arrival: Instant::from_nanos(arrival), sequence, place, receiver: 0, stands_for: 0, position: [0.0], velocity: [0.0] };
            in_flight.push_in_order((now, Instant::from_nanos(now)), packet, waits, &mut latest[place as usize]);
        };
        for (sequence, now) in (0..).zip([0, 10, 2000, 2001, 2002]) {
            push(now, 0, sequence, 2500, sequence > 0);
        }
        push(2000, 1, 7, 2500, false);
        push(2001, 1, 8, 2500, true);
        // Packet 9 is lost, so that packet 10 does not stand for packet 8.
        push(2002, 1, 10, 2500, true);
        push(2003, 1, 11, 2500, true);
        push(2003, 0, 5, 2501, false);
        let mut found = |tick: u64| {
            let bucket = in_flight.due(tick).unwrap();
            let mut found: Vec<_> = bucket.in_order.iter().map(|packet| (packet.place, packet.sequence, packet.stands_for)).collect();
            found.sort_unstable();
            found
        };
        assert_eq!(found(2500), [(0, 1, 1), (0, 4, 2), (1, 8, 1), (1, 11, 1)]);
        assert_eq!(found(2501), [(0, 5, 0)]);
    }

    /// At every edge: of a tick, of the range in which the reciprocal is exact, of the range of ticks that have one.
    #[test]
    fn ticks_are_counted_as_by_dividing() {
        for nanos in [1, 2, 3, 7, 999_983, 1_000_000, 125_000_001, (1 << 31) - 1, 1 << 31, (1 << 31) + 1, 1 << 50] {
            let ticks = Ticks::new(nanos);
            let edges = [1, 2, 1000, (1 << 31) / nanos, (1 << 31) / nanos + 1, (1 << 32) / nanos, (1 << 62) / nanos].map(|count| count * nanos);
            for edge in edges.into_iter().chain([1 << 31, 1 << 32, 1 << 62]) {
                for span in [0, edge.saturating_sub(1), edge, edge + 1] {
                    assert_eq!(ticks.count(span), span.div_ceil(nanos), "{span} ns in ticks of {nanos} ns");
                }
            }
        }
    }
}
