//! One line: all that decides and counts what becomes of the packets that are offered to it, without the packets that propagate.
//!
//! A [`model`] is compiled to the least [`pipeline`] that does what the model says. A [`Line`] is such a pipeline with a filter before it and counters around
//! it. The owner of a line ([`Link`](crate::Link), [`Network`](crate::Network)) keeps what propagates in an event queue of its own.

pub(crate) mod direct;
pub(crate) mod engine;
pub(crate) mod filter;
pub(crate) mod model;
pub(crate) mod name;
pub(crate) mod pipeline;
pub(crate) mod replay;
pub(crate) mod staged;

use alloc::boxed::Box;

use cohaptic_units::Instant;

use direct::Words;
use filter::{Filter, Offered};
use model::LinkModel;
use name::LinkName;
use pipeline::{Outcome, Pipeline};

use crate::fates::fate::{DropCause, Fate};
use crate::fates::stats::{Flow, LinkStats, Seldom};
use crate::packet::{Exit, Marks, Outputs, Packet, PacketInfo};

/// A line whose packets have the payload `P`, and which its owner hands in as `T`.
#[derive(Clone, Debug)]
pub(crate) struct Line<P, T> {
    flow: Flow,
    pipeline: Pipeline<T>,
    /// In a box, as whatever is seldom, so that a line takes one cache line: the links of a large mesh fill the cache.
    rare: Option<Box<Rare<P>>>,
}

/// What few lines have, and counters that few packets touch.
#[derive(Clone, Debug)]
struct Rare<P> {
    filter: Option<Filter<P>>,
    seldom: Seldom,
}

/// Where an engine's packets go: the side of a line's owner.
pub(crate) trait Sink<T> {
    /// The packet propagates, and arrives then.
    fn arrives(&mut self, at: Instant, packet: T, copy: u8, marks: Marks);

    /// The packet was dropped, or a copy was made of it.
    fn happened(&mut self, at: Instant, fate: Fate, packet: T, copy: u8, marks: Marks);
}

impl<P, T> Line<P, T> {
    /// What the line did so far.
    pub(crate) fn stats(&self) -> LinkStats {
        LinkStats { flow: self.flow, seldom: self.rare.as_ref().map_or_else(Seldom::default, |rare| rare.seldom) }
    }
}

impl<P, T: Clone> Line<P, T> {
    /// A line that does what the model says; as the most general pipeline if `general`. The seed and the name are the address of its random numbers.
    pub(crate) fn new(seed: u64, name: &LinkName, model: LinkModel, general: bool) -> Self {
        Self { flow: Flow::default(), pipeline: Pipeline::new(seed, name, model, general), rare: None }
    }

    /// A line that goes on from where another one was.
    pub(crate) fn resumed(stats: LinkStats, pipeline: Pipeline<T>) -> Self {
        Self { flow: stats.flow, pipeline, rare: Some(Box::new(Rare { filter: None, seldom: stats.seldom })) }
    }

    /// Drops every packet of which the filter says so, before anything else happens to it.
    pub(crate) fn set_filter(&mut self, filter: Filter<P>) {
        self.rare().filter = Some(filter);
    }

    /// How many packets were offered, which is the number of the next one.
    #[inline]
    pub(crate) const fn offered(&self) -> u64 {
        self.flow.offered
    }

    /// The first random words of the next packet; zeros if it needs none.
    #[inline]
    pub(crate) fn words(&self) -> Words {
        self.pipeline.words(self.flow.offered)
    }

    /// Whether the line has a filter.
    #[inline(always)]
    pub(crate) fn has_filter(&self) -> bool {
        self.rare.as_ref().is_some_and(|rare| rare.filter.is_some())
    }

    /// Whether the filter takes the packet, which was offered then and is to be [dropped](Line::drop). Called before [`Line::offer`].
    #[inline(never)]
    pub(crate) fn filters(&mut self, packet: &Offered<'_, P>) -> bool {
        let is_dropped = self.rare.as_ref().and_then(|rare| rare.filter.as_ref()).is_some_and(|filter| filter.drops(packet));
        self.flow.offered += u64::from(is_dropped);
        is_dropped
    }

    /// Decides about the next packet, whose first random words may have been drawn before. A packet that is [dropped](Outcome::Dropped) is told to [`Line::drop`], one that
    /// [enters](Outcome::Enters) the engine is handed to [`Line::enter`].
    #[inline(always)]
    pub(crate) fn offer(&mut self, now: Instant, words: Option<Words>) -> Outcome {
        let number = self.flow.offered;
        self.flow.offered += 1;
        self.pipeline.offer(now, number, words)
    }

