//! Samples that each arrive at an instant of their own: links that differ, jitter, loss, bursts, outages.
//!
//! Peers look at what has arrived at their ticks alone, and all tick together. So samples in flight lie in a wheel, by the tick at which it is in force, and
//! nothing is sorted but the samples that are due together after one overtook another on its link.

use std::collections::BTreeMap;

use cohaptic_peer::{EXACT_FROM, ExactMeans, Moving, State};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_wan::{Arrivals, DirectLinks, LinkId, LinkModel, LinkName, LinkStats, PacketInfo, SteppedLinks};

use super::quads::{self, Quad};
use super::{Sample, others};
use crate::arrays::bodies::Bodies;
use crate::arrays::{Shape, nanos};

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
    end: Instant,
    /// By sender, then receiver, then run; the diagonal is never used.
    links: Links<P>,
    in_flight: InFlight<P>,
    /// Samples held, by pair of numbers, then receiver, then sender with the receiver left out. Each receiver has [`row_of`] places, of which the last may be empty.
    held: [Vec<Quad<L>>; P],
    /// By receiver the sums of what it holds, if the means are exact: then there is one run.
    sums: Vec<ExactMeans<P>>,
    /// By place, then run: the lowest sequence number that is newer than the sample held.
    next: Vec<u64>,
    /// By receiver: bit r says whether a sample has arrived in run r since the means were computed.
    changed: Vec<u8>,
    /// By receiver, then run: samples that arrived after a newer one.
    stale: Vec<u64>,
}

/// The links, with what all samples have in common if links ask.
#[derive(Clone, Debug)]
enum Links<const P: usize> {
    Direct(DirectLinks),
    /// They are told when each sender sends next.
    Stepped(SteppedLinks<Packet<P>>, PacketInfo),
}

