//! Many links with waiting packets, each driven from offer to offer. The driver keeps the packets on the way itself.

mod ahead;
mod queued;

use alloc::boxed::Box;
use alloc::vec::Vec;

use cohaptic_units::Instant;

use self::ahead::Ahead;
use super::id::LinkId;
use crate::fates::fate::Fate;
use crate::fates::stats::LinkStats;
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::line::pipeline::Outcome;
use crate::line::{Line, Sink};
use crate::packet::{Marks, Outputs, PacketInfo};
use crate::stages::config::Layout;
use queued::{QueuedKind, QueuedLink};

/// Links of any kind, for a driver that knows the instant of its next offer to each link.
///
/// A queue's decision about a packet may depend on later packets, but never before these packets come. So a link with a known instant of its next packet
/// decides at once about everything until then, and no queue of events is needed to wake the link. A driver with an earlier end calls
/// [`stop`](SteppedLinks::stop). The function takes back the counts of all events after the end. Random numbers, their addresses and the counters are equal to
/// [`crate::Network`] with the same links. Packets with the payload `T` come out in no order of time. Each packet comes with its number, and with a flag, set
/// if an earlier reported packet arrives later or at the same instant.
///
/// Links are numbered from 0 in the order of addition.
#[derive(Clone, Debug)]
pub struct SteppedLinks<T> {
    until: Instant,
    /// The latest instant given by the driver. A driver does not stop before this instant.
    now: Instant,
    info: PacketInfo,
    links: Vec<Stepped<T>>,
    /// Models of the links in `Stepped::Queued`, and the data shared by links of one model. Indexed by the number in `Stepped::Queued`.
    kinds: Vec<(LinkModel, QueuedKind)>,
    outputs: Outputs<Sent<T>>,
    arrivals: Vec<(Instant, Sent<T>)>,
}

#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "most links are queued, and lie together: a box for each would be one more place to look at")]
enum Stepped<T> {
    /// A link with at most one queue, before a transmitter of constant rate: the index of its kind in `kinds`, and its state.
    Queued(u8, QueuedLink<T>),
    Other(Box<Other<T>>),
}

/// A link of any further kind, and the latest arrival over the link so far.
#[derive(Clone, Debug)]
struct Other<T> {
    line: Line<(), Sent<T>>,
    latest: Instant,
    ahead: Ahead,
}

/// A packet, its number on the link, and the instant of its offer.
#[derive(Clone, Debug)]
struct Sent<T> {
    at: Instant,
    number: u64,
    item: T,
}

/// Number of kinds of links, at most. The list of kinds is searched from its beginning, and more kinds take longer; links beyond the limit become
/// `Stepped::Other`.
const MOST_KINDS: usize = 64;

impl SteppedLinks<()> {
    /// Returns whether a link of this model can be added. Links with damage of packets, links with a limit of the number of packets inside, links with
    /// cross-traffic behind a token bucket or behind the delay, replays, and models of the kernel's queue cannot.
    #[must_use]
    pub fn takes(model: &LinkModel) -> bool {
        // Cross-traffic is counted where a packet of the link meets it. Only if this is the offer of the packet, the driver has reached the counted instant.
        let counts_at_offers =
            |config: &crate::LinkConfig| config.cross_traffic.is_none() || (config.token_bucket.is_none() && config.layout == Layout::Physical);
        let takes = |config: &crate::LinkConfig| config.corruption.is_none() && config.limit.is_none() && counts_at_offers(config);
        match model {
            LinkModel::Fixed(config) => takes(config),
            LinkModel::Modulated(modulated) => modulated.configs().iter().all(takes),
            LinkModel::Replay(_) | LinkModel::Kernel(_) => false,
        }
    }
}

impl<T: Clone> SteppedLinks<T> {
    /// Makes an empty set of links for packets of this size and ECN capability. Packets with an arrival by `until` count as delivered.
    #[must_use]
    pub const fn new(until: Instant, info: PacketInfo) -> Self {
        Self { until, now: Instant::ZERO, info, links: Vec::new(), kinds: Vec::new(), outputs: Vec::new(), arrivals: Vec::new() }
    }

    /// Adds a link. [`takes`](SteppedLinks::takes) must accept the model.
    pub fn add(&mut self, seed: u64, name: &LinkName, model: &LinkModel) {
        let link = match self.kind(model) {
            Some(place) => Stepped::Queued(place, QueuedLink::new(seed, name, &self.kinds[usize::from(place)].1)),
            None => {
                Stepped::Other(Box::new(Other { line: Line::new(seed, name, model.clone(), false), latest: Instant::ZERO, ahead: Ahead::default() }))
            }
        };
        self.links.push(link);
    }

