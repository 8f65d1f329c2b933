//! Samples that each arrive at an instant of their own: links that differ, jitter, loss, bursts, outages.
//!
//! Peers look at what has arrived at their ticks alone, and all tick together. So samples in flight lie in a wheel, by the tick at which it is in force, and
//! nothing is sorted but the samples that are due together on a link on which one overtook another.

mod neighbours;

use std::ops::Range;

use cohaptic_peer::{EXACT_FROM, ExactMeans, Moving, State};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_wan::{Arrivals, DirectLinks, LinkId, LinkModel, LinkName, LinkStats, PacketInfo, SteppedLinks};
use pulp::NullaryFnOnce;

use super::in_flight::{Bucket, InFlight, Packet};
use super::quads::{self, Quad};
use super::rows::Rows;
use super::{Sample, count};
use crate::arrays::blocks::Blocks;
use crate::arrays::processor::on_widest;
use crate::arrays::shape::Way;
use crate::arrays::{Shape, nanos};

/// Set in the sequence number of a link on which one of the samples that are due overtakes another.
const IS_OVERTAKEN: u64 = 1 << 63;
/// Samples whose memory is asked for at once.
const TAKEN_TOGETHER: usize = 16;

/// The links to some peers, the samples in flight to them, and those that each of them holds of each other peer.
///
/// Work goes from receiver to receiver: what one holds lies together, and receivers may be shared out among threads.
#[derive(Clone, Debug)]
pub(in crate::arrays) struct PerPacket<const A: usize, const L: usize> {
    rows: Rows,
    /// The receivers, counted from 0 below.
    receivers: Range<usize>,
    end: Instant,
    /// By receiver, then sender, then run, as [`Rows`] says.
    links: Links<A>,
    /// Whether each peer of the scene sends now.
    sends: Vec<bool>,
    in_flight: InFlight<A>,
    /// Samples held, by axis, then receiver, then sender. Each receiver has whole quads, of which the last may be empty.
    held: [Vec<Quad<L>>; A],
    /// By receiver the sums of its samples, if its mean is exact: then there is one run. Empty if no mean is.
    sums: Vec<Option<ExactMeans<A>>>,
    /// By place, then run: the lowest sequence number that is newer than the sample held.
    next: Vec<u64>,
    /// By receiver: bit r says whether a sample has arrived in run r since the means were computed.
    changed: Vec<u8>,
    /// By receiver, then run: samples that arrived after a newer one.
    stale: Vec<u64>,
}

/// The links.
#[derive(Clone, Debug)]
enum Links<const A: usize> {
    Direct(DirectLinks),
    /// They are told when each sender sends next. Only in single runs: scenes side by side have direct links, and `const { L > 1 }` spares the compiler the rest.
    Stepped(SteppedLinks<State<A>>),
}

impl<const A: usize, const L: usize> PerPacket<A, L> {
    /// The receivers hold the initial states of the others, and nothing is on the way.
    pub(in crate::arrays) fn new(scenes: &[&Scene], initial: &[Sample<A, L>], shape: &Shape, receivers: Range<usize>) -> Self {
        let peers = scenes[0].peers.len();
        let info = PacketInfo { size: shape.load.size, ecn_capable: true };
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
                // The diagonal has a link that nothing is ever sent over, so that a place is found by multiplying.
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
        let mut samples = Self {
            end: shape.end,
            links,
            sends: vec![false; peers],
            in_flight: InFlight::new(nanos(shape.tick)),
            held: std::array::from_fn(|_| quads::empty(places)),
            sums: Vec::new(),
            next: vec![0; places * L],
            changed: vec![u8::MAX; count],
            stale: vec![0; count * L],
            receivers,
            rows,
        };
        let Self { rows, held, .. } = &mut samples;
        for (receiver, place) in (0..count).flat_map(|receiver| rows.held(receiver).map(move |place| (receiver, place))) {
            let column = rows.column_of(receiver, place);
            let (sample, weight) = (&initial[rows.sender(receiver, column)], rows.weight(receiver, column));
            let weighed = |number: f64| weight.map_or(number, |weight| number * weight);
            for (axis, run) in (0..A).flat_map(|axis| (0..L).map(move |run| (axis, run))) {
                quads::set(&mut held[axis], place, run, weighed(sample.position[axis][run]), weighed(sample.velocity[axis][run]));
            }
        }
        if (0..count).any(|receiver| rows.held(receiver).len() >= EXACT_FROM) {
            let states = |receiver: usize| rows.held(receiver).map(|place| quads::state(held, place, 0)).collect::<Vec<_>>();
            let sums = |receiver: usize| (rows.held(receiver).len() >= EXACT_FROM).then(|| ExactMeans::new(states(receiver).iter()));
            samples.sums = (0..count).map(sums).collect();
        }
        samples
    }

