//! Samples in flight, in a timing wheel indexed by the tick of the arrival.

mod lists;

use std::collections::BTreeMap;

use cohaptic_units::Instant;

use lists::{List, Lists};

/// Ticks of the wheel, so a second at 1 kHz fits: delays of satellites with queues. Packets with a later arrival are kept in a slower map.
const HORIZON: u64 = SPOKES as u64;
const SPOKES: usize = 1024;

/// Samples in flight, by the tick of their arrival.
#[derive(Clone, Debug)]
pub(super) struct InFlight<const A: usize> {
    ticks: Ticks,
    packets: Lists<Packet<A>>,
    /// Packets with an arrival within [`HORIZON`] ticks, indexed by the tick modulo [`HORIZON`].
    wheel: Box<[Bucket; SPOKES]>,
    /// Packets with a later arrival, by tick.
    beyond: BTreeMap<u64, Bucket>,
}

/// Samples with an arrival at the same tick: first samples with arrivals in the order of insertion on each link, then samples with a possible arrival before
/// samples of the same link inserted earlier. An array, because its index needs no branch.
pub(super) type Bucket = [List; 2];

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

/// Latest packet of a link that keeps the order of packets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Latest {
    /// Place of the packet in [`InFlight`]. Without meaning after the packet was taken in.
    place: u32,
    /// Lower bits of the sequence number of the next packet.
    next: u32,
    /// Lower bits of the sequence number of the first packet that the packet stands for, or of the packet itself.
    first: u16,
}

impl Latest {
    /// No packet. The first packet of a link waits for no other, so these numbers have no meaning.
    pub(super) const NONE: Self = Self { place: 0, next: 0, first: 0 };
}

impl<const A: usize> Packet<A> {
    /// A packet without meaning.
    const NONE: Self = Self { arrival: Instant::ZERO, sequence: 0, place: 0, receiver: 0, stands_for: 0, position: [0.0; A], velocity: [0.0; A] };
}

/// Converts spans to ticks, rounded up.
#[derive(Clone, Copy, Debug)]
struct Ticks {
    /// Length of a tick \[ns\].
    nanos: u64,
    /// ⌈2^64/nanos⌉. Without meaning if a tick has 2^31 ns or more, or 1 ns.
    reciprocal: u64,
    /// Spans below this limit are divided by the reciprocal; 0 without a reciprocal.
    limit: u64,
}

impl Ticks {
    fn new(nanos: u64) -> Self {
        let has_reciprocal = (2..1 << 31).contains(&nanos);
        Self { nanos, reciprocal: if has_reciprocal { u64::MAX / nanos + 1 } else { 0 }, limit: u64::from(has_reciprocal) << 31 }
    }

    /// Returns the number of ticks in `span` \[ns\], rounded up, without a division if possible.
    ///
    /// With r = ⌈2^64/d⌉ = (2^64 + e)/d, 0 ≤ e < d, the product n·r/2^64 is n/d + n·e/(d·2^64), with the same whole part as n/d while n·e < 2^64. This
    /// holds for n and d below 2^32.
    #[inline(always)]
    fn count(self, span: u64) -> u64 {
        if span < self.limit { ((u128::from(span + self.nanos - 1) * u128::from(self.reciprocal)) >> 64) as u64 } else { span.div_ceil(self.nanos) }
    }
}

impl<const A: usize> InFlight<A> {
    /// Returns a wheel without samples, for about as many samples as `expected`. A tick has `tick_nanos` nanoseconds.
    pub(super) fn new(tick_nanos: u64, expected: usize) -> Self {
        let wheel = Box::new([[List::EMPTY; 2]; SPOKES]);
        Self { ticks: Ticks::new(tick_nanos), packets: Lists::new(Packet::NONE, expected), wheel, beyond: BTreeMap::new() }
    }

    /// Stores a packet known from the given tick and instant on. `overtakes`: `true` if the packet may arrive before an earlier packet of its link.
    #[inline(always)]
    pub(super) fn push(&mut self, at: (u64, Instant), packet: Packet<A>, overtakes: bool) {
        let (ticks, spoke) = self.due_of(at, packet.arrival);
        let list = if ticks >= HORIZON { beyond(&mut self.beyond, at.0, ticks, overtakes) } else { &mut self.wheel[spoke][usize::from(overtakes)] };
        // The packet is written to its final place. As an argument of a call, a packet would be assembled on the stack and copied in words wider than its
        // fields. Such a copy stalls the processor.
        *self.packets.push(list).1 = packet;
    }

