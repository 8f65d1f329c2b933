//! Samples that each arrive at an instant of their own: links that differ, jitter, loss, bursts, outages.
//!
//! Peers look at what has arrived at their ticks alone, and all tick together. So what is on the way lies in a wheel, by the tick at which it is in force, and
//! nothing is sorted but what is due together after one overtook another on its link.

use std::collections::BTreeMap;

use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_wan::{DirectLink, DropCause, LinkName, LinkStats};

use super::{Sample, mean, others};
use crate::arrays::blocks::Blocks;
use crate::arrays::eight::WIDTH;

/// Ticks ahead that lie in the wheel, a power of two; what arrives later than that is kept aside.
const HORIZON: u64 = 256;

/// The links, what is on the way, and what each peer holds of each other.
#[derive(Clone, Debug)]
pub(in crate::arrays) struct Single<const A: usize, const L: usize> {
    peers: usize,
    tick_nanos: u64,
    end: Instant,
    /// By sender, then receiver, then run; the diagonal is never used.
    links: Vec<Link>,
    wheel: Vec<Bucket<A>>,
    beyond: BTreeMap<u64, Bucket<A>>,
    /// By axis, then receiver, sender with the receiver left out, and run.
    positions: [Vec<f64>; A],
    velocities: [Vec<f64>; A],
    /// The lowest sequence number that is newer than what is held.
    next: Vec<u64>,
    changed: Vec<bool>,
    /// By receiver, then run: samples that arrived after a newer one.
    stale: Vec<u64>,
}

#[derive(Clone, Debug)]
struct Link {
    link: DirectLink,
    offered: u64,
    /// Those that arrive by the end of the scene, and their delays.
    delivered: u64,
    delay_nanos: u128,
    outage: u64,
    lost: u64,
}

/// What is in force at a tick.
#[derive(Clone, Debug, Default)]
struct Bucket<const A: usize> {
    packets: Vec<Packet<A>>,
    /// Whether one of them overtook another that may be here too.
    is_mixed: bool,
}

#[derive(Clone, Copy, Debug)]
struct Packet<const A: usize> {
    arrival: Instant,
    sequence: u64,
    sent: Instant,
    /// Where its receiver holds what it says: receiver, sender with the receiver left out, run.
    place: u32,
    receiver: u16,
    sender: u16,
    position: [f64; A],
    velocity: [f64; A],
}

impl<const A: usize, const L: usize> Single<A, L> {
    /// Everybody holds the initial states of the others, and nothing is on the way.
    pub(in crate::arrays) fn new(scenes: &[&Scene], end: Instant, tick_nanos: u64) -> Self {
        let peers = scenes[0].peers.len();
        let mut links = Vec::with_capacity(peers * peers * L);
        for from in 0..peers {
            for to in 0..peers {
                for scene in scenes {
                    // The diagonal has a link that nothing is ever sent over, so that a place is found by multiplying.
                    let (from, to) = if from == to { (0, 1) } else { (from, to) };
                    let name = LinkName::between(&scene.peers[from].name, &scene.peers[to].name);
                    let link = DirectLink::new(scene.seed, &name, scene.links.between(from, to)).expect("the shape of a scene says so");
                    links.push(Link { link, offered: 0, delivered: 0, delay_nanos: 0, outage: 0, lost: 0 });
                }
            }
        }
        let initial = |axis: usize, pick: fn(&cohaptic_peer::State<A>) -> &[f64; A]| {
            let places = (0..peers).flat_map(|receiver| (0..peers).filter(move |sender| *sender != receiver));
            places.flat_map(|sender| scenes.iter().map(move |scene| pick(&scene.initial_state(sender))[axis])).collect()
        };
        Self {
            peers,
            tick_nanos,
            end,
            links,
            wheel: vec![Bucket::default(); HORIZON as usize],
            beyond: BTreeMap::new(),
            positions: std::array::from_fn(|axis| initial(axis, |state| &state.position)),
            velocities: std::array::from_fn(|axis| initial(axis, |state| &state.velocity)),
            next: vec![0; peers * (peers - 1) * L],
            changed: vec![true; peers],
            stale: vec![0; peers * L],
        }
    }

