//! Many links in which packets wait, each driven from one offer to the next, for drivers that keep the packets on the way themselves.

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
use queued::{QueuedKind, QueuedLink};

/// Links of any kind, for a driver that knows when it will offer the next packet to each.
///
/// What a queue does with a packet may depend on those that come later, but never before they come. So a link that is told when its next packet comes decides at
/// once all that happens until then: no queue of events wakes it. A driver that stops earlier [says so](SteppedLinks::stop), and what has not happened by then is
/// not counted. It does what [`crate::Network`] does with such links, with the same random numbers at the
/// same addresses and the same counters. Packets with the payload `T` come out in no order of time, each with its number and the word whether one that came out
/// before it arrives later or at the same instant.
///
/// Links are numbered from 0 as they are added.
#[derive(Clone, Debug)]
pub struct SteppedLinks<T> {
    until: Instant,
    /// The latest instant given. A driver does not stop before it.
    now: Instant,
    info: PacketInfo,
    links: Vec<Stepped<T>>,
    /// What links have in common on which nothing waits but before a line of one rate.
    kinds: Vec<(LinkModel, QueuedKind)>,
    outputs: Outputs<Sent<T>>,
    arrivals: Vec<(Instant, Sent<T>)>,
}

#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "most links are queued, and lie together: a box for each would be one more place to look at")]
enum Stepped<T> {
    /// Of that kind.
    Queued(u8, QueuedLink<T>),
    Other(Box<Other<T>>),
}

/// A link of any kind, and the latest arrival over it so far.
#[derive(Clone, Debug)]
struct Other<T> {
    line: Line<(), Sent<T>>,
    latest: Instant,
    ahead: Ahead,
}

/// A packet, its number, and when it was offered.
#[derive(Clone, Debug)]
struct Sent<T> {
    at: Instant,
    number: u64,
    item: T,
}

/// Kinds of links that are told apart: looking a kind up takes longer the more there are.
const MOST_KINDS: usize = 64;

impl SteppedLinks<()> {
    /// Whether such a link can be added: one that damages packets, or counts those inside until they arrive, cannot.
    #[must_use]
    pub fn takes(model: &LinkModel) -> bool {
        let takes = |config: &crate::LinkConfig| config.corruption.is_none() && config.limit.is_none();
        match model {
            LinkModel::Fixed(config) => takes(config),
            LinkModel::Modulated(modulated) => modulated.configs().iter().all(takes),
            LinkModel::Replay(_) | LinkModel::Kernel(_) => false,
        }
    }
}

impl<T: Clone> SteppedLinks<T> {
    /// No links, for such packets; those that arrive by `until` will count as delivered.
    #[must_use]
    pub const fn new(until: Instant, info: PacketInfo) -> Self {
        Self { until, now: Instant::ZERO, info, links: Vec::new(), kinds: Vec::new(), outputs: Vec::new(), arrivals: Vec::new() }
    }

    /// Adds a link that can be [taken](SteppedLinks::takes).
    pub fn add(&mut self, seed: u64, name: &LinkName, model: &LinkModel) {
        let link = match self.kind(model) {
            Some(place) => Stepped::Queued(place, QueuedLink::new(seed, name, &self.kinds[usize::from(place)].1)),
            None => {
                Stepped::Other(Box::new(Other { line: Line::new(seed, name, model.clone(), false), latest: Instant::ZERO, ahead: Ahead::default() }))
            }
        };
        self.links.push(link);
    }

    /// The place of the kind of a link on which nothing waits but before a line of one rate, if it is such a link, and there are not too many kinds.
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

    /// Offers a packet to a link, and says until when nothing else is offered to it. `arrives` is told of each packet of which it is known by then that it arrives:
    /// when, whether not after all that were told before, and its number on the link, from 0. Instants must not go back.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    #[inline]
    pub fn offer(&mut self, (now, next): (Instant, Instant), link: LinkId, item: T, mut arrives: impl FnMut(Instant, bool, u64, T)) {
        // What happens after the end is not counted.
        let (until, next) = (self.until, next.min(self.until));
        self.now = now;
        match &mut self.links[link.index()] {
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
            // Most packets find an idle line. To lead them through its stages took more than half of their time.
            Outcome::Enters => line.enter_at_once(now, *info, next),
        };
        let number = line.offered() - 1;
        match fate {
            Some(Ok(at)) => {
                line.flow().deliver_by(until, now, at);
                arrives(at, at <= *latest, number, item);
                *latest = at.max(*latest);
            }
            Some(Err(cause)) => line.drop(cause),
            None => {
                line.enter(
                    now,
                    *info,
                    Marks::default(),
                    Sent { at: now, number, item },
                    outputs,
                    &mut Arriving { arrivals, ahead, span: (now, now) },
                );
                self.pass_on_other(next, link, arrives);
            }
        }
    }