    /// Stores a packet like [`push`](Self::push), of a link that keeps the order of packets. `latest` is the latest packet of the link, and is replaced.
    /// `waits`: `true` if the packet is known to arrive together with an earlier packet.
    ///
    /// Of packets that arrive together a receiver sees the newest only, so the newest takes the place of the packet before. Many packets may wait
    /// for a packet with a long delay, and would take more memory than the caches of the processor.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "the lower bits tell apart the packets of a link that are in flight")]
    pub(super) fn push_in_order(&mut self, at: (u64, Instant), packet: Packet<A>, waits: bool, latest: &mut Latest) {
        // A packet that waits arrives after the present tick, together with the latest packet that arrives, so that packet is still in its place if no packet
        // between the two was lost. At each multiple of 2^16 a packet begins anew, so that `stands_for` has enough bits.
        let follows = waits & (latest.next == packet.sequence as u32) & (packet.sequence as u16 != 0);
        let (ticks, spoke) = self.due_of(at, packet.arrival);
        // Nobody can predict which packets follow, so there is no branch for them.
        let list = if !follows & (ticks >= HORIZON) { beyond(&mut self.beyond, at.0, ticks, false) } else { &mut self.wheel[spoke][0] };
        let (place, item) = self.packets.push_unless(follows, latest.place, list);
        let first = std::hint::select_unpredictable(follows, latest.first, packet.sequence as u16);
        // Nothing is read from the place, which is rarely in a cache.
        *item = Packet { stands_for: (packet.sequence as u16).wrapping_sub(first), ..packet };
        *latest = Latest { place, next: (packet.sequence as u32).wrapping_add(1), first };
    }

    /// Returns the number of ticks from the present tick to the tick at which a packet is due with this arrival, and the index of the latter in the wheel.
    #[inline(always)]
    fn due_of(&self, (tick, now): (u64, Instant), arrival: Instant) -> (u64, usize) {
        // `now` is a multiple of the tick, so this sum is the first tick at or after the arrival.
        let ticks = self.ticks.count(arrival.as_nanos() - now.as_nanos());
        (ticks, spoke(tick.wrapping_add(ticks)))
    }

    /// Returns all packets in flight, in no particular order.
    pub(super) fn iter(&self) -> impl Iterator<Item = &Packet<A>> {
        self.wheel.iter().chain(self.beyond.values()).flatten().flat_map(move |list| self.packets.slices(*list).flatten())
    }

    /// Returns the packets of a list of a bucket, in slices.
    #[inline(always)]
    pub(super) fn slices(&self, list: List) -> impl Iterator<Item = &[Packet<A>]> {
        self.packets.slices(list)
    }

    /// Keeps the memory of a bucket after its packets were taken in.
    #[inline(always)]
    pub(super) fn reuse(&mut self, bucket: Bucket) {
        for list in bucket {
            self.packets.give_back(list);
        }
    }

    /// Removes the packets of a bucket that `keeps` does not accept.
    pub(super) fn retain(&mut self, bucket: &mut Bucket, keeps: impl Fn(&Packet<A>) -> bool) {
        for list in bucket {
            let all = std::mem::replace(list, List::EMPTY);
            self.packets.append(list, all, &keeps);
        }
    }

    /// Removes and returns the samples due at `tick`; `None` without samples.
    #[inline(always)]
    pub(super) fn due(&mut self, tick: u64) -> Option<Bucket> {
        // Checked at every tick: a tick of the map enters the wheel only when due.
        if !self.beyond.is_empty() {
            self.come_near(tick);
        }
        let [in_order, overtaking] = std::mem::replace(&mut self.wheel[spoke(tick)], [List::EMPTY; 2]);
        (!in_order.is_empty() || !overtaking.is_empty()).then_some([in_order, overtaking])
    }

    /// Moves the samples of the map due at `tick` into the wheel, before the samples pushed later.
    #[cold]
    fn come_near(&mut self, tick: u64) {
        if let Some(bucket) = self.beyond.remove(&tick) {
            for (mut list, near) in bucket.into_iter().zip(&mut self.wheel[spoke(tick)]) {
                // The order of insertion is kept: samples of the map were pushed at earlier ticks than all samples of the wheel.
                self.packets.append(&mut list, *near, |_| true);
                *near = list;
            }
        }
    }
}