    /// A peer sends to all others in the runs that go on.
    #[inline(always)]
    pub(in crate::arrays) fn send(&mut self, tick: u64, now: Instant, sender: usize, blocks: &Blocks<A>, goes_on: &[bool; L]) {
        let sample = Sample::<A, L>::of(blocks, sender);
        let row = self.peers * L;
        let mut first = 0;
        while first < row {
            // All draws of some packets before any other work: so a processor computes several at once.
            let end = row.min(first + WIDTH);
            let mut words = [[0; 2]; WIDTH];
            for (words, link) in words.iter_mut().zip(&self.links[sender * row + first..sender * row + end]) {
                *words = link.link.words();
            }
            for (words, number) in words.into_iter().zip(first..end) {
                let (receiver, run) = (number / L, number % L);
                if receiver != sender && goes_on[run] {
                    self.offer(tick, now, sender, receiver, run, words, &sample);
                }
            }
            first = end;
        }
    }

    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "one call, in a loop that is worth it")]
    fn offer(&mut self, tick: u64, now: Instant, sender: usize, receiver: usize, run: usize, words: [u64; 2], sample: &Sample<A, L>) {
        let link = &mut self.links[(sender * self.peers + receiver) * L + run];
        let sequence = link.offered;
        link.offered += 1;
        let arrival = match link.link.offer(now, words) {
            Ok(arrival) => arrival,
            Err(DropCause::Outage) => return link.outage += 1,
            Err(_) => return link.lost += 1,
        };
        let delay = arrival.at.as_nanos() - now.as_nanos();
        if arrival.at <= self.end {
            link.delivered += 1;
            link.delay_nanos += u128::from(delay);
        }
        // `now` is on the lattice of ticks, so this is the first tick at or after the arrival.
        let ticks = match (u32::try_from(delay), u32::try_from(self.tick_nanos)) {
            (Ok(delay), Ok(tick)) => u64::from(delay.div_ceil(tick)),
            _ => delay.div_ceil(self.tick_nanos),
        };
        let due = tick.saturating_add(ticks);
        let bucket = if ticks < HORIZON { &mut self.wheel[(due % HORIZON) as usize] } else { self.beyond.entry(due).or_default() };
        bucket.is_mixed |= arrival.overtakes;
        let place = (receiver * (self.peers - 1) + sender - usize::from(sender > receiver)) * L + run;
        bucket.packets.push(Packet {
            arrival: arrival.at,
            sequence,
            sent: now,
            place: place as u32,
            receiver: receiver as u16,
            sender: sender as u16,
            position: std::array::from_fn(|axis| sample.position[axis][run]),
            velocity: std::array::from_fn(|axis| sample.velocity[axis][run]),
        });
    }

    /// What has arrived is held from now on, and the means are those of what is held.
    #[inline(always)]
    pub(in crate::arrays) fn deliver(&mut self, tick: u64, blocks: &mut Blocks<A>) {
        self.take_in(tick, Instant::MAX);
        let count = others(self.peers);
        for peer in 0..self.peers {
            if !std::mem::take(&mut self.changed[peer]) {
                continue;
            }
            let row = (self.peers - 1) * L;
            for axis in 0..A {
                let (positions, velocities) = (&self.positions[axis][peer * row..][..row], &self.velocities[axis][peer * row..][..row]);
                blocks.set_target(axis, peer, mean::<L>(positions, count), mean::<L>(velocities, count));
            }
        }
    }

    /// At the end of the scene, which is at or before that tick: what has arrived by then.
    pub(in crate::arrays) fn finish(&mut self, tick: u64) {
        self.take_in(tick, self.end);
    }

    /// Takes in what is due at that tick and arrived by `until`.
    #[inline(always)]
    fn take_in(&mut self, tick: u64, until: Instant) {
        let place = (tick % HORIZON) as usize;
        if !self.beyond.is_empty() {
            self.come_near(tick);
        }
        let mut bucket = std::mem::take(&mut self.wheel[place]);
        if bucket.is_mixed {
            bucket.packets.sort_unstable_by_key(|packet| (packet.arrival, packet.sequence));
            bucket.is_mixed = false;
        }
        for packet in bucket.packets.drain(..) {
            if packet.arrival <= until {
                self.receive(&packet);
            }
        }
        self.wheel[place] = bucket;
    }

    /// What is due at that tick and was sent long ago.
    #[cold]
    fn come_near(&mut self, tick: u64) {
        if let Some(bucket) = self.beyond.remove(&tick) {
            let near = &mut self.wheel[(tick % HORIZON) as usize];
            near.packets.extend(bucket.packets);
            near.is_mixed = true;
        }
    }

    #[inline(always)]
    fn receive(&mut self, packet: &Packet<A>) {
        let place = packet.place as usize;
        if packet.sequence < self.next[place] {
            self.stale[usize::from(packet.receiver) * L + place % L] += 1;
            return;
        }
        self.next[place] = packet.sequence + 1;
        for axis in 0..A {
            self.positions[axis][place] = packet.position[axis];
            self.velocities[axis][place] = packet.velocity[axis];
        }
        self.changed[usize::from(packet.receiver)] = true;
    }

    /// A run ends before the end of the scene: what is still on the way in it never arrives.
    pub(in crate::arrays) fn end_early(&mut self, run: usize) {
        for bucket in self.wheel.iter().chain(self.beyond.values()) {
            for packet in &bucket.packets {
                if packet.place as usize % L == run && packet.arrival <= self.end {
                    let link = &mut self.links[(usize::from(packet.sender) * self.peers + usize::from(packet.receiver)) * L + run];
                    link.delivered -= 1;
                    link.delay_nanos -= u128::from(packet.arrival.as_nanos() - packet.sent.as_nanos());
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
        let Link { offered, delivered, delay_nanos, outage, lost, .. } = self.links[(from * self.peers + to) * L + run];
        LinkStats::counted(offered, delivered, delay_nanos, [(DropCause::Outage, outage), (DropCause::Loss, lost)])
    }
}