    /// Some peers send to all that hear them what `sent` has in their places, and then nothing until `next` of each, or until [`PerPacket::pass`] if that is earlier.
    /// A run that has ended goes on sending; nobody looks.
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
        let Self { rows, receivers, links, sends, in_flight, .. } = self;
        match links {
            Links::Direct(links) => {
                sends.fill(false);
                senders.iter().for_each(|sender| sends[*sender] = true);
                let (receivers, sends) = (receivers.clone(), &**sends);
                // Eight links of which two are used take longer than two.
                let (are_few, are_chains) = (L == 1 && senders.len() * 4 < peers, links.are_chains());
                let sending = DirectSending { peers, receivers, links, senders, sends, sent, in_flight, at: (tick, now) };
                match are_chains {
                    _ if are_few => on_widest(processor, BySender(sending)),
                    true => on_widest(processor, ByChain(sending)),
                    false => on_widest(processor, ByLink(sending)),
                }
            }
            Links::Stepped(_) if const { L > 1 } => {}
            Links::Stepped(links) => {
                for ((receiver, peer), sender) in receivers.clone().enumerate().flat_map(|to| senders.iter().map(move |from| (to, *from))) {
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

    /// Time passes on the links of all senders until `next` of each; until the latest tick, which is this one, it has.
    #[cold]
    pub(in crate::arrays) fn pass(&mut self, latest: (u64, Instant), next: &dyn Fn(usize) -> Instant) {
        if const { L > 1 } {
            return;
        }
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

    /// The other peers that a receiver hears.
    pub(in crate::arrays) fn senders(&self, receiver: usize) -> impl Iterator<Item = usize> + '_ {
        let senders = (0..self.rows.columns(receiver)).map(move |column| self.rows.sender(receiver, column));
        senders.filter(move |sender| *sender != self.receivers.start + receiver)
    }

    /// In runs of these scenes a link to one of the receivers is another one from an instant on, which is not before the latest tick.
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

    /// What has arrived is held from now on.
    #[inline(always)]
    pub(in crate::arrays) fn deliver(&mut self, tick: u64) {
        if let Some(bucket) = self.in_flight.due(tick) {
            self.take_in(bucket);
        }
    }

    /// How what a peer holds in a run moves on, in the order in which the peer holds it. `sent` says when a sample of a sender was sent.
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

    /// Whether anything that a peer holds in a run has changed since the means were computed.
    pub(in crate::arrays) fn has_changed(&self, peer: usize, run: usize) -> bool {
        self.changed[peer] & (1 << run) != 0
    }

    /// The means are those of the samples held.
    #[inline(always)]
    pub(in crate::arrays) fn refresh(&mut self, blocks: &mut Blocks) {
        // Ten peers hear something new in seven of ten ticks: to ask for each of them how rows lie took 2 % of a run.
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

    /// [`PerPacket::refresh`] where peers hear different numbers of others, or means are exact.
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
            let (quads, count) = (places.start / 4..places.end.div_ceil(4), count(places.len()));
            for (axis, held) in held.iter().enumerate() {
                let (x, v) = quads::mean(&held[quads.clone()], count);
                blocks.set_target(axis, peer, x, v);
            }
        }
    }

    /// At the end of the scene, which is at or before the tick after the latest: what has arrived by then.
    pub(in crate::arrays) fn finish(&mut self, latest: (u64, Instant)) {
        self.pass(latest, &|_| Instant::MAX);
        if let Some(mut bucket) = self.in_flight.due(latest.0 + 1) {
            for packets in [&mut bucket.in_order, &mut bucket.overtaking] {
                packets.retain(|packet| packet.arrival <= self.end);
            }
            self.take_in(bucket);
        }
    }

    /// Takes in samples that have arrived.
    ///
    /// The order among links does not matter: of each link the newest sample stays, and sums of samples are exact. So samples are taken in as they lie, from
    /// receiver to receiver, but for those on links on which one overtakes another: those come last, in order. To sort all of them took two thirds of the time
    /// of a thousand peers, and left them in an order in which each missed the cache.
    #[inline(never)]
    fn take_in(&mut self, mut bucket: Bucket<A>) {
        for packet in &bucket.overtaking {
            self.next[packet.place as usize] |= IS_OVERTAKEN;
        }
        let overtaking = bucket.overtaking.len();
        // Where no mean is exact there are no sums: to look for one took 1 % of a run of ten peers.
        match self.sums.is_empty() {
            true => self.take_in_order(&mut bucket),
            false => self.take_in_together(&mut bucket),
        }
        if overtaking > 0 {
            self.take_in_overtaking(&mut bucket.overtaking, overtaking);
        }
        self.in_flight.reuse(bucket);
    }

    /// Takes in the samples of the links on which none overtakes; puts the others behind those that overtake.
    #[inline(always)]
    fn take_in_order(&mut self, bucket: &mut Bucket<A>) {
        for packet in &bucket.in_order {
            if self.is_newest(packet, &mut bucket.overtaking) {
                self.hold(packet);
            }
        }
    }

    /// [`PerPacket::take_in_order`] where means are exact, and samples held are more than a cache has room for: some samples at once, whose memory is asked for before any
    /// of them is added to a sum. One by one took 5 % longer for a thousand peers.
    #[inline(always)]
    fn take_in_together(&mut self, bucket: &mut Bucket<A>) {
        for packets in bucket.in_order.chunks(TAKEN_TOGETHER) {
            let (mut newest, mut count) = ([0; TAKEN_TOGETHER], 0);
            for (place, packet) in packets.iter().enumerate() {
                newest[count] = place;
                count += usize::from(self.is_newest(packet, &mut bucket.overtaking));
            }
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

    /// Whether a sample is newer than the one held, which it is from then on; puts one of a link on which some overtake behind those.
    #[inline(always)]
    fn is_newest(&mut self, packet: &Packet<A>, overtaking: &mut Vec<Packet<A>>) -> bool {
        let next = &mut self.next[packet.place as usize];
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

    /// Takes in all samples of the links on which some overtake, which are the first ones.
    fn take_in_overtaking(&mut self, packets: &mut [Packet<A>], overtaking: usize) {
        for packet in &packets[..overtaking] {
            self.next[packet.place as usize] &= !IS_OVERTAKEN;
        }
        packets.sort_unstable_by_key(|packet| (packet.arrival, packet.sequence));
        for packet in &*packets {
            self.take_in_one(packet);
        }
    }

    /// Takes in a sample after all that arrived before it.
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

    /// A sample takes the place of the one before it in the sums of its receiver, if there are any.
    #[inline(always)]
    fn replace(&mut self, before: &State<A>, packet: &Packet<A>) {
        if let Some(Some(sums)) = self.sums.get_mut(usize::from(packet.receiver)) {
            sums.replace(before, &State { position: packet.position, velocity: packet.velocity });
        }
    }

    /// A sample is held.
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
        self.stale[usize::from(packet.receiver) * L + packet.place as usize % L] += 1;
    }

    /// A run ends at an instant before the end of the scene: samples still in flight in it never arrive, and links do nothing more.
    ///
    /// `sent` says when a packet of a sender was sent.
    pub(in crate::arrays) fn end_early(&mut self, run: usize, at: Instant, sent: impl Fn(usize, u64) -> Instant) {
        if let Links::Stepped(links) = &mut self.links {
            // There is one run.
            links.stop(at);
        }
        for packet in self.in_flight.iter().filter(|packet| packet.place as usize % L == run) {
            let receiver = usize::from(packet.receiver);
            let column = self.rows.column_of(receiver, packet.place as usize / L);
            let sent = sent(self.rows.sender(receiver, column), packet.sequence);
            let link = LinkId::new(self.rows.link(receiver, column) * L + run);
            match &mut self.links {
                Links::Direct(links) => links.forget(link, sent, packet.arrival),
                Links::Stepped(links) => links.forget(link, sent, packet.arrival),
            }
        }
    }

    /// How many samples a peer received after a newer one.
    pub(in crate::arrays) fn stale_samples(&self, receiver: usize, run: usize) -> u64 {
        self.stale[receiver * L + run]
    }

    /// The counters of the link from a peer to a receiver, if there is one.
    pub(in crate::arrays) fn stats(&self, from: usize, receiver: usize, run: usize) -> Option<LinkStats> {
        let link = LinkId::new(self.rows.link(receiver, self.rows.column(receiver, from)?) * L + run);
        Some(match &self.links {
            Links::Direct(links) => links.stats(link),
            Links::Stepped(links) => links.stats(link),
        })
    }
}

/// The packets of a tick over links that know at once when each arrives, between all peers.
///
/// Compiled for any processor and for one that has AVX2, whose instructions take 2 % off a run of ten peers over links with jitter and loss.
struct DirectSending<'a, const A: usize, const L: usize> {
    /// Of the scene.
    peers: usize,
    receivers: Range<usize>,
    links: &'a mut DirectLinks,
    senders: &'a [usize],
    /// Whether each peer of the scene is one of them.
    sends: &'a [bool],
    sent: &'a [Sample<A, L>],
    in_flight: &'a mut InFlight<A>,
    at: (u64, Instant),
}

/// One function for each way: two in one have too few registers, and take ten instructions more for a packet of links with jitter and loss.
struct BySender<'a, const A: usize, const L: usize>(DirectSending<'a, A, L>);
struct ByChain<'a, const A: usize, const L: usize>(DirectSending<'a, A, L>);
struct ByLink<'a, const A: usize, const L: usize>(DirectSending<'a, A, L>);

