//! A line: decides the fates of offered packets, and counts the packets. Packets in propagation are outside.
//!
//! A [`model`] is compiled to the smallest [`pipeline`] with the behaviour of the model. A [`Line`] is such a pipeline with a filter before the pipeline and
//! counters around it. The owner of a line ([`Link`](crate::Link), [`Network`](crate::Network)) keeps packets in propagation in a separate event queue, and
//! tells the line the time.

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
use crate::fates::stats::{CrossCounts, Flow, LinkStats, Seldom};
use crate::packet::{Exit, Marks, Outputs, Packet, PacketInfo};

/// A line. `P` is the payload type for filters, and `T` is the packet type of the owner.
#[derive(Clone, Debug)]
pub(crate) struct Line<P, T> {
    flow: Flow,
    pipeline: Pipeline<T>,
    /// Boxed, because few lines have a filter and few packets touch these counters. An unboxed `Rare` would make a line larger than one cache line.
    rare: Option<Box<Rare<P>>>,
}

/// Parts of few lines, and counters for few packets.
#[derive(Clone, Debug)]
struct Rare<P> {
    filter: Option<Filter<P>>,
    seldom: Seldom,
}

/// The owner's side of a line: takes the packets that come out of the line's engine.
pub(crate) trait Sink<T> {
    /// Takes a packet in propagation until its arrival at `at`. `copy` is the packet's copy number, 0 for the packet itself.
    fn arrives(&mut self, at: Instant, packet: T, copy: u8, marks: Marks);

    /// Takes a packet dropped or copied at `at`.
    fn happened(&mut self, at: Instant, fate: Fate, packet: T, copy: u8, marks: Marks);
}

impl<P, T> Line<P, T> {
    /// Returns the counters of the line.
    pub(crate) fn stats(&self) -> LinkStats {
        let cross = if let Pipeline::Engine(engine) = &self.pipeline { engine.crossed() } else { CrossCounts::default() };
        LinkStats { flow: self.flow, seldom: self.rare.as_ref().map_or_else(Seldom::default, |rare| rare.seldom), cross }
    }
}

impl<P, T: Clone> Line<P, T> {
    /// Makes a line of this model, with the most general pipeline if `general` is set. `seed` and `name` are the address of the line's random numbers.
    pub(crate) fn new(seed: u64, name: &LinkName, model: LinkModel, general: bool) -> Self {
        Self { flow: Flow::default(), pipeline: Pipeline::new(seed, name, model, general), rare: None }
    }

    /// Makes a line from the counters and the pipeline of another line. The new line has no filter.
    pub(crate) fn resumed(stats: LinkStats, pipeline: Pipeline<T>) -> Self {
        Self { flow: stats.flow, pipeline, rare: Some(Box::new(Rare { filter: None, seldom: stats.seldom })) }
    }

    /// Sets the filter of the line. The filter drops packets before any stage.
    pub(crate) fn set_filter(&mut self, filter: Filter<P>) {
        self.rare().filter = Some(filter);
    }

    /// Returns the number of packets offered so far: the number of the next packet.
    pub(crate) const fn offered(&self) -> u64 {
        self.flow.offered
    }

    /// Returns the first random words of the next packet, or zeros if the packet needs no words.
    #[inline]
    pub(crate) fn words(&self) -> Words {
        self.pipeline.words(self.flow.offered)
    }

    /// Returns whether the line has a filter.
    #[inline(always)]
    pub(crate) fn has_filter(&self) -> bool {
        self.rare.as_ref().is_some_and(|rare| rare.filter.is_some())
    }

    /// Returns whether the filter drops the packet. If so, the packet counts as offered, and the caller must tell [`Line::drop`]. Called before
    /// [`Line::offer`].
    #[inline(never)]
    pub(crate) fn filters(&mut self, packet: &Offered<'_, P>) -> bool {
        let is_dropped = self.rare.as_ref().and_then(|rare| rare.filter.as_ref()).is_some_and(|filter| filter.drops(packet));
        // A dropped packet is counted here, because `offer` is not called for the packet.
        self.flow.offered += u64::from(is_dropped);
        is_dropped
    }

    /// Decides about the next packet. `words` holds the packet's first random words if the words were drawn before. The caller must tell [`Line::drop`] about a
    /// [dropped](Outcome::Dropped) packet, and hand a packet with the outcome [enters](Outcome::Enters) to [`Line::enter`].
    #[inline(always)]
    pub(crate) fn offer(&mut self, now: Instant, words: Option<Words>) -> Outcome {
        let number = self.flow.offered;
        self.flow.offered += 1;
        self.pipeline.offer(now, number, words)
    }

    /// Like [`Line::offer`], for many links of which nearly all have a constant delay: everything else is a function of its own, so that a loop over the links
    /// stays small.
    #[inline(always)]
    pub(crate) fn offer_without_draws(&mut self, now: Instant) -> Outcome {
        if let Pipeline::Constant(..) = self.pipeline { self.offer(now, None) } else { self.offer_otherwise(now) }
    }

    #[inline(never)]
    fn offer_otherwise(&mut self, now: Instant) -> Outcome {
        self.offer(now, None)
    }

    /// Counts a dropped packet.
    #[inline(never)]
    pub(crate) fn drop(&mut self, cause: DropCause) {
        self.rare().seldom.dropped[cause.index()] += 1;
    }

