//! Samples with separate instants of arrival: different links, jitter, loss, bursts, outages.
//!
//! Peers read arrived samples only at ticks, and all peers tick together. Samples in flight therefore lie in a timing wheel indexed by the tick of their
//! arrival. Nothing is sorted but samples with an arrival at the same tick over a link with overtaking samples.

mod direct;
mod neighbours;

use std::ops::Range;

use cohaptic_peer::{EXACT_FROM, ExactMeans, Moving, State};
use cohaptic_scene::Scene;
use cohaptic_units::{Ecn, Instant};
use cohaptic_wan::{DirectLinks, LinkId, LinkModel, LinkName, LinkStats, PacketInfo, SteppedLinks};

use direct::{ByChain, ByLink, BySender, DirectSending, InOrder};

use super::in_flight::{Bucket, InFlight, Packet};
use super::quads::{self, Quad};
use super::rows::Rows;
use super::{Sample, count};
use crate::arrays::blocks::Blocks;
use crate::arrays::processor::on_widest;
use crate::arrays::shape::Way;
use crate::arrays::{Shape, nanos};

/// Flag in an entry of `next`: a sample of this tick and this link overtook an earlier sample.
const IS_OVERTAKEN: u64 = 1 << 63;
/// Number of samples taken in at once by [`PerPacket::take_in_together`].
const TAKEN_TOGETHER: usize = 16;

/// Links to some peers, samples in flight to these peers, and samples of every other peer held by each of these peers.
///
/// The arrays are ordered by receiver: the held samples of a receiver are contiguous, and receivers can be shared out among threads.
#[derive(Clone, Debug)]
pub(in crate::arrays) struct PerPacket<const A: usize, const L: usize> {
    rows: Rows,
    /// Receiving peers of the scene. Elsewhere in this type, receivers are counted from 0.
    receivers: Range<usize>,
    /// End of the scene.
    end: Instant,
    /// Links, ordered by receiver, then sender, then run; see [`Rows`].
    links: Links<A>,
    /// `true` if a peer sends at the present tick, indexed by peer of the scene.
    sends: Vec<bool>,
    in_flight: InFlight<A>,
    /// Index of the latest packet of a link that keeps the order, indexed by link: see [`InFlight::push_in_order`]. Links are counted as in `links`.
    latest: Vec<u32>,
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
}

/// Links in the form required by the shape's [`Way`].
#[derive(Clone, Debug)]
enum Links<const A: usize> {
    /// Links with the fate of a packet decided at its sending.
    Direct(DirectLinks),
    /// Links that need the instant of the sender's next packet. Only in single runs: scenes side by side have direct links, and `const { L > 1 }` keeps the
    /// compiler from generating this case.
    Stepped(SteppedLinks<State<A>>),
}

impl<const A: usize, const L: usize> PerPacket<A, L> {
    /// Returns the state before the first tick: receivers hold the initial states of the other peers, and nothing is in flight.
    pub(in crate::arrays) fn new(scenes: &[&Scene], initial: &[Sample<A, L>], shape: &Shape, receivers: Range<usize>) -> Self {
        let peers = scenes[0].peers.len();
        let info = PacketInfo { size: shape.load.size, ecn: Ecn::Capable0 };
        let mut links = match shape.way {
            Way::Direct => Links::Direct(DirectLinks::new(shape.end, shape.load)),
            Way::Stepped => {
                assert!(L == 1, "scenes whose fates are not known as packets are sent run one by one");
                Links::Stepped(SteppedLinks::new(shape.end, info))
            }
        };
        let rows = Rows::new(peers, shape.topology.as_ref(), receivers.clone());
        for (receiver, to) in receivers.clone().enumerate() {
            for (from, scene) in (0..rows.columns(receiver)).flat_map(|column| scenes.iter().map(move |scene| (column, scene))) {
                let from = rows.sender(receiver, from);
                // A receiver's link to itself is never used and may have any model. The link exists because indices are products.
                let (from, to) = if from == to { (0, 1) } else { (from, to) };
                let name = LinkName::between(&scene.peers[from].name, &scene.peers[to].name);
                let model: &LinkModel = scene.links.between(from, to);
                match &mut links {
                    Links::Direct(links) => assert!(links.add(scene.seed, &name, model), "the shape of a scene says that its links are direct"),
                    Links::Stepped(links) => links.add(scene.seed, &name, model),
                }
            }
        }
        let count = receivers.len();
        let places = rows.places(count);
        // Only links from all peers are computed together in one loop.
        let indexed = if let Rows::All { peers, .. } = rows { count * peers * L } else { 0 };
        let mut samples = Self {
            end: shape.end,
            links,
            sends: vec![false; peers],
            in_flight: InFlight::new(nanos(shape.tick)),
            latest: vec![0; if shape.way == Way::Direct { indexed } else { 0 }],
            held: std::array::from_fn(|_| quads::empty(places)),
            sums: Vec::new(),
            next: vec![0; places * L],
            changed: vec![u8::MAX; count],
            stale: vec![0; count * L],
            receivers,
            rows,
        };
        let Self { rows, held, .. } = &mut samples;
        // A held sample is stored with its weight, as `Rows::packet` weighs arriving samples.
        for (receiver, place) in (0..count).flat_map(|receiver| rows.held(receiver).map(move |place| (receiver, place))) {
            let column = rows.column_of(receiver, place);
            let (sample, weight) = (&initial[rows.sender(receiver, column)], rows.weight(receiver, column));
            let weighed = |number: f64| weight.map_or(number, |weight| number * weight);
            for (axis, run) in (0..A).flat_map(|axis| (0..L).map(move |run| (axis, run))) {
                quads::set(&mut held[axis], place, run, weighed(sample.position[axis][run]), weighed(sample.velocity[axis][run]));
            }
        }
        // With many samples the sums are kept exactly, so a single arrival costs one replacement instead of a sum over all held samples.
        if (0..count).any(|receiver| rows.held(receiver).len() >= EXACT_FROM) {
            let states = |receiver: usize| rows.held(receiver).map(|place| quads::state(held, place, 0)).collect::<Vec<_>>();
            let sums = |receiver: usize| (rows.held(receiver).len() >= EXACT_FROM).then(|| ExactMeans::new(states(receiver).iter()));
            samples.sums = (0..count).map(sums).collect();
        }
        samples
    }