impl<const A: usize, const L: usize> NullaryFnOnce for BySender<'_, A, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.by_sender();
    }
}

impl<const A: usize, const L: usize> NullaryFnOnce for ByChain<'_, A, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.by_link::<true>();
    }
}

impl<const A: usize, const L: usize> NullaryFnOnce for ByLink<'_, A, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.by_link::<false>();
    }
}

impl<const A: usize, const L: usize> DirectSending<'_, A, L> {
    /// Link by link, those to one receiver after those to another, without a gap: ten links to each of ten receivers are thirteen times eight, and not twenty
    /// times eight or fewer. It took 3 % off a run of ten peers, and 9 % off one of three.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "the bits of eight links")]
    fn by_link<const CHAINS: bool>(self) {
        let Self { peers, receivers, links, senders, sends, sent, in_flight, at } = self;
        let (row, all_send) = (peers * L, senders.len() == peers);
        let count = receivers.len() * row;
        // The next link from a receiver to itself; the receiver of the link looked at, and where its row ends.
        let (mut own, mut receiver, mut end) = (receivers.start * L, 0, row);
        let mut arrivals = Arrivals::NONE;
        for first in (0..count).step_by(DirectLinks::AT_ONCE) {
            let mut but = 0_u8;
            while own < first + DirectLinks::AT_ONCE {
                but |= (((1_u16 << L) - 1) << (own - first)) as u8;
                own += row + L;
            }
            while first >= end {
                (receiver, end) = (receiver + 1, end + row);
            }
            let together = DirectLinks::AT_ONCE.min(count - first);
            if !all_send {
                for place in (0..together).filter(|place| !sends[(first + place + row - end) % row / L]) {
                    but |= 1 << place;
                }
            }
            links.offer_as::<CHAINS>(at.1, LinkId::new(first), together, but, &mut arrivals);
            for place in arrivals.places() {
                while first + place >= end {
                    (receiver, end) = (receiver + 1, end + row);
                }
                let to = (receiver, receivers.start + receiver);
                let packet = packet(peers, to, first + place + row - end, sent, arrivals.at[place], arrivals.sequences[place]);
                in_flight.push(at, packet, arrivals.overtakes(place));
            }
        }
    }

    /// Sender by sender, in one run.
    #[inline(always)]
    fn by_sender(self) {
        let Self { peers, receivers, links, senders, sent, in_flight, at, .. } = self;
        for sender in senders {
            for to in receivers.clone().enumerate().filter(|(_, peer)| peer != sender) {
                let link = LinkId::new(to.0 * peers + sender);
                let sequence = links.offered(link);
                if let Some((arrival, overtakes)) = links.offer_one(at.1, link) {
                    in_flight.push(at, packet(peers, to, *sender, sent, arrival, sequence), overtakes);
                }
            }
        }
    }
}

/// The packet over a link to a receiver, which is that peer of the scene, if all hear all. Links are counted by sender, then run.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "peers are counted in 16 bits, what they hold in 32")]
fn packet<const A: usize, const L: usize>(
    peers: usize,
    (receiver, peer): (usize, usize),
    link: usize,
    sent: &[Sample<A, L>],
    arrival: Instant,
    sequence: u64,
) -> Packet<A> {
    let (sender, run) = (link / L, link % L);
    let sample = &sent[sender];
    Packet {
        arrival,
        sequence,
        place: ((receiver * (peers - 1).next_multiple_of(4) + sender - usize::from(sender > peer)) * L + run) as u32,
        receiver: receiver as u16,
        position: std::array::from_fn(|axis| sample.position[axis][run]),
        velocity: std::array::from_fn(|axis| sample.velocity[axis][run]),
    }
}
