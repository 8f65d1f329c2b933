//! Samples that each arrive at an instant of their own: links that differ, jitter, loss, bursts, outages.
//!
//! Peers look at what has arrived at their ticks alone, and all tick together. So samples in flight lie in a wheel, by the tick at which it is in force, and
//! nothing is sorted but the samples that are due together after one overtook another on its link.

use std::collections::BTreeMap;

use cohaptic_peer::Moving;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_wan::{Arrivals, DirectLinks, LinkId, LinkName, LinkStats};

use super::quads::{self, Quad};
use super::{Sample, others};
use crate::arrays::bodies::Bodies;

/// Ticks ahead that lie in the wheel; what arrives later than that is kept aside.
const HORIZON: u64 = 256;

/// Where a tick lies in the wheel.
#[inline(always)]
fn slot(tick: u64) -> usize {
    // The lower byte: the remainder by HORIZON.
    usize::from(tick.to_le_bytes()[0])
}

/// The links, the samples in flight, and those that each peer holds of each other.
#[derive(Clone, Debug)]
pub(in crate::arrays) struct PerPacket<const P: usize, const L: usize> {
    peers: usize,
    ticks: Ticks,
    end: Instant,
    /// By sender, then receiver, then run; the diagonal is never used.
    links: DirectLinks,
    wheel: Box<[Bucket<P>; 256]>,
    beyond: BTreeMap<u64, Bucket<P>>,
    /// Memory of buckets that were emptied, the latest last: it is what the cache holds. It took 5 % off a tick of ten peers whose packets arrive together.
    emptied: Vec<Vec<Packet<P>>>,
    /// Samples held, by pair of numbers, then receiver, then sender with the receiver left out. Each receiver has [`row_of`] places, of which the last may be empty.
    held: [Vec<Quad<L>>; P],
    /// By place, then run: the lowest sequence number that is newer than the sample held.
    next: Vec<u64>,
    /// By receiver: bit r says whether a sample has arrived in run r since the means were computed.
    changed: Vec<u8>,
    /// By receiver, then run: samples that arrived after a newer one.
    stale: Vec<u64>,
}

/// The samples in force at a tick.
#[derive(Clone, Debug)]
struct Bucket<const P: usize> {
    packets: Vec<Packet<P>>,
    /// Whether one of them overtook another that may be here too.
    is_mixed: bool,
}

impl<const P: usize> Default for Bucket<P> {
    fn default() -> Self {
        Self { packets: Vec::new(), is_mixed: false }
    }
}

#[derive(Clone, Copy, Debug)]
struct Packet<const P: usize> {
    arrival: Instant,
    sequence: u64,
    /// Where its receiver holds what it says.
    place: u32,
    receiver: u16,
    run: u16,
    position: [f64; P],
    velocity: [f64; P],
}

/// How many places a receiver has for what it holds: whole quads.
const fn row_of(peers: usize) -> usize {
    (peers - 1).next_multiple_of(4)
}

/// How many ticks a span takes, rounded up.
#[derive(Clone, Copy, Debug)]
struct Ticks {
    nanos: u64,
    /// ⌈2^64/nanos⌉, if ticks are shorter than 2^31 ns.
    reciprocal: Option<u64>,
}

impl Ticks {
    fn new(nanos: u64) -> Self {
        Self { nanos, reciprocal: (2..1 << 31).contains(&nanos).then(|| u64::MAX / nanos + 1) }
    }

    /// A division would add 4 % to a tick of ten peers over links with jitter and loss. With r = ⌈2^64/d⌉ = (2^64 + e)/d, 0 ≤ e < d, the product n·r/2^64 is
    /// n/d + n·e/(d·2^64), which has the same whole part as n/d while n·e < 2^64: for n and d below 2^32.
    #[inline(always)]
    fn count(self, span: u64) -> u64 {
        match self.reciprocal {
            Some(reciprocal) if span < 1 << 31 => ((u128::from(span + self.nanos - 1) * u128::from(reciprocal)) >> 64) as u64,
            _ => span.div_ceil(self.nanos),
        }
    }
}

