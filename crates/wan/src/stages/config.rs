//! What a link does to its packets.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;

use cohaptic_units::Bytes;
use cohaptic_units::print::{Counted, Span};
use core::fmt;

use crate::laws::chance;
use crate::laws::chance::Chance;
use crate::parameters::{Form, Key, UNLIMITED, usual};
use crate::stages::corruption::Corruption;
use crate::stages::delay::Delay;
use crate::stages::list::Impairments;
use crate::stages::loss::Loss;
use crate::stages::order::Order;
use crate::stages::outage::Outages;
use crate::stages::path_trace::PathTrace;
use crate::stages::queue::{Bottleneck, Discipline, Load, TokenBucket};
use crate::stages::queue::{bottleneck, token_bucket};
use crate::stages::reorder::Reorder;
use crate::stages::slots::Slots;
use crate::stages::{corruption, delay, loss, order, outage, path_trace, reorder, slots};

/// The configuration of one directed link: which impairments it has, each checked when it was made.
///
/// The default is the ideal link: no loss, no queue, no delay. Packets pass the stages in the order of the fields, unless `layout` says otherwise.
#[derive(Clone, PartialEq, Default)]
pub struct LinkConfig {
    /// The largest packet that the link takes; `None`: any.
    pub mtu: Option<Bytes>,
    /// When the link is down. A packet offered meanwhile is dropped; packets already on the way arrive.
    pub outages: Outages,
    /// Which packets are lost. Loss stands before the queue: a lost packet uses no bandwidth.
    pub loss: Loss,
    /// Whether a packet that understands ECN is marked where another would be lost.
    pub marks_instead_of_loss: bool,
    /// Which packets are sent twice. The copy goes its own way from here on.
    pub duplication: Chance,
    /// Which bits are flipped.
    pub corruption: Option<Corruption>,
    /// How many packets may be inside the link, waiting and propagating together, when another comes; `None`: any number.
    pub limit: Option<u64>,
    /// How much may leave in bursts; `None`: anything.
    pub token_bucket: Option<TokenBucket>,
    /// The rate at which packets are serialised, and the queue before it; `None`: unlimited, nothing waits.
    pub bottleneck: Option<Bottleneck>,
    /// When the link sends at all; `None`: always.
    pub slots: Option<Slots>,
    /// Packets that are put out of order on purpose.
    pub reorder: Option<Reorder>,
    /// A recorded delay and loss, on top of the others.
    pub trace: Option<PathTrace>,
    /// The propagation delay and its jitter.
    pub delay: Delay,
    /// Impairments that describe themselves: what they lose is lost after `loss`, what they add to the delay is added to that of `delay`.
    pub listed: Impairments,
    /// Whether a packet may overtake another.
    pub order: Order,
    /// In which order packets pass the stages.
    pub layout: Layout,
}

/// In which order packets pass the stages.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Layout {
    /// That of the fields of [`LinkConfig`]: first what the network does, then the queue, then propagation.
    #[default]
    Physical,
    /// That of `netem`: duplication before loss, and the rate and the slots behind the delay, so that a queue forms of what has already travelled.
    Netem,
}

impl fmt::Debug for LinkConfig {
    /// The listed impairments are shown only where there are any: fingerprints of records are made of this text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("LinkConfig");
        shown.field("mtu", &self.mtu).field("outages", &self.outages).field("loss", &self.loss);
        shown.field("marks_instead_of_loss", &self.marks_instead_of_loss).field("duplication", &self.duplication);
        shown.field("corruption", &self.corruption).field("limit", &self.limit).field("token_bucket", &self.token_bucket);
        shown.field("bottleneck", &self.bottleneck).field("slots", &self.slots).field("reorder", &self.reorder).field("trace", &self.trace);
        shown.field("delay", &self.delay).field("order", &self.order).field("layout", &self.layout);
        if self.listed != Impairments::default() {
            shown.field("listed", &self.listed);
        }
        shown.finish()
    }
}

impl LinkConfig {
    /// Whether this link draws random numbers for loss or for jitter, which most random links do.
    #[must_use]
    pub fn is_random(&self) -> bool {
        self.loss.is_random() || self.delay.jitter().is_some()
    }

    /// Whether anything that this link does is left to chance.
    #[must_use]
    pub fn has_chance(&self) -> bool {
        self.is_random()
            || self.outages.random().is_some()
            || !self.duplication.is_never()
            || self.corruption.is_some()
            || self.slots.is_some()
            || self.reorder.is_some()
            || self.trace.is_some()
            || self.listed != Impairments::default()
            || self.bottleneck.as_ref().is_some_and(|bottleneck| matches!(bottleneck.discipline, Discipline::Red(_)))
    }