    /// Counts a packet that is dropped.
    #[inline(never)]
    pub(crate) fn drop(&mut self, cause: DropCause) {
        self.rare().seldom.dropped[cause.index()] += 1;
    }

    /// Takes back that a packet was dropped for that cause, or that it was marked.
    pub(crate) fn take_back(&mut self, dropped: Option<DropCause>) {
        self.rare().seldom.take_back(dropped);
    }

    /// Hands the packet that was offered last to the engine, with the marks that lines before this one left on it.
    pub(crate) fn enter(&mut self, now: Instant, info: PacketInfo, marks: Marks, item: T, outputs: &mut Outputs<T>, sink: &mut impl Sink<T>) {
        // The packet itself is counted already.
        let inside = self.stats().in_flight() - 1;
        let number = self.flow.offered - 1;
        if let Some(engine) = self.pipeline.engine() {
            engine.offer(now, Packet::new(number, info, marks, item), inside, outputs);
        }
        self.come_out(outputs, sink);
    }

    /// In place of [`Line::enter`] for a packet that no line before this one has marked, where no other is offered before `until`: when it arrives or why it never does,
    /// if that is known at once.
    #[inline]
    pub(crate) fn enter_at_once(&mut self, now: Instant, info: PacketInfo, until: Instant) -> Option<Result<Instant, DropCause>> {
        let number = self.flow.offered - 1;
        self.pipeline.engine()?.offer_at_once(now, number, info, until)
    }

    /// Wakes the engine.
    pub(crate) fn wake(&mut self, at: Instant, outputs: &mut Outputs<T>, sink: &mut impl Sink<T>) {
        if let Some(engine) = self.pipeline.engine() {
            engine.woken(at);
            engine.pass(at, outputs);
        }
        self.come_out(outputs, sink);
    }

    /// Changes the model. What propagates keeps its delay.
    pub(crate) fn reconfigure(
        &mut self,
        now: Instant,
        seed: u64,
        name: &LinkName,
        model: LinkModel,
        outputs: &mut Outputs<T>,
        sink: &mut impl Sink<T>,
    ) {
        self.pipeline.reconfigure(now, seed, name, model, outputs);
        self.come_out(outputs, sink);
    }

    /// Counts a packet that comes out of the far end after it has entered at `entered`.
    #[inline(always)]
    pub(crate) fn deliver(&mut self, entered: Instant, at: Instant) {
        self.flow.deliver(entered, at);
    }

    /// The counters of every packet, for an owner that knows when packets come out.
    #[inline(always)]
    pub(crate) const fn flow(&mut self) -> &mut Flow {
        &mut self.flow
    }

    /// Whether packets may enter an engine, which must be woken.
    #[inline]
    pub(crate) const fn has_engine(&self) -> bool {
        matches!(self.pipeline, Pipeline::Engine(_))
    }

    /// When the engine must be woken, for an owner that asks before every step.
    #[inline]
    pub(crate) fn next_wake(&self) -> Option<Instant> {
        self.pipeline.next_wake()
    }

    /// When the engine must be woken, if that was not said yet, for an owner that notes it.
    pub(crate) fn announce(&mut self) -> Option<Instant> {
        self.pipeline.engine()?.announce()
    }

    /// Hands on what has come out of the engine, and counts it.
    fn come_out(&mut self, outputs: &mut Outputs<T>, sink: &mut impl Sink<T>) {
        for output in outputs.drain(..) {
            let Packet { copy, was_marked, was_damaged, marks, item, .. } = *output.packet;
            match output.exit {
                Exit::Arrives(at) => {
                    let (is_marked, is_damaged) = (marks.congestion && !was_marked, marks.damage.is_some() && !was_damaged);
                    if is_marked || is_damaged {
                        let seldom = &mut self.rare().seldom;
                        seldom.marked += u64::from(is_marked);
                        seldom.damaged += u64::from(is_damaged);
                    }
                    sink.arrives(at, item, copy, marks);
                }
                Exit::Dropped(at, cause) => {
                    self.drop(cause);
                    sink.happened(at, Fate::Dropped(cause), item, copy, marks);
                }
                Exit::Copied(at) => {
                    self.rare().seldom.duplicated += 1;
                    sink.happened(at, Fate::Duplicated, item, copy, marks);
                }
            }
        }
    }

    fn rare(&mut self) -> &mut Rare<P> {
        self.rare.get_or_insert_with(|| Box::new(Rare { filter: None, seldom: Seldom::default() }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_takes_one_cache_line() {
        assert_eq!(size_of::<Line<u64, u64>>(), 64);
    }
}