impl<const P: usize, const L: usize> PerPacket<P, L> {
    /// Everybody holds the initial states of the others, and nothing is on the way.
    pub(in crate::arrays) fn new<const A: usize>(scenes: &[&Scene], bodies: &impl Bodies<A, P>, end: Instant, tick_nanos: u64) -> Self {
        let peers = scenes[0].peers.len();
        let mut links = DirectLinks::new(end);
        for from in 0..peers {
            for to in 0..peers {
                for scene in scenes {
                    // The diagonal has a link that nothing is ever sent over, so that a place is found by multiplying.
                    let (from, to) = if from == to { (0, 1) } else { (from, to) };
                    let name = LinkName::between(&scene.peers[from].name, &scene.peers[to].name);
                    assert!(links.add(scene.seed, &name, scene.links.between(from, to)), "the shape of a scene says that its links are direct");
                }
            }
        }
        let row = row_of(peers);
        let mut single = Self {
            peers,
            ticks: Ticks::new(tick_nanos),
            end,
            links,
            wheel: Box::new(std::array::from_fn(|_| Bucket::default())),
            beyond: BTreeMap::new(),
            emptied: Vec::new(),
            held: std::array::from_fn(|_| (0..peers).flat_map(|_| quads::empty(peers - 1)).collect()),
            next: vec![0; peers * row * L],
            changed: vec![u8::MAX; peers],
            stale: vec![0; peers * L],
        };
        for sender in 0..peers {
            let sample: Sample<P, L> = bodies.sample(sender);
            for receiver in (0..peers).filter(|receiver| *receiver != sender) {
                for (pair, run) in (0..P).flat_map(|pair| (0..L).map(move |run| (pair, run))) {
                    let place = receiver * row_of(peers) + sender - usize::from(sender > receiver);
                    quads::set(&mut single.held[pair], place, run, sample.position[pair][run], sample.velocity[pair][run]);
                }
            }
        }
        single
    }

    /// A peer sends to all others. A run that has ended goes on sending; nobody looks.
    #[inline(never)]
    #[expect(clippy::cast_possible_truncation, reason = "there are at most 4096 peers, and eight runs")]
    pub(in crate::arrays) fn send<const A: usize>(&mut self, tick: u64, now: Instant, sender: usize, bodies: &impl Bodies<A, P>) {
        let sample: Sample<P, L> = bodies.sample(sender);
        let Self { peers, ticks, links, wheel, beyond, emptied, .. } = self;
        let (row, places) = (*peers * L, row_of(*peers));
        let mut arrivals = Arrivals::NONE;
        for first in (0..row).step_by(DirectLinks::AT_ONCE) {
            // Lanes links lead to eight receivers of one run or to one receiver of eight runs; some of them, or all, to the sender itself.
            let own = (sender * L).wrapping_sub(first);
            let but = if own < DirectLinks::AT_ONCE { ((1_u16 << L) - 1) << own } else { 0 };
            links.offer(now, LinkId::new(sender * row + first), DirectLinks::AT_ONCE.min(row - first), but as u8, &mut arrivals);
            for place in arrivals.places() {
                let (receiver, run, at) = ((first + place) / L, (first + place) % L, arrivals.at[place]);
                // `now` is on the lattice of ticks, so this is the first tick at or after the arrival.
                let ticks = ticks.count(at.as_nanos() - now.as_nanos());
                let due = tick.saturating_add(ticks);
                let bucket = if ticks < HORIZON { &mut wheel[slot(due)] } else { beyond.entry(due).or_default() };
                if bucket.packets.capacity() == 0 {
                    bucket.packets = emptied.pop().unwrap_or_default();
                }
                bucket.is_mixed |= arrivals.overtakes(place);
                bucket.packets.push(Packet {
                    arrival: at,
                    sequence: arrivals.sequences[place],
                    place: (receiver * places + sender - usize::from(sender > receiver)) as u32,
                    receiver: receiver as u16,
                    run: run as u16,
                    position: std::array::from_fn(|pair| sample.position[pair][run]),
                    velocity: std::array::from_fn(|pair| sample.velocity[pair][run]),
                });
            }
        }
    }

    /// What has arrived is held from now on.
    pub(in crate::arrays) fn deliver(&mut self, tick: u64) {
        self.take_in(tick, Instant::MAX);
    }