    /// Whether all that this link does is to delay every packet by the same span.
    #[must_use]
    pub fn is_constant_delay(&self) -> bool {
        // The order policy counts: a live change to a shorter delay lets later packets overtake. The order of stages does not where there is one.
        *self == Self { layout: self.layout, delay: Delay::constant(self.delay.mean()), ..Self::default() }
    }

    /// Whether a packet's fate is known as soon as it is offered, and there are no copies: nothing waits, nothing is counted.
    pub(crate) fn is_direct(&self) -> bool {
        // In both layouts these follow each other in the same order.
        let Self { layout, outages, loss, delay, order, .. } = self.clone();
        *self == Self { layout, outages, loss, delay, order, ..Self::default() }
    }

    /// Without its bottleneck, and without a token bucket that no packet of that load waits for.
    fn without_queues(&self, load: Load) -> Self {
        // Behind jitter packets come closer together than they were offered.
        let keeps_gaps = self.layout == Layout::Physical || self.delay.jitter().is_none();
        let token_bucket = self.token_bucket.filter(|bucket| !(keeps_gaps && bucket.lets_all_pass(load)));
        Self { bottleneck: None, token_bucket, ..self.clone() }
    }

    /// Whether it is [direct](LinkConfig::is_direct) under that load without its bottleneck.
    pub(crate) fn is_direct_but_for_queue(&self, load: Load) -> bool {
        self.without_queues(load).is_direct()
    }

    /// Whether a packet of that load may wait for a line or for tokens.
    #[must_use]
    pub fn makes_wait(&self, load: Load) -> bool {
        let waits_for_line =
            self.bottleneck.as_ref().is_some_and(|bottleneck| self.layout == Layout::Netem || bottleneck.time_without_wait(load).is_none());
        waits_for_line || self.without_queues(load).token_bucket.is_some()
    }

    /// The span by which it delays every packet of that load, if that is all that it does: the time on a line, if it has one for which none waits, and the delay.
    #[must_use]
    pub fn constant_delay_of(&self, load: Load) -> Option<Duration> {
        let line = self.bottleneck.as_ref().map_or(Some(Duration::ZERO), |bottleneck| bottleneck.time_without_wait(load))?;
        self.without_queues(load).is_constant_delay().then(|| line.saturating_add(self.delay.mean()))
    }
}

/// The parameters of the largest packet.
const MTU: [Key; 1] = [usual("mtu", Form::AnyOf(&[Form::Size, UNLIMITED]), "\"unlimited\"", "Larger packets are dropped")];
/// The parameters of how many packets may be inside.
const LIMIT: [Key; 1] =
    [usual("limit", Form::Like(&["1000 packets", "unlimited"]), "\"unlimited\"", "How many packets may be inside, waiting and propagating together")];

/// The parameters of a link, stage by stage, in the order in which they are explained.
pub const LINK_PARAMETERS: [&[Key]; 14] = [
    &delay::KEYS,
    &order::KEYS,
    &loss::KEYS,
    &chance::KEYS,
    &corruption::KEYS,
    &reorder::KEYS,
    &bottleneck::KEYS,
    &token_bucket::KEYS,
    &slots::KEYS,
    &MTU,
    &LIMIT,
    &outage::KEYS,
    &path_trace::KEYS,
    Impairments::KEYS,
];

impl LinkConfig {
    /// The stages in words with their numbers, in the order in which packets pass them.
    pub(crate) fn words(&self) -> String {
        let Self { mtu, outages, loss, marks_instead_of_loss, duplication, corruption, limit, token_bucket, .. } = self;
        let mut stages = Vec::new();
        stages.extend(mtu.map(|mtu| format!("packets of at most {mtu}")));
        stages.extend(outages.words());
        stages.extend(loss.words().map(|loss| if *marks_instead_of_loss { format!("{loss} (marked, not lost)") } else { loss }));
        stages.extend((!duplication.is_never()).then(|| format!("{} sent twice", duplication.words())));
        stages.extend(corruption.as_ref().map(Corruption::words));
        stages.extend(limit.map(|limit| format!("at most {} inside", Counted(limit, "packet"))));
        stages.extend(token_bucket.as_ref().map(TokenBucket::words));
        stages.extend(self.bottleneck.as_ref().map(Bottleneck::words));
        stages.extend(self.slots.as_ref().map(Slots::words));
        stages.extend(self.reorder.as_ref().map(Reorder::words));
        stages.extend(self.trace.as_ref().map(|trace| format!("a recorded delay of at least {}, and its loss", Span(trace.least()))));
        stages.push(format!("delay {}", self.delay.words()));
        stages.extend(self.listed.words());
        if self.order == Order::InOrder {
            stages.push("in order".into());
        }
        let text = stages.join(", then ");
        match self.layout {
            Layout::Netem => format!("{text} (rate and slots behind the delay, as in netem)"),
            Layout::Physical => text,
        }
    }
}
