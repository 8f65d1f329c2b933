//! Samples that receivers hold, and the samples that arrive there.

use cohaptic_peer::{EXACT_FROM, ExactMeans, Moving, State};
use cohaptic_units::Instant;

use super::super::in_flight::{Bucket, InFlight, Packet};
use super::super::quads::{self, Quad};
use super::super::rows::Rows;
use super::super::{Sample, count};
use crate::arrays::blocks::Blocks;

/// Flag in an entry of `next`: a sample of this tick and this link overtook an earlier sample.
const IS_OVERTAKEN: u64 = 1 << 63;
/// Number of samples taken in at once by [`Received::take_in_together`].
const TAKEN_TOGETHER: usize = 16;

/// Samples of every other peer held by each receiver. A place, a receiver and a run are counted as in [`Rows`].
#[derive(Clone, Debug)]
pub(super) struct Received<const A: usize, const L: usize> {
    /// Samples held, indexed by axis, then ordered by receiver and sender. Each receiver has whole quads, and the last quad may be padded.
    held: [Vec<Quad<L>>; A],
    /// Sums of the held samples, indexed by receiver; `None` if the mean of the receiver is not exact. Empty if no mean is exact. Exact means are computed in
    /// single runs only.
    sums: Vec<Option<ExactMeans<A>>>,
    /// Least sequence number newer than the held sample, indexed by place, then run. 0 as long as no sample has arrived.
    next: Vec<u64>,
    /// Arrivals since the means were computed: bit r for run r, indexed by receiver.
    changed: Vec<u8>,
    /// Number of samples arrived after a newer sample, indexed by receiver, then run.
    stale: Vec<u64>,
    /// Samples of links with overtaking, while the samples of a tick are taken in. Empty at other times, and kept for its memory.
    unordered: Vec<Packet<A>>,
}

impl<const A: usize, const L: usize> Received<A, L> {
    /// Returns the state of `receivers` receivers before the first tick: each holds the samples `initial` of the other peers, indexed by peer of the scene.
    pub(super) fn new(rows: &Rows, receivers: usize, initial: &[Sample<A, L>]) -> Self {
        let mut held = std::array::from_fn(|_| quads::empty(rows.places(receivers)));
        // A held sample is stored with its weight, as `Rows::packet` weighs arriving samples.
        for (receiver, place) in (0..receivers).flat_map(|receiver| rows.held(receiver).map(move |place| (receiver, place))) {
            let column = rows.column_of(receiver, place);
            let (sample, weight) = (&initial[rows.sender(receiver, column)], rows.weight(receiver, column));
            let weighed = |number: f64| weight.map_or(number, |weight| number * weight);
            for (axis, run) in (0..A).flat_map(|axis| (0..L).map(move |run| (axis, run))) {
                quads::set(&mut held[axis], place, run, weighed(sample.position[axis][run]), weighed(sample.velocity[axis][run]));
            }
        }
        // With many samples the sums are kept exactly, so a single arrival costs one replacement instead of a sum over all held samples.
        let sums = if (0..receivers).any(|receiver| rows.held(receiver).len() >= EXACT_FROM) {
            let states = |receiver: usize| rows.held(receiver).map(|place| quads::state(&held, place, 0)).collect::<Vec<_>>();
            let sums = |receiver: usize| (rows.held(receiver).len() >= EXACT_FROM).then(|| ExactMeans::new(states(receiver).iter()));
            (0..receivers).map(sums).collect()
        } else {
            Vec::new()
        };
        let places = rows.places(receivers);
        Self { held, sums, next: vec![0; places * L], changed: vec![u8::MAX; receivers], stale: vec![0; receivers * L], unordered: Vec::new() }
    }

    /// Returns the instant and the velocity of each held sample of a peer in a run, in the order of the peer. `sent` returns the instant of sending of the
    /// sample with a sequence number of a sender.
    pub(super) fn moving(&self, rows: &Rows, (peer, run): (usize, usize), sent: impl Fn(usize, u64) -> Instant) -> impl Iterator<Item = Moving<A>> {
        rows.held(peer).map(move |place| {
            let sender = rows.sender(peer, rows.column_of(peer, place));
            let newest = self.next[place * L + run].checked_sub(1);
            Moving {
                sent: newest.map_or(Instant::ZERO, |newest| sent(sender, newest)),
                velocity: std::array::from_fn(|axis| quads::velocity(&self.held[axis], place, run)),
            }
        })
    }