/// Returns a list of packets that are due `ticks` ticks after `tick`, beyond the wheel.
#[cold]
fn beyond(buckets: &mut BTreeMap<u64, Bucket>, tick: u64, ticks: u64, overtakes: bool) -> &mut List {
    &mut buckets.entry(tick.saturating_add(ticks)).or_insert([List::EMPTY; 2])[usize::from(overtakes)]
}

/// Returns the index of a tick in the wheel.
#[inline(always)]
const fn spoke(tick: u64) -> usize {
    (tick % HORIZON) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Packets of which all numbers but these are zero.
    fn packet(place: u32, sequence: u64, arrival: u64) -> Packet<1> {
        Packet { arrival: Instant::from_nanos(arrival), sequence, place, ..Packet::NONE }
    }

    /// Samples that are on the way for longer than the wheel is wide, and some that are not: all arrive at their tick, those of a link in order.
    #[test]
    fn late_samples_arrive_at_their_tick() {
        let mut in_flight = InFlight::<1>::new(1, 0);
        let mut count = 0;
        for tick in 0..10_000 {
            let now = (tick, Instant::from_nanos(tick));
            for (place, delay) in [(0, 1700), (1, 1900 - tick % 3), (2, 7)] {
                in_flight.push(now, packet(place, tick, tick + delay), tick % 3 == 2);
            }
            let Some(bucket) = in_flight.due(tick) else { continue };
            for list in bucket {
                let packets: Vec<_> = in_flight.slices(list).flatten().collect();
                assert!(packets.iter().all(|packet| packet.arrival == now.1));
                assert!(packets.is_sorted_by_key(|packet| packet.sequence));
                count += packets.len();
            }
            in_flight.reuse(bucket);
        }
        assert_eq!(in_flight.iter().count() + count, 30_000);
        assert_eq!(in_flight.iter().filter(|packet| packet.place == 2).count(), 7);
    }

    #[test]
    fn packets_of_a_bucket_are_removed() {
        let mut in_flight = InFlight::<1>::new(10, 0);
        for (arrival, overtakes) in [(1, false), (4, true), (9, false), (10, true), (11, false)] {
            in_flight.push((0, Instant::ZERO), packet(0, 0, arrival), overtakes);
        }
        let mut bucket = in_flight.due(1).unwrap();
        in_flight.retain(&mut bucket, |packet| packet.arrival.as_nanos() <= 4);
        let left = bucket.map(|list| in_flight.slices(list).flatten().map(|packet| packet.arrival.as_nanos()).collect::<Vec<_>>());
        assert_eq!(left, [[1], [4]]);
    }

    /// Packets of three links that wait in turn, beyond the wheel and within: of packets that arrive together the newest remains, and stands for the
    /// packets directly before.
    #[test]
    fn a_packet_stands_for_those_that_arrive_with_it() {
        let mut in_flight = InFlight::<1>::new(1, 0);
        let mut latest = [Latest::NONE; 3];
        let mut push = |now: u64, place: u32, sequence: u32, arrival: u64, waits: bool| {
            let packet = Packet { position: [f64::from(sequence)], ..packet(place, u64::from(sequence), arrival) };
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
        // Packet 2^16 begins anew.
        for (sequence, now) in (65_535..).zip(2000..2003) {
            push(now, 2, sequence, 2500, sequence > 65_535);
        }
        let mut found = |tick: u64| {
            let [in_order, _] = in_flight.due(tick).unwrap();
            let packets = in_flight.slices(in_order).flatten();
            let mut found: Vec<_> = packets.map(|packet| (packet.place, packet.sequence, packet.stands_for, packet.position[0])).collect();
            found.sort_unstable_by_key(|(place, sequence, ..)| (*place, *sequence));
            found
        };
        assert_eq!(found(2500), [(0, 4, 4, 4.0), (1, 8, 1, 8.0), (1, 11, 1, 11.0), (2, 65_535, 0, 65_535.0), (2, 65_537, 1, 65_537.0)]);
        assert_eq!(found(2501), [(0, 5, 0, 5.0)]);
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