    /// Lets time pass on a link until `next`, before which nothing is offered to it.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    pub fn pass(&mut self, next: Instant, link: LinkId, arrives: &mut dyn FnMut(Instant, bool, u64, T)) {
        // What happens after the end is not counted.
        let (until, next) = (self.until, next.min(self.until));
        match &mut self.links[link.index()] {
            Stepped::Queued(kind, link) => link.pass((self.now, next, until), &self.kinds[usize::from(*kind)].1, arrives),
            Stepped::Other(_) => self.pass_on_other(next, link, arrives),
        }
    }

    /// Lets time pass on a link with stages besides a line, until `next` or the end at most. Generic, because most packets over such a link come here.
    fn pass_on_other(&mut self, next: Instant, link: LinkId, mut arrives: impl FnMut(Instant, bool, u64, T)) {
        let Self { until, now, links, outputs, arrivals, .. } = self;
        let Stepped::Other(other) = &mut links[link.index()] else { return };
        let Other { line, latest, ahead } = &mut **other;
        // One instant after another, so that it is known when a packet that leaves was marked.
        while let Some(wake) = line.next_wake().filter(|wake| *wake <= next) {
            line.wake(wake, outputs, &mut Arriving { arrivals, ahead, span: (*now, wake) });
        }
        for (at, Sent { at: sent, number, item }) in arrivals.drain(..) {
            line.flow().deliver_by(*until, sent, at);
            arrives(at, at <= *latest, number, item);
            *latest = at.max(*latest);
        }
    }

    /// Changes the model of a link, of which `seed` and `name` are those that it was added with; see [`crate::Network::set_link`]. Until then time has passed on it.
    ///
    /// # Panics
    ///
    /// If there is no such link.
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
                queued.reconfigure((now, until), (&kinds[usize::from(*place)].1, &kinds[usize::from(kind)].1), arrives);
                *place = kind;
            }
            (Stepped::Queued(place, queued), None) => {
                let mut other = queued.clone().into_other(now, &kinds[usize::from(*place)].1, info);
                other.reconfigure(now, (seed, name), model, outputs, arrivals);
                *changed = Stepped::Other(Box::new(other));
            }
            (Stepped::Other(other), _) => other.reconfigure(now, (seed, name), model, outputs, arrivals),
        }
        self.pass(now, link, arrives);
    }

    /// The driver stops at an instant, which is not before the latest one given: takes back that packets were dropped or marked later than that.
    pub fn stop(&mut self, at: Instant) {
        for link in &mut self.links {
            match link {
                Stepped::Queued(_, link) => link.stop(at),
                Stepped::Other(other) => {
                    let Other { line, ahead, .. } = &mut **other;
                    ahead.after(at).for_each(|dropped| line.take_back(dropped));
                }
            }
        }
    }

    /// Takes back that a packet is delivered: nobody will look when it arrives.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    pub fn forget(&mut self, link: LinkId, sent: Instant, arrival: Instant) {
        if arrival <= self.until {
            match &mut self.links[link.index()] {
                Stepped::Queued(_, link) => link.forget(sent, arrival),
                Stepped::Other(other) => other.line.flow().forget(sent, arrival),
            }
        }
    }

    /// The counters of a link.
    ///
    /// # Panics
    ///
    /// If there is no such link.
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

/// Where packets that leave a line's stages go.
struct Arriving<'a, T> {
    arrivals: &'a mut Vec<(Instant, Sent<T>)>,
    ahead: &'a mut Ahead,
    /// The latest instant given to the links, and that at which these packets leave.
    span: (Instant, Instant),
}

impl<T> Sink<Sent<T>> for Arriving<'_, T> {
    fn arrives(&mut self, at: Instant, packet: Sent<T>, _copy: u8, marks: Marks) {
        if marks.congestion {
            // No line before this one marks packets.
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