    /// Takes back the count of a drop for this cause, or of a mark if `dropped` is `None`.
    pub(crate) fn take_back(&mut self, dropped: Option<DropCause>) {
        self.rare().seldom.take_back(dropped);
    }

    /// Hands the packet of the latest offer to the engine, with the number of its flow and with the marks of earlier lines on the packet.
    pub(crate) fn enter(
        &mut self,
        now: Instant,
        (info, flow): (PacketInfo, u32),
        marks: Marks,
        item: T,
        outputs: &mut Outputs<T>,
        sink: &mut impl Sink<T>,
    ) {
        // `offer` has counted the packet itself already.
        let inside = self.stats().in_flight() - 1;
        let number = self.flow.offered - 1;
        if let Some(engine) = self.pipeline.engine() {
            engine.offer(now, Packet::new(number, info, marks, item).of_flow(flow), inside, outputs);
        }
        // The packet itself, or an earlier packet pushed out by it, may leave at once.
        self.come_out(outputs, sink);
    }

    /// Takes the packet of the latest offer, in place of [`Line::enter`], if the packet's fate is certain at once, and returns its arrival or the cause of its
    /// drop. No earlier line may have marked the packet, and no further packet may be offered before `until`. If the fate is not certain, returns `None` and
    /// takes no packet: the caller then calls [`Line::enter`].
    #[inline]
    pub(crate) fn enter_at_once(&mut self, now: Instant, info: PacketInfo, until: Instant) -> Option<Result<Instant, DropCause>> {
        let number = self.flow.offered - 1;
        self.pipeline.engine()?.offer_at_once(now, number, info, until)
    }

    /// Wakes the engine at `at`, and hands on the packets that come out.
    pub(crate) fn wake(&mut self, at: Instant, outputs: &mut Outputs<T>, sink: &mut impl Sink<T>) {
        if let Some(engine) = self.pipeline.engine() {
            // The next wake can be announced again from now on, even for the same instant.
            engine.woken(at);
            engine.pass(at, outputs);
        }
        self.come_out(outputs, sink);
    }

    /// Computes the cross packets up to `now` that no packet of the line has met. Everything due by `now` has happened before.
    pub(crate) fn catch_up(&mut self, now: Instant, outputs: &mut Outputs<T>, sink: &mut impl Sink<T>) {
        if let Some(engine) = self.pipeline.engine() {
            engine.catch_up(now, outputs);
        }
        self.come_out(outputs, sink);
    }

    /// Changes the model at `now`. Packets in propagation keep their delay.
    pub(crate) fn reconfigure(
        &mut self,
        now: Instant,
        seed: u64,
        name: &LinkName,
        model: LinkModel,
        outputs: &mut Outputs<T>,
        sink: &mut impl Sink<T>,
    ) {
        // A new model can free packets at once, for example from a queue that is given up.
        self.pipeline.reconfigure(now, seed, name, model, outputs);
        self.come_out(outputs, sink);
    }

    /// Counts the arrival at `at` of a packet that entered the line at `entered`.
    #[inline(always)]
    pub(crate) fn deliver(&mut self, entered: Instant, at: Instant) {
        self.flow.deliver(entered, at);
    }

    /// Returns whether a constant delay above zero is all that the line does to packets.
    pub(crate) const fn is_constant(&self) -> bool {
        matches!(self.pipeline, Pipeline::Constant(1.., _))
    }

    /// Takes `packets` packets at `now`, and returns the arrival of all of them. The line must be [constant](Line::is_constant).
    #[inline]
    pub(crate) fn offer_train(&mut self, now: Instant, packets: u32) -> Instant {
        let Outcome::Arrives(at) = self.offer(now, None) else { unreachable!("a constant line keeps no packet and loses none") };
        // `offer` has counted the first packet.
        self.flow.offered += u64::from(packets.saturating_sub(1));
        at
    }

    /// Counts the arrival of further packets of a train, with the instants of [`Line::deliver`]. Not inlined, because the compiler would otherwise compute the
    /// sums of a train for each packet.
    #[cold]
    #[inline(never)]
    pub(crate) fn deliver_further(&mut self, packets: u64, entered: Instant, at: Instant) {
        self.flow.deliver_train(packets, entered, at);
    }

    /// Returns the counters touched by every packet, for an owner that counts arrivals itself.
    pub(crate) const fn flow(&mut self) -> &mut Flow {
        &mut self.flow
    }

    /// Returns whether packets may enter an engine. An engine must be woken.
    #[inline]
    pub(crate) const fn has_engine(&self) -> bool {
        matches!(self.pipeline, Pipeline::Engine(_))
    }

    /// Returns the instant of the engine's next wake, for an owner that asks before every step.
    #[inline]
    pub(crate) fn next_wake(&self) -> Option<Instant> {
        self.pipeline.next_wake()
    }

    /// Returns the instant of the engine's next wake if not announced yet, for an owner that keeps announced instants.
    pub(crate) fn announce(&mut self) -> Option<Instant> {
        self.pipeline.engine()?.announce()
    }

    /// Hands the packets that came out of the engine to `sink`, and counts marks, damage, drops and copies.
    fn come_out(&mut self, outputs: &mut Outputs<T>, sink: &mut impl Sink<T>) {
        for output in outputs.drain(..) {
            let Packet { copy, was_marked, was_damaged, marks, item, .. } = *output.packet;
            match output.exit {
                Exit::Arrives(at) => {
                    // Marks and damage of earlier lines were counted there. Only new marks and damage are counted here.
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