    /// Returns the index of the model's kind in `kinds`, adding a new kind. Returns `None` if [`QueuedKind::new`] does so for the model, or if `kinds` is full.
    fn kind(&mut self, model: &LinkModel) -> Option<u8> {
        let place = match self.kinds.iter().position(|(other, _)| other == model) {
            Some(place) => place,
            None if self.kinds.len() >= MOST_KINDS => return None,
            None => {
                self.kinds.push((model.clone(), QueuedKind::new(model, self.info.size)?));
                self.kinds.len() - 1
            }
        };
        u8::try_from(place).ok()
    }

    /// Offers a packet to a link at `now`, and promises no further offer to the link before `next`. `arrives` is called for each packet with a certain arrival
    /// by `next`, with the instant of the arrival, a flag, set if an earlier reported packet arrives later or at the same instant, and the packet's number on
    /// the link, from 0. Instants must not go back.
    ///
    /// # Panics
    ///
    /// If the link is missing.
    pub fn offer(&mut self, (now, next): (Instant, Instant), link: LinkId, item: T, mut arrives: impl FnMut(Instant, bool, u64, T)) {
        // Events after the end of the run are not counted.
        let (until, next) = (self.until, next.min(self.until));
        self.now = now;
        match &mut self.links[link.index()] {
            // The offer comes before the passage of time, so the packet can leave within the same call.
            Stepped::Queued(kind, link) => {
                let kind = &self.kinds[usize::from(*kind)].1;
                link.offer((now, until), kind, item, &mut arrives);
                link.pass((now, next, until), kind, arrives);
            }
            Stepped::Other(_) => self.offer_to_other((now, next, until), link, item, arrives),
        }
    }

    fn offer_to_other(
        &mut self,
        (now, next, until): (Instant, Instant, Instant),
        link: LinkId,
        item: T,
        mut arrives: impl FnMut(Instant, bool, u64, T),
    ) {
        let Self { info, links, outputs, arrivals, .. } = self;
        let Stepped::Other(other) = &mut links[link.index()] else { return };
        let Other { line, latest, ahead } = &mut **other;
        let fate = match line.offer(now, None) {
            Outcome::Arrives(at) => Some(Ok(at)),
            Outcome::Dropped(cause) => Some(Err(cause)),
            // Most packets find an idle transmitter. Their fate is computed here without a pass through the stages.
            Outcome::Enters => line.enter_at_once(now, *info, next),
        };
        let number = line.offered() - 1;
        match fate {
            Some(Ok(at)) => {
                // The fate is known, so delivery and order are settled at the offer.
                line.flow().deliver_by(until, now, at);
                arrives(at, at <= *latest, number, item);
                *latest = at.max(*latest);
            }
            Some(Err(cause)) => line.drop(cause),
            None => {
                // An offer happens at the present instant of the driver, so nothing is noted ahead.
                // All packets of a link are one flow.
                line.enter(
                    now,
                    (*info, 0),
                    Marks::default(),
                    Sent { at: now, number, item },
                    outputs,
                    &mut Arriving { arrivals, ahead, span: (now, now) },
                );
                self.pass_on_other(next, link, arrives);
            }
        }
    }

    /// Lets time pass on a link until `next`, without an offer to the link before `next`.
    ///
    /// # Panics
    ///
    /// If the link is missing.
    pub fn pass(&mut self, next: Instant, link: LinkId, arrives: &mut dyn FnMut(Instant, bool, u64, T)) {
        // Events after the end of the run are not counted.
        let (until, next) = (self.until, next.min(self.until));
        match &mut self.links[link.index()] {
            Stepped::Queued(kind, link) => link.pass((self.now, next, until), &self.kinds[usize::from(*kind)].1, arrives),
            Stepped::Other(_) => self.pass_on_other(next, link, arrives),
        }
    }

    /// Lets time pass on a link in `Stepped::Other` until `next`, at most the end of the run. Generic in `arrives`, because most packets over links
    /// with further stages pass here.
    fn pass_on_other(&mut self, next: Instant, link: LinkId, mut arrives: impl FnMut(Instant, bool, u64, T)) {
        let Self { until, now, links, outputs, arrivals, .. } = self;
        let Stepped::Other(other) = &mut links[link.index()] else { return };
        let Other { line, latest, ahead } = &mut **other;
        // Wakes come instant by instant, so `span` holds the instant of a packet's mark.
        while let Some(wake) = line.next_wake().filter(|wake| *wake <= next) {
            line.wake(wake, outputs, &mut Arriving { arrivals, ahead, span: (*now, wake) });
        }
        for (at, Sent { at: sent, number, item }) in arrivals.drain(..) {
            line.flow().deliver_by(*until, sent, at);
            arrives(at, at <= *latest, number, item);
            *latest = at.max(*latest);
        }
    }