    /// Returns whether any held sample of a peer in a run has changed since the means were computed.
    pub(super) fn has_changed(&self, peer: usize, run: usize) -> bool {
        self.changed[peer] & (1 << run) != 0
    }

    /// Computes the means of the receivers with a new sample.
    #[inline(always)]
    pub(super) fn refresh(&mut self, rows: &Rows, blocks: &mut Blocks) {
        // The usual case first: rows of equal length at computed offsets, without a question for each receiver.
        let Rows::All { peers, .. } = *rows else { return self.refresh_unequal(rows, blocks) };
        if !self.sums.is_empty() {
            return self.refresh_unequal(rows, blocks);
        }
        let (quads, count) = ((peers - 1).div_ceil(4), count(peers - 1));
        for (peer, changed) in self.changed.iter_mut().enumerate() {
            if std::mem::take(changed) == 0 {
                continue;
            }
            for axis in 0..A {
                let (x, v) = quads::mean(&self.held[axis][peer * quads..(peer + 1) * quads], count);
                blocks.set_target(axis, peer, x, v);
            }
        }
    }

    /// Like [`refresh`](Self::refresh), for receivers with different numbers of heard peers or with exact means.
    #[inline(never)]
    fn refresh_unequal(&mut self, rows: &Rows, blocks: &mut Blocks) {
        let Self { held, sums, changed, .. } = self;
        for (peer, changed) in changed.iter_mut().enumerate() {
            if std::mem::take(changed) == 0 {
                continue;
            }
            let places = rows.held(peer);
            if let Some(Some(sums)) = sums.get(peer) {
                let mean = sums.mean(places.len());
                for axis in 0..A {
                    blocks.set_target(axis, peer, [mean.position[axis]; L], [mean.velocity[axis]; L]);
                }
                continue;
            }
            // The padding of the last quad is −0, whose addition changes no sum, so whole quads can be summed.
            let (quads, count) = (places.start / 4..places.end.div_ceil(4), count(places.len()));
            for (axis, held) in held.iter().enumerate() {
                let (x, v) = quads::mean(&held[quads.clone()], count);
                blocks.set_target(axis, peer, x, v);
            }
        }
    }

    /// Takes in the samples of a bucket.
    ///
    /// The order among links does not matter: of each link the newest sample stays, and sums of samples are exact. Samples are therefore taken in unsorted,
    /// from receiver to receiver. Samples of links with overtaking come last, sorted, because their order decides which samples are stale.
    #[inline(always)]
    pub(super) fn take_in(&mut self, in_flight: &InFlight<A>, [in_order, overtaking]: Bucket) {
        let mut unordered = std::mem::take(&mut self.unordered);
        // Mark the links first: the samples of marked links in `in_order` must wait for the sorted pass too.
        for packet in in_flight.slices(overtaking).flatten() {
            self.next[packet.place as usize] |= IS_OVERTAKEN;
            unordered.push(*packet);
        }
        // Samples appended below belong to marked links, but did not mark the links.
        let marking = unordered.len();
        for packets in in_flight.slices(in_order) {
            // Without exact means there are no sums to update.
            match self.sums.is_empty() {
                true => self.take_in_order(packets, &mut unordered),
                false => self.take_in_together(packets, &mut unordered),
            }
        }
        if marking > 0 {
            self.take_in_unordered(&mut unordered, marking);
            unordered.clear();
        }
        self.unordered = unordered;
    }

    /// Takes in the samples of links without overtaking. Appends the other samples to `unordered`.
    #[inline(always)]
    fn take_in_order(&mut self, packets: &[Packet<A>], unordered: &mut Vec<Packet<A>>) {
        for packet in packets {
            if self.is_newest(packet, unordered) {
                self.hold(packet);
            }
        }
    }