/// The samples in flight, by the tick at which they are in force.
#[derive(Clone, Debug)]
struct InFlight<const P: usize> {
    ticks: Ticks,
    wheel: Box<[Bucket<P>; 256]>,
    beyond: BTreeMap<u64, Bucket<P>>,
    /// Memory of buckets that were emptied, the latest last: it is what the cache holds. It took 5 % off a tick of ten peers whose packets arrive together.
    emptied: Vec<Vec<Packet<P>>>,
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
    pub(in crate::arrays) fn new<const A: usize>(scenes: &[&Scene], bodies: &impl Bodies<A, P>, shape: &Shape) -> Self {
        let peers = scenes[0].peers.len();
        let mut links = match shape.has_queues {
            false => Links::Direct(DirectLinks::new(shape.end, shape.size)),
            true => Links::Stepped(SteppedLinks::new(shape.end), PacketInfo { size: shape.size, ecn_capable: true }),
        };
        for from in 0..peers {
            for to in 0..peers {
                for scene in scenes {
                    // The diagonal has a link that nothing is ever sent over, so that a place is found by multiplying.
                    let (from, to) = if from == to { (0, 1) } else { (from, to) };
                    let name = LinkName::between(&scene.peers[from].name, &scene.peers[to].name);
                    let model: &LinkModel = scene.links.between(from, to);
                    match &mut links {
                        Links::Direct(links) => assert!(links.add(scene.seed, &name, model), "the shape of a scene says that its links are direct"),
                        Links::Stepped(links, _) => links.add(scene.seed, &name, model.clone()),
                    }
                }
            }
        }
        let row = row_of(peers);
        let mut single = Self {
            peers,
            end: shape.end,
            links,
            in_flight: InFlight {
                ticks: Ticks::new(nanos(shape.tick)),
                wheel: Box::new(std::array::from_fn(|_| Bucket::default())),
                beyond: BTreeMap::new(),
                emptied: Vec::new(),
            },
            held: std::array::from_fn(|_| (0..peers).flat_map(|_| quads::empty(peers - 1)).collect()),
            sums: Vec::new(),
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
        if peers > EXACT_FROM {
            let held = |receiver: usize| (0..peers - 1).map(move |place| receiver * row_of(peers) + place);
            let states = |receiver: usize| held(receiver).map(|place| quads::state(&single.held, place, 0)).collect::<Vec<_>>();
            single.sums = (0..peers).map(|receiver| ExactMeans::new(states(receiver).iter())).collect();
        }
        single
    }

    /// A peer sends to all others, and then nothing until `next`, or until [`PerPacket::pass`] if that is earlier. A run that has ended goes on sending; nobody
    /// looks.
    #[inline(never)]
    #[expect(clippy::cast_possible_truncation, reason = "there are at most 4096 peers, and eight runs")]
    pub(in crate::arrays) fn send<const A: usize>(&mut self, tick: u64, (now, next): (Instant, Instant), sender: usize, bodies: &impl Bodies<A, P>) {
        let sample: Sample<P, L> = bodies.sample(sender);
        let Self { peers, links, in_flight, .. } = self;
        let (row, places) = (*peers * L, row_of(*peers));
        let packet = |place: usize, arrival: Instant, sequence: u64| {
            let (receiver, run) = (place / L, place % L);
            Packet {
                arrival,
                sequence,
                place: (receiver * places + sender - usize::from(sender > receiver)) as u32,
                receiver: receiver as u16,
                run: run as u16,
                position: std::array::from_fn(|pair| sample.position[pair][run]),
                velocity: std::array::from_fn(|pair| sample.velocity[pair][run]),
            }
        };
        match links {
            Links::Direct(links) => {
                let mut arrivals = Arrivals::NONE;
                for first in (0..row).step_by(DirectLinks::AT_ONCE) {
                    // Lanes links lead to eight receivers of one run or to one receiver of eight runs; some of them, or all, to the sender itself.
                    let own = (sender * L).wrapping_sub(first);
                    let but = if own < DirectLinks::AT_ONCE { ((1_u16 << L) - 1) << own } else { 0 };
                    links.offer(now, LinkId::new(sender * row + first), DirectLinks::AT_ONCE.min(row - first), but as u8, &mut arrivals);
                    for place in arrivals.places() {
                        let packet = packet(first + place, arrivals.at[place], arrivals.sequences[place]);
                        in_flight.push((tick, now), packet, arrivals.overtakes(place));
                    }
                }
            }
            Links::Stepped(links, info) => {
                for place in (0..row).filter(|place| place / L != sender) {
                    let link = LinkId::new(sender * row + place);
                    let packet = packet(place, now, links.offered(link));
                    // Packets leave the stages of a link in no order of their arrival.
                    links.offer((now, next), link, *info, packet, |arrival, packet| in_flight.push((tick, now), Packet { arrival, ..packet }, true));
                }
            }
        }
    }

    /// Time passes on the links of all senders until `next` of each; until the latest tick, which is this one, it has.
    #[cold]
    pub(in crate::arrays) fn pass(&mut self, latest: (u64, Instant), next: impl Fn(usize) -> Instant) {
        let Self { peers, links: Links::Stepped(links, _), in_flight, .. } = self else { return };
        let row = *peers * L;
        for (sender, place) in
            (0..*peers).flat_map(|sender| (0..row).map(move |place| (sender, place))).filter(|(sender, place)| place / L != *sender)
        {
            links.pass(next(sender), LinkId::new(sender * row + place), |arrival, packet| {
                in_flight.push(latest, Packet { arrival, ..packet }, true);
            });
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
            if let Some(sums) = self.sums.get(peer) {
                let mean = sums.mean(self.peers - 1);
                for pair in 0..P {
                    bodies.set_target(pair, peer, [mean.position[pair]; L], [mean.velocity[pair]; L]);
                }
                continue;
            }
            let quads = row_of(self.peers) / 4;
            for pair in 0..P {
                let (x, v) = quads::mean(&self.held[pair][peer * quads..(peer + 1) * quads], count);
                bodies.set_target(pair, peer, x, v);
            }
        }
    }

    /// At the end of the scene, which is at or before the tick after the latest: what has arrived by then.
    pub(in crate::arrays) fn finish(&mut self, latest: (u64, Instant)) {
        self.pass(latest, |_| Instant::MAX);
        self.take_in(latest.0 + 1, self.end);
    }

    /// Takes in the samples that are due at that tick and arrived by `until`.
    #[inline(never)]
    fn take_in(&mut self, tick: u64, until: Instant) {
        let Some(mut bucket) = self.in_flight.due(tick) else { return };
        if bucket.is_mixed {
            bucket.packets.sort_unstable_by_key(|packet| (packet.arrival, packet.sequence));
        }
        for packet in bucket.packets.drain(..) {
            if packet.arrival <= until {
                self.receive(&packet);
            }
        }
        self.in_flight.emptied.push(bucket.packets);
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
        if let Some(sums) = self.sums.get_mut(usize::from(packet.receiver)) {
            let now = State { position: packet.position, velocity: packet.velocity };
            sums.replace(&quads::state(&self.held, place, 0), &now);
        }
        for pair in 0..P {
            quads::set(&mut self.held[pair], place, run, packet.position[pair], packet.velocity[pair]);
        }
        self.changed[usize::from(packet.receiver)] |= 1 << packet.run;
    }

    /// A run ends before the end of the scene: samples still in flight in it never arrive.
    ///
    /// `sent` says when a packet of a sender was sent.
    pub(in crate::arrays) fn end_early(&mut self, run: usize, sent: impl Fn(usize, u64) -> Instant) {
        for bucket in self.in_flight.wheel.iter().chain(self.in_flight.beyond.values()) {
            for packet in bucket.packets.iter().filter(|packet| usize::from(packet.run) == run) {
                let receiver = usize::from(packet.receiver);
                let place = packet.place as usize - receiver * row_of(self.peers);
                let sender = place + usize::from(place >= receiver);
                let (link, sent) = (LinkId::new((sender * self.peers + receiver) * L + run), sent(sender, packet.sequence));
                match &mut self.links {
                    Links::Direct(links) => links.forget(link, sent, packet.arrival),
                    Links::Stepped(links, _) => links.forget(link, sent, packet.arrival),
                }
            }
        }
    }

    /// How many samples a peer received after a newer one.
    pub(in crate::arrays) fn stale_samples(&self, receiver: usize, run: usize) -> u64 {
        self.stale[receiver * L + run]
    }

    /// The counters of a link.
    pub(in crate::arrays) fn stats(&self, from: usize, to: usize, run: usize) -> LinkStats {
        let link = LinkId::new((from * self.peers + to) * L + run);
        match &self.links {
            Links::Direct(links) => links.stats(link),
            Links::Stepped(links, _) => links.stats(link),
        }
    }
}

impl<const P: usize> InFlight<P> {
    /// A packet that is known at this tick and instant; whether it may arrive in another order than it was put here.
    #[inline(always)]
    fn push(&mut self, (tick, now): (u64, Instant), packet: Packet<P>, is_mixed: bool) {
        // `now` is on the lattice of ticks, so this is the first tick at or after the arrival.
        let ticks = self.ticks.count(packet.arrival.as_nanos() - now.as_nanos());
        let due = tick.saturating_add(ticks);
        let bucket = if ticks < HORIZON { &mut self.wheel[slot(due)] } else { self.beyond.entry(due).or_default() };
        if bucket.packets.capacity() == 0 {
            bucket.packets = self.emptied.pop().unwrap_or_default();
        }
        bucket.is_mixed |= is_mixed;
        bucket.packets.push(packet);
    }

    /// The samples that are due at that tick, if there are any.
    fn due(&mut self, tick: u64) -> Option<Bucket<P>> {
        if !self.beyond.is_empty() {
            self.come_near(tick);
        }
        let bucket = std::mem::take(&mut self.wheel[slot(tick)]);
        (!bucket.packets.is_empty()).then_some(bucket)
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