    /// Sends the samples of `senders` to all receivers in their reach. `sent` holds samples indexed by peer of the scene. Each sender sends nothing further
    /// until its `next` instant; before that, only [`PerPacket::pass`] changes the links.
    ///
    /// An ended run goes on sending, because lanes cannot stop one by one; the results of the run are no longer read.
    #[inline(never)]
    pub(in crate::arrays) fn send(
        &mut self,
        processor: pulp::Arch,
        (tick, now): (u64, Instant),
        senders: &[usize],
        sent: &[Sample<A, L>],
        next: impl Fn(usize) -> Instant,
    ) {
        let Rows::All { peers, .. } = self.rows else {
            return self.send_to_neighbours((tick, now), senders, sent, next);
        };
        let Self { rows, receivers, links, sends, in_flight, latest, .. } = self;
        match links {
            Links::Direct(links) => {
                // `sends` has the senders as flags, for the link-by-link ways.
                sends.fill(false);
                senders.iter().for_each(|sender| sends[*sender] = true);
                let (receivers, sends) = (receivers.clone(), &**sends);
                // Links are computed eight at a time. This does not pay if few of eight carry a packet.
                let (are_few, are_chains, keep_order) = (L == 1 && senders.len() * 4 < peers, links.are_chains(), links.keep_order());
                let sending = DirectSending { peers, receivers, links, senders, sends, sent, in_flight, latest, at: (tick, now) };
                match are_chains {
                    _ if are_few => on_widest(processor, BySender(sending)),
                    true => on_widest(processor, ByChain(sending)),
                    false if keep_order => on_widest(processor, InOrder(sending)),
                    false => on_widest(processor, ByLink(sending)),
                }
            }
            Links::Stepped(_) if const { L > 1 } => {}
            Links::Stepped(links) => {
                for ((receiver, peer), sender) in receivers.clone().enumerate().flat_map(|to| senders.iter().map(move |from| (to, *from))) {
                    // A peer hears itself without a link.
                    if sender == peer {
                        continue;
                    }
                    for run in 0..L {
                        let link = LinkId::new((receiver * peers + sender) * L + run);
                        links.offer((now, next(sender)), link, sent[sender].state(run), |arrival, overtakes, sequence, state| {
                            in_flight.push((tick, now), rows.packet::<A, L>((receiver, sender, run), &state, arrival, sequence), overtakes);
                        });
                    }
                }
            }
        }
    }

    /// Advances the links of all senders until the `next` instant of each sender. `latest` is the latest computed tick, with its instant.
    #[cold]
    pub(in crate::arrays) fn pass(&mut self, latest: (u64, Instant), next: &dyn Fn(usize) -> Instant) {
        if const { L > 1 } {
            return;
        }
        // Direct links have decided all fates at sending and have nothing to advance.
        let Self { rows, receivers, links: Links::Stepped(links), in_flight, .. } = self else { return };
        for (receiver, peer) in receivers.clone().enumerate() {
            for column in (0..rows.columns(receiver)).filter(|column| rows.sender(receiver, *column) != peer) {
                let (next, first) = (next(rows.sender(receiver, column)), rows.link(receiver, column) * L);
                for run in 0..L {
                    links.pass(next, LinkId::new(first + run), &mut |arrival, overtakes, sequence, state| {
                        in_flight.push(latest, rows.packet::<A, L>((receiver, column, run), &state, arrival, sequence), overtakes);
                    });
                }
            }
        }
    }

