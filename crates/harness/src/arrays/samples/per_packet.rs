//! Samples with separate instants of arrival: different links, jitter, loss, bursts, outages.
//!
//! Peers read arrived samples only at ticks, and all peers tick together. Samples in flight therefore lie in a timing wheel indexed by the tick of their
//! arrival. Nothing is sorted but samples with an arrival at the same tick over a link with overtaking samples.

mod direct;
mod neighbours;
mod received;

use std::ops::Range;

use cohaptic_peer::{Moving, State};
use cohaptic_scene::Scene;
use cohaptic_units::{Ecn, Instant};
use cohaptic_wan::{DirectLinks, LinkId, LinkModel, LinkName, LinkStats, PacketInfo, SteppedLinks};

use direct::{ByChain, ByLink, BySender, DirectSending, InOrder};
use received::Received;

use super::Sample;
use super::in_flight::{Bucket, InFlight, Latest};
use super::rows::Rows;
use crate::arrays::blocks::Blocks;
use crate::arrays::processor::on_widest;
use crate::arrays::shape::Way;
use crate::arrays::{Shape, nanos};

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
    /// Latest packet of each link, indexed as `links`. Empty if links do not keep the order of packets.
    latest: Vec<Latest>,
    received: Received<A, L>,
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
        let received = Received::new(&rows, receivers.len(), initial);
        // Only links from all peers are computed together in one loop, and only links that keep the order have packets that arrive together.
        let latest = match (&links, &rows) {
            (Links::Direct(links), Rows::All { peers, .. }) if links.keep_order() => vec![Latest::NONE; receivers.len() * peers * L],
            _ => Vec::new(),
        };
        // Some samples are on the way on each link. The links of the whole scene count, because the receivers of all threads share the caches.
        let links_of_scene = (0..receivers.len()).map(|receiver| rows.columns(receiver)).sum::<usize>() * L * peers / receivers.len().max(1);
        let (sends, in_flight) = (vec![false; peers], InFlight::new(nanos(shape.tick), links_of_scene));
        Self { rows, receivers, end: shape.end, links, sends, in_flight, latest, received }
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
        self.received.moving(&self.rows, (peer, run), sent)
    }

    /// Returns whether any held sample of a peer in a run has changed since the means were computed.
    pub(in crate::arrays) fn has_changed(&self, peer: usize, run: usize) -> bool {
        self.received.has_changed(peer, run)
    }

    /// Computes the means of the receivers with a new sample.
    #[inline(always)]
    pub(in crate::arrays) fn refresh(&mut self, blocks: &mut Blocks) {
        self.received.refresh(&self.rows, blocks);
    }

    /// Takes in the samples arrived by the end of the scene. The end is at or before the tick after `latest`.
    pub(in crate::arrays) fn finish(&mut self, latest: (u64, Instant)) {
        self.pass(latest, &|_| Instant::MAX);
        // The bucket belongs to the tick at or after the end. Packets with an arrival between the end and this tick are removed.
        if let Some(mut bucket) = self.in_flight.due(latest.0 + 1) {
            self.in_flight.retain(&mut bucket, |packet| packet.arrival <= self.end);
            self.take_in(bucket);
        }
    }

    /// Takes in arrived samples. Not inlined, because the loops over samples are not part of the loop over ticks.
    #[inline(never)]
    fn take_in(&mut self, bucket: Bucket) {
        self.received.take_in(&self.in_flight, bucket);
        self.in_flight.reuse(bucket);
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
        self.received.stale_samples(receiver, run)
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