    /// Changes the model of a link at `now`; see [`crate::Network::set_link`]. `seed` and `name` are the link's from its addition. Lets time pass on
    /// the link until `now` first.
    ///
    /// # Panics
    ///
    /// If the link is missing.
    pub fn set_model(
        &mut self,
        now: Instant,
        link: LinkId,
        (seed, name): (u64, &LinkName),
        model: LinkModel,
        arrives: &mut dyn FnMut(Instant, bool, u64, T),
    ) {
        self.now = now;
        self.pass(now, link, arrives);
        let (until, info, kind) = (self.until, self.info, self.kind(&model));
        let Self { links, kinds, outputs, arrivals, .. } = self;
        let changed = &mut links[link.index()];
        match (&mut *changed, kind) {
            (Stepped::Queued(place, queued), Some(kind)) => {
                // A queued link becomes one of any kind with its packets inside, because the new model has no kind.
                queued.reconfigure((now, until), (&kinds[usize::from(*place)].1, &kinds[usize::from(kind)].1), arrives);
                *place = kind;
            }
            (Stepped::Queued(place, queued), None) => {
                let mut other = queued.clone().into_other(now, &kinds[usize::from(*place)].1, info);
                other.reconfigure(now, (seed, name), model, outputs, arrivals);
                *changed = Stepped::Other(Box::new(other));
                // A link that became `Other` stays so even if the new model has a kind: its stages may still hold packets.
            }
            (Stepped::Other(other), _) => other.reconfigure(now, (seed, name), model, outputs, arrivals),
        }
        // The change can free waiting packets, for example with a faster rate or without a queue.
        self.pass(now, link, arrives);
    }

    /// Stops the driver at an instant not before the latest instant given. The counts of packets dropped or marked after `at` are taken back.
    pub fn stop(&mut self, at: Instant) {
        for link in &mut self.links {
            match link {
                Stepped::Queued(_, link) => link.stop(at),
                Stepped::Other(other) => {
                    let Other { line, ahead, .. } = &mut **other;
                    // Earlier events have happened for the driver too.
                    ahead.after(at).for_each(|dropped| line.take_back(dropped));
                }
            }
        }
    }

    /// Takes back the count of a delivered packet, for a driver that will not see the arrival.
    ///
    /// # Panics
    ///
    /// If the link is missing.
    pub fn forget(&mut self, link: LinkId, sent: Instant, arrival: Instant) {
        if arrival <= self.until {
            match &mut self.links[link.index()] {
                Stepped::Queued(_, link) => link.forget(sent, arrival),
                Stepped::Other(other) => other.line.flow().forget(sent, arrival),
            }
        }
    }

    /// Returns the counters of a link.
    ///
    /// # Panics
    ///
    /// If the link is missing.
    #[must_use]
    pub fn stats(&self, link: LinkId) -> LinkStats {
        match &self.links[link.index()] {
            Stepped::Queued(_, link) => link.stats(),
            Stepped::Other(other) => other.line.stats(),
        }
    }
}

impl<T: Clone> Other<T> {
    fn reconfigure(
        &mut self,
        now: Instant,
        (seed, name): (u64, &LinkName),
        model: LinkModel,
        outputs: &mut Outputs<Sent<T>>,
        arrivals: &mut Vec<(Instant, Sent<T>)>,
    ) {
        let Self { line, ahead, .. } = self;
        line.reconfigure(now, seed, name, model, outputs, &mut Arriving { arrivals, ahead, span: (now, now) });
    }
}

/// The way out of a link's stages: collects arrivals, and notes drops and marks ahead of the driver.
struct Arriving<'a, T> {
    arrivals: &'a mut Vec<(Instant, Sent<T>)>,
    ahead: &'a mut Ahead,
    /// The latest instant given by the driver, and the instant of the wake or offer, with the exit of these packets from the stages.
    span: (Instant, Instant),
}

impl<T> Sink<Sent<T>> for Arriving<'_, T> {
    fn arrives(&mut self, at: Instant, packet: Sent<T>, _copy: u8, marks: Marks) {
        if marks.congestion {
            // Only the queue of the present exit can have marked the packet, so the instant of the wake is the instant of the mark.
            self.ahead.note(self.span, None);
        }
        self.arrivals.push((at, packet));
    }

    fn happened(&mut self, at: Instant, fate: Fate, _packet: Sent<T>, _copy: u8, _marks: Marks) {
        if let Fate::Dropped(cause) = fate {
            self.ahead.note((self.span.0, at), Some(cause));
        }
    }
}

#[cfg(test)]
mod tests;