    /// Returns the heard peers of a receiver, by index in the scene.
    pub(in crate::arrays) fn senders(&self, receiver: usize) -> impl Iterator<Item = usize> + '_ {
        let senders = (0..self.rows.columns(receiver)).map(move |column| self.rows.sender(receiver, column));
        senders.filter(move |sender| *sender != self.receivers.start + receiver)
    }

    /// Replaces the model of the link from `from` to the receiver `to`, both peers of the scene, from the instant `at` on. `at` is not before the latest tick.
    #[cold]
    pub(in crate::arrays) fn set_link(
        &mut self,
        (latest, at): ((u64, Instant), Instant),
        scenes: &[&Scene; L],
        (from, to): (usize, usize),
        model: &LinkModel,
    ) {
        if const { L > 1 } {
            return;
        }
        let Self { rows, receivers, links: Links::Stepped(links), in_flight, .. } = self else { return };
        let receiver = to - receivers.start;
        let Some(column) = rows.column(receiver, from) else { return };
        for (run, scene) in scenes.iter().enumerate() {
            let link = LinkId::new(rows.link(receiver, column) * L + run);
            let name = LinkName::between(&scene.peers[from].name, &scene.peers[to].name);
            links.set_model(at, link, (scene.seed, &name), model.clone(), &mut |arrival, overtakes, sequence, state| {
                in_flight.push(latest, rows.packet::<A, L>((receiver, column, run), &state, arrival, sequence), overtakes)
            });
        }
    }

    /// Takes in the samples arrived by `tick`.
    #[inline(always)]
    pub(in crate::arrays) fn deliver(&mut self, tick: u64) {
        if let Some(bucket) = self.in_flight.due(tick) {
            self.take_in(bucket);
        }
    }

    /// Returns the instant and the velocity of each held sample of a peer in a run, in the order of the peer. `sent` returns the instant of sending of the
    /// sample with a sequence number of a sender.
    pub(in crate::arrays) fn moving(&self, (peer, run): (usize, usize), sent: impl Fn(usize, u64) -> Instant) -> impl Iterator<Item = Moving<A>> {
        self.rows.held(peer).map(move |place| {
            let sender = self.rows.sender(peer, self.rows.column_of(peer, place));
            let newest = self.next[place * L + run].checked_sub(1);
            Moving {
                sent: newest.map_or(Instant::ZERO, |newest| sent(sender, newest)),
                velocity: std::array::from_fn(|axis| quads::velocity(&self.held[axis], place, run)),
            }
        })
    }

    /// Returns whether any held sample of a peer in a run has changed since the means were computed.
    pub(in crate::arrays) fn has_changed(&self, peer: usize, run: usize) -> bool {
        self.changed[peer] & (1 << run) != 0
    }

    /// Computes the means of the receivers with a new sample.
    #[inline(always)]
    pub(in crate::arrays) fn refresh(&mut self, blocks: &mut Blocks) {
        // The usual case first: rows of equal length at computed offsets, without a question for each receiver.
        let Rows::All { peers, .. } = self.rows else { return self.refresh_unequal(blocks) };
        if !self.sums.is_empty() {
            return self.refresh_unequal(blocks);
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

    /// Like [`PerPacket::refresh`], for receivers with different numbers of heard peers or with exact means.
    #[inline(never)]
    fn refresh_unequal(&mut self, blocks: &mut Blocks) {
        let Self { rows, held, sums, changed, .. } = self;
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

    /// Takes in the samples arrived by the end of the scene. The end is at or before the tick after `latest`.
    pub(in crate::arrays) fn finish(&mut self, latest: (u64, Instant)) {
        self.pass(latest, &|_| Instant::MAX);
        // The bucket belongs to the tick at or after the end. Packets with an arrival between the end and this tick are removed.
        if let Some(mut bucket) = self.in_flight.due(latest.0 + 1) {
            for packets in [&mut bucket.in_order, &mut bucket.overtaking] {
                packets.retain(|packet| packet.arrival <= self.end);
            }
            self.take_in(bucket);
        }
    }

    /// Takes in arrived samples.
    ///
    /// The order among links does not matter: of each link the newest sample stays, and sums of samples are exact. Samples are therefore taken in unsorted,
    /// from receiver to receiver. Samples of links with overtaking come last, sorted, because their order decides which samples are stale.
    #[inline(never)]
    fn take_in(&mut self, mut bucket: Bucket<A>) {
        // Mark the links first: the samples of marked links in `in_order` must wait for the sorted pass too.
        for packet in &bucket.overtaking {
            self.next[packet.place as usize] |= IS_OVERTAKEN;
        }
        // Samples appended below belong to marked links, but did not mark the links.
        let overtaking = bucket.overtaking.len();
        // Without exact means there are no sums to update.
        match self.sums.is_empty() {
            true => self.take_in_order(&mut bucket),
            false => self.take_in_together(&mut bucket),
        }
        if overtaking > 0 {
            self.take_in_overtaking(&mut bucket.overtaking, overtaking);
        }
        self.in_flight.reuse(bucket);
    }

    /// Takes in the samples of links without overtaking. Appends the other samples to `bucket.overtaking`.
    #[inline(always)]
    fn take_in_order(&mut self, bucket: &mut Bucket<A>) {
        for packet in &bucket.in_order {
            if self.is_newest(packet, &mut bucket.overtaking) {
                self.hold(packet);
            }
        }
    }

    /// Like [`PerPacket::take_in_order`], for exact means. Takes in several samples at once, so the reads of held samples overlap before the sums need the
    /// samples: these samples are more than a cache holds.
    #[inline(always)]
    fn take_in_together(&mut self, bucket: &mut Bucket<A>) {
        for packets in bucket.in_order.chunks(TAKEN_TOGETHER) {
            let (mut newest, mut count) = ([0; TAKEN_TOGETHER], 0);
            for (place, packet) in packets.iter().enumerate() {
                // Written in any case and counted only if newest: no branch.
                newest[count] = place;
                count += usize::from(self.is_newest(packet, &mut bucket.overtaking));
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

    /// Returns whether a sample is newer than the held sample, and notes its sequence number if so. Appends a sample of a marked link to `overtaking`.
    #[inline(always)]
    fn is_newest(&mut self, packet: &Packet<A>, overtaking: &mut Vec<Packet<A>>) -> bool {
        let next = &mut self.next[packet.place as usize];
        // A marked entry has its top bit set, so no sequence number reaches it.
        let is_newest = packet.sequence >= *next;
        if is_newest {
            *next = packet.sequence + 1;
        } else if *next & IS_OVERTAKEN == 0 {
            self.count_stale(packet);
        } else {
            overtaking.push(*packet);
        }
        is_newest
    }

    /// Takes in all samples of marked links, in the order of arrival. The first `overtaking` packets have marked their links.
    fn take_in_overtaking(&mut self, packets: &mut [Packet<A>], overtaking: usize) {
        for packet in &packets[..overtaking] {
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

    /// Ends a run at the instant `at` before the end of the scene: samples still in flight never arrive, and links do nothing more.
    ///
    /// `sent` returns the instant of sending of a packet of a sender, by its sequence number.
    pub(in crate::arrays) fn end_early(&mut self, run: usize, at: Instant, sent: impl Fn(usize, u64) -> Instant) {
        if let Links::Stepped(links) = &mut self.links {
            // Stepped links exist in single runs only, so stopping all links stops this run only.
            links.stop(at);
        }
        // The counters must not contain packets in flight at the end: each is taken back from its link.
        for packet in self.in_flight.iter().filter(|packet| packet.place as usize % L == run) {
            let receiver = usize::from(packet.receiver);
            let column = self.rows.column_of(receiver, packet.place as usize / L);
            let (sender, link) = (self.rows.sender(receiver, column), LinkId::new(self.rows.link(receiver, column) * L + run));
            for sequence in packet.sequence - u64::from(packet.stands_for)..=packet.sequence {
                let sent = sent(sender, sequence);
                match &mut self.links {
                    Links::Direct(links) => links.forget(link, sent, packet.arrival),
                    Links::Stepped(links) => links.forget(link, sent, packet.arrival),
                }
            }
        }
    }

    /// Returns the number of samples taken in by a receiver after a newer sample.
    pub(in crate::arrays) fn stale_samples(&self, receiver: usize, run: usize) -> u64 {
        self.stale[receiver * L + run]
    }

    /// Returns the counters of the link from a peer of the scene to a receiver; `None` if there is no link.
    pub(in crate::arrays) fn stats(&self, from: usize, receiver: usize, run: usize) -> Option<LinkStats> {
        let link = LinkId::new(self.rows.link(receiver, self.rows.column(receiver, from)?) * L + run);
        Some(match &self.links {
            Links::Direct(links) => links.stats(link),
            Links::Stepped(links) => links.stats(link),
        })
    }
}