    /// Like [`take_in_order`](Self::take_in_order), for exact means. Takes in several samples at once, so the reads of held samples overlap before the sums
    /// need the samples: these samples are more than a cache holds.
    #[inline(always)]
    fn take_in_together(&mut self, packets: &[Packet<A>], unordered: &mut Vec<Packet<A>>) {
        for packets in packets.chunks(TAKEN_TOGETHER) {
            let (mut newest, mut count) = ([0; TAKEN_TOGETHER], 0);
            for (place, packet) in packets.iter().enumerate() {
                // Written in any case and counted only if newest: no branch.
                newest[count] = place;
                count += usize::from(self.is_newest(packet, unordered));
            }
            // Each sample is held as soon as the sample before is read, so a second sample of the same link in this chunk replaces the first.
            let mut before = [State { position: [0.0; A], velocity: [0.0; A] }; TAKEN_TOGETHER];
            for (place, before) in newest[..count].iter().zip(&mut before) {
                let packet = &packets[*place];
                *before = quads::state(&self.held, packet.place as usize / L, packet.place as usize % L);
                self.hold(packet);
            }
            for (place, before) in newest[..count].iter().zip(&before) {
                self.replace(before, &packets[*place]);
            }
        }
    }

    /// Returns whether a sample is newer than the held sample, and notes its sequence number if so. Appends a sample of a marked link to `unordered`.
    #[inline(always)]
    fn is_newest(&mut self, packet: &Packet<A>, unordered: &mut Vec<Packet<A>>) -> bool {
        let next = &mut self.next[packet.place as usize];
        // A marked entry has its top bit set, so no sequence number reaches it.
        let is_newest = packet.sequence >= *next;
        if is_newest {
            *next = packet.sequence + 1;
        } else if *next & IS_OVERTAKEN == 0 {
            self.count_stale(packet);
        } else {
            unordered.push(*packet);
        }
        is_newest
    }

    /// Takes in all samples of marked links, in the order of arrival. The first `marking` packets have marked their links.
    fn take_in_unordered(&mut self, packets: &mut [Packet<A>], marking: usize) {
        for packet in &packets[..marking] {
            self.next[packet.place as usize] &= !IS_OVERTAKEN;
        }
        // A stable order is not needed: the arrival and the sequence number tell all packets of a link apart.
        packets.sort_unstable_by_key(|packet| (packet.arrival, packet.sequence));
        for packet in &*packets {
            self.take_in_one(packet);
        }
    }

    /// Takes in a sample, after all earlier arrivals of its link.
    #[inline(always)]
    fn take_in_one(&mut self, packet: &Packet<A>) {
        let next = &mut self.next[packet.place as usize];
        if packet.sequence >= *next {
            *next = packet.sequence + 1;
            let before = quads::state(&self.held, packet.place as usize / L, packet.place as usize % L);
            self.replace(&before, packet);
            self.hold(packet);
        } else {
            self.count_stale(packet);
        }
    }

    /// Replaces the sample `before` by the sample of `packet` in the sums of the receiver, if the receiver has sums.
    #[inline(always)]
    fn replace(&mut self, before: &State<A>, packet: &Packet<A>) {
        if let Some(Some(sums)) = self.sums.get_mut(usize::from(packet.receiver)) {
            sums.replace(before, &State { position: packet.position, velocity: packet.velocity });
        }
    }

    /// Holds a sample: replaces the held sample and marks the mean as out of date.
    #[inline(always)]
    fn hold(&mut self, packet: &Packet<A>) {
        let (place, run) = (packet.place as usize / L, packet.place as usize % L);
        for axis in 0..A {
            quads::set(&mut self.held[axis], place, run, packet.position[axis], packet.velocity[axis]);
        }
        self.changed[usize::from(packet.receiver)] |= 1 << run;
    }

    #[cold]
    fn count_stale(&mut self, packet: &Packet<A>) {
        // The packets that `packet` stands for have lower sequence numbers, so that all of them are stale too.
        self.stale[usize::from(packet.receiver) * L + packet.place as usize % L] += 1 + u64::from(packet.stands_for);
    }

    /// Returns the number of samples taken in by a receiver after a newer sample.
    pub(super) fn stale_samples(&self, receiver: usize, run: usize) -> u64 {
        self.stale[receiver * L + run]
    }
}