    /// How what a peer holds in a run moves on, in the order in which the peer holds it. `sent` says when a sample of a sender was sent.
    pub(in crate::arrays) fn moving<const A: usize>(
        &self,
        (peer, run): (usize, usize),
        sent: impl Fn(usize, u64) -> Instant,
    ) -> impl Iterator<Item = Moving<A>> {
        let first = peer * row_of(self.peers);
        (0..self.peers - 1).map(move |place| {
            let sender = place + usize::from(place >= peer);
            let newest = self.next[(first + place) * L + run].checked_sub(1);
            Moving {
                sent: newest.map_or(Instant::ZERO, |newest| sent(sender, newest)),
                velocity: std::array::from_fn(|axis| quads::velocity(&self.held[axis], first + place, run)),
            }
        })
    }

    /// Whether anything that a peer holds in a run has changed since the means were computed.
    pub(in crate::arrays) fn has_changed(&self, peer: usize, run: usize) -> bool {
        self.changed[peer] & (1 << run) != 0
    }

    /// The means are those of the samples held.
    #[inline(always)]
    pub(in crate::arrays) fn refresh<const A: usize>(&mut self, bodies: &mut impl Bodies<A, P>) {
        let count = others(self.peers);
        for peer in 0..self.peers {
            if std::mem::take(&mut self.changed[peer]) == 0 {
                continue;
            }
            let quads = row_of(self.peers) / 4;
            for pair in 0..P {
                let (x, v) = quads::mean(&self.held[pair][peer * quads..(peer + 1) * quads], count);
                bodies.set_target(pair, peer, x, v);
            }
        }
    }

    /// At the end of the scene, which is at or before that tick: what has arrived by then.
    pub(in crate::arrays) fn finish(&mut self, tick: u64) {
        self.take_in(tick, self.end);
    }

    /// Takes in the samples that are due at that tick and arrived by `until`.
    #[inline(never)]
    fn take_in(&mut self, tick: u64, until: Instant) {
        let place = slot(tick);
        if !self.beyond.is_empty() {
            self.come_near(tick);
        }
        let mut bucket = std::mem::take(&mut self.wheel[place]);
        if bucket.packets.is_empty() {
            return;
        }
        if bucket.is_mixed {
            bucket.packets.sort_unstable_by_key(|packet| (packet.arrival, packet.sequence));
        }
        for packet in bucket.packets.drain(..) {
            if packet.arrival <= until {
                self.receive(&packet);
            }
        }
        self.emptied.push(bucket.packets);
    }

    /// The samples that are due at that tick and were sent long ago.
    #[cold]
    fn come_near(&mut self, tick: u64) {
        if let Some(bucket) = self.beyond.remove(&tick) {
            let near = &mut self.wheel[slot(tick)];
            near.packets.extend(bucket.packets);
            near.is_mixed = true;
        }
    }

    #[inline(always)]
    fn receive(&mut self, packet: &Packet<P>) {
        let (place, run) = (packet.place as usize, usize::from(packet.run));
        let next = &mut self.next[place * L + run];
        if packet.sequence < *next {
            self.stale[usize::from(packet.receiver) * L + run] += 1;
            return;
        }
        *next = packet.sequence + 1;
        for pair in 0..P {
            quads::set(&mut self.held[pair], place, run, packet.position[pair], packet.velocity[pair]);
        }
        self.changed[usize::from(packet.receiver)] |= 1 << packet.run;
    }

    /// A run ends before the end of the scene: samples still in flight in it never arrive.
    ///
    /// `sent` says when a packet of a sender was sent.
    pub(in crate::arrays) fn end_early(&mut self, run: usize, sent: impl Fn(usize, u64) -> Instant) {
        for bucket in self.wheel.iter().chain(self.beyond.values()) {
            for packet in bucket.packets.iter().filter(|packet| usize::from(packet.run) == run) {
                let receiver = usize::from(packet.receiver);
                let place = packet.place as usize - receiver * row_of(self.peers);
                let sender = place + usize::from(place >= receiver);
                self.links.forget(LinkId::new((sender * self.peers + receiver) * L + run), sent(sender, packet.sequence), packet.arrival);
            }
        }
    }

    /// How many samples a peer received after a newer one.
    pub(in crate::arrays) fn stale_samples(&self, receiver: usize, run: usize) -> u64 {
        self.stale[receiver * L + run]
    }

    /// The counters of a link.
    pub(in crate::arrays) fn stats(&self, from: usize, to: usize, run: usize) -> LinkStats {
        self.links.stats(LinkId::new((from * self.peers + to) * L + run))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
