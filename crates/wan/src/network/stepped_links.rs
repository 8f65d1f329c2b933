//! Many links in which packets wait, each driven from one offer to the next, for drivers that keep the packets on the way themselves.

use alloc::vec::Vec;

use cohaptic_units::Instant;

use super::id::LinkId;
use crate::fates::fate::Fate;
use crate::fates::stats::LinkStats;
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::line::pipeline::Outcome;
use crate::line::{Line, Sink};
use crate::packet::{Marks, Outputs, PacketInfo};

/// Links of any kind, for a driver that knows when it will offer the next packet to each.
///
/// What a queue does with a packet may depend on those that come later, but never before they come. So a link that is told when its next packet comes decides at
/// once all that happens until then: no queue of events wakes it. It does what [`crate::Network`] does with such links, with the same random numbers at the
/// same addresses and the same counters. Packets of type `T` come out in no order of time, each with the word whether one that came out before it arrives later
/// or at the same instant.
///
/// Links are numbered from 0 as they are added.
#[derive(Clone, Debug)]
pub struct SteppedLinks<T> {
    until: Instant,
    lines: Vec<Stepped<T>>,
    outputs: Outputs<Sent<T>>,
    arrivals: Vec<(Instant, Sent<T>)>,
}

/// A link, and the latest arrival over it so far.
#[derive(Clone, Debug)]
struct Stepped<T> {
    line: Line<(), Sent<T>>,
    latest: Instant,
}

/// A packet and when it was offered.
#[derive(Clone, Debug)]
struct Sent<T> {
    at: Instant,
    item: T,
}

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
    /// No links; packets that arrive by `until` will count as delivered.
    #[must_use]
    pub const fn new(until: Instant) -> Self {
        Self { until, lines: Vec::new(), outputs: Vec::new(), arrivals: Vec::new() }
    }

    /// Adds a link that can be [taken](SteppedLinks::takes).
    pub fn add(&mut self, seed: u64, name: &LinkName, model: LinkModel) {
        self.lines.push(Stepped { line: Line::new(seed, name, model, false), latest: Instant::ZERO });
    }

    /// The number of the next packet of a link.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    #[must_use]
    pub fn offered(&self, link: LinkId) -> u64 {
        self.lines[link.index()].line.offered()
    }

    /// Offers a packet to a link, and says until when nothing else is offered to it. `arrives` is told of each packet that leaves the link's stages until then,
    /// when it arrives, and whether it does not arrive after all that left them before. Instants must not go back.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    pub fn offer(&mut self, (now, next): (Instant, Instant), link: LinkId, info: PacketInfo, item: T, arrives: impl FnMut(Instant, bool, T)) {
        let Self { lines, outputs, arrivals, .. } = self;
        let line = &mut lines[link.index()].line;
        match line.offer(now, None) {
            Outcome::Arrives(at) => arrivals.push((at, Sent { at: now, item })),
            Outcome::Dropped(cause) => line.drop(cause),
            Outcome::Enters => line.enter(now, info, Marks::default(), Sent { at: now, item }, outputs, &mut Arriving(arrivals)),
        }
        self.pass(next, link, arrives);
    }

    /// Lets time pass on a link until `next`, before which nothing is offered to it.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    pub fn pass(&mut self, next: Instant, link: LinkId, mut arrives: impl FnMut(Instant, bool, T)) {
        let Self { until, lines, outputs, arrivals } = self;
        let Stepped { line, latest } = &mut lines[link.index()];
        // What happens after the end is not counted.
        let next = next.min(*until);
        if line.next_wake().is_some_and(|wake| wake <= next) {
            line.wake(next, outputs, &mut Arriving(arrivals));
        }
        for (at, Sent { at: sent, item }) in arrivals.drain(..) {
            if at <= *until {
                line.deliver(sent, at);
            }
            arrives(at, at <= *latest, item);
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
        mut arrives: impl FnMut(Instant, bool, T),
    ) {
        self.pass(now, link, &mut arrives);
        let Self { lines, outputs, arrivals, .. } = self;
        lines[link.index()].line.reconfigure(now, seed, name, model, outputs, &mut Arriving(arrivals));
        self.pass(now, link, arrives);
    }

    /// Takes back that a packet is delivered: nobody will look when it arrives.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    pub fn forget(&mut self, link: LinkId, sent: Instant, arrival: Instant) {
        if arrival <= self.until {
            self.lines[link.index()].line.forget(sent, arrival);
        }
    }

    /// The counters of a link.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    #[must_use]
    pub fn stats(&self, link: LinkId) -> LinkStats {
        self.lines[link.index()].line.stats()
    }
}

/// Where packets that leave a line's stages go.
struct Arriving<'a, T>(&'a mut Vec<(Instant, Sent<T>)>);

impl<T> Sink<Sent<T>> for Arriving<'_, T> {
    fn arrives(&mut self, at: Instant, packet: Sent<T>, _copy: u8, _marks: Marks) {
        self.0.push((at, packet));
    }

    fn happened(&mut self, _at: Instant, _fate: Fate, _packet: Sent<T>, _copy: u8, _marks: Marks) {}
}
