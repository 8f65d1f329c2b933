//! Configuration of a link: all impairments of one direction, in the order of the stages.

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
use crate::stages::queue::{Bottleneck, CrossTraffic, Discipline, Load, TokenBucket};
use crate::stages::queue::{bottleneck, cross_traffic, token_bucket};
use crate::stages::reorder::Reorder;
use crate::stages::slots::Slots;
use crate::stages::{corruption, delay, loss, order, outage, path_trace, reorder, slots};

/// Configuration of one directed link: its impairments, each checked when made.
///
/// The default is the ideal link: no loss, no queue, no delay. Packets pass the stages in the order of the fields, unless `layout` says otherwise.
#[derive(Clone, PartialEq, Default)]
pub struct LinkConfig {
    /// Largest packet for the link. `None` admits packets of any size.
    pub mtu: Option<Bytes>,
    /// Spans with the link down. A packet offered during a span is dropped; packets already on the way arrive.
    pub outages: Outages,
    /// Model of loss. Loss stands before the queue, so a lost packet uses no bandwidth.
    pub loss: Loss,
    /// `true` if an ECN-capable packet is marked instead of lost.
    pub marks_instead_of_loss: bool,
    /// Chance that a packet is sent twice. After this stage the copy passes all later stages independently of the original.
    pub duplication: Chance,
    /// Model of flipped bits. `None` flips no bit.
    pub corruption: Option<Corruption>,
    /// Greatest number of packets inside the link, waiting and propagating together, at the offer of another packet. `None` sets no limit.
    pub limit: Option<u64>,
    /// Bucket against bursts. `None` lets every burst pass.
    pub token_bucket: Option<TokenBucket>,
    /// Rate of serialisation, and the queue before the serialiser. `None` means an unlimited rate, without waiting.
    pub bottleneck: Option<Bottleneck>,
    /// Packets of other senders in the queue of the bottleneck. Without a bottleneck, cross-traffic has no effect.
    pub cross_traffic: Option<CrossTraffic>,
    /// Slots for sending. Under `None` the link sends at any time.
    pub slots: Option<Slots>,
    /// Packets put out of order on purpose.
    pub reorder: Option<Reorder>,
    /// Recorded delay and loss, in addition to `delay` and `loss`.
    pub trace: Option<PathTrace>,
    /// Propagation delay with its jitter.
    pub delay: Delay,
    /// Self-describing impairments. Their losses come after `loss`, and their delays are added to `delay`.
    pub listed: Impairments,
    /// Policy of overtaking between packets.
    pub order: Order,
    /// Order of the stages on a packet's way.
    pub layout: Layout,
}

/// Order of the stages on a packet's way.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Layout {
    /// Order of the fields of [`LinkConfig`]: the network's impairments, then the queue, then propagation.
    #[default]
    Physical,
    /// Order of `netem`: duplication comes before loss, and rate and slots come after the delay, so packets queue after propagation.
    Netem,
}

impl fmt::Debug for LinkConfig {
    /// Shows the listed impairments and the cross-traffic only if configured, because fingerprints of records are computed from this text and must not change
    /// with a longer list.
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
        if let Some(cross_traffic) = &self.cross_traffic {
            shown.field("cross_traffic", cross_traffic);
        }
        shown.finish()
    }
}

impl LinkConfig {
    /// Returns whether this link draws random numbers for loss or for jitter, as most random links do. [`has_chance`](Self::has_chance) covers all stages.
    #[must_use]
    pub(crate) fn is_random(&self) -> bool {
        self.loss.is_random() || self.delay.jitter().is_some()
    }

    /// Returns whether the fate of a packet depends on any random number.
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
            || self.cross_traffic.as_ref().is_some_and(CrossTraffic::is_random)
            // Of the disciplines only RED and PIE draw, for their drops and marks.
            || self.bottleneck.as_ref().is_some_and(|bottleneck| matches!(bottleneck.discipline, Discipline::Red(_) | Discipline::Pie(_)))
    }

    /// Returns whether the link only delays packets, every packet by the same span.
    #[must_use]
    pub fn is_constant_delay(&self) -> bool {
        // A link with a different order policy is excluded: after a live change to a shorter delay, later packets may overtake. The layout is ignored,
        // because a link with one stage has no order of stages.
        *self == Self { layout: self.layout, delay: Delay::constant(self.delay.mean()), ..Self::default() }
    }

    /// Returns whether a packet's fate is known at its offer, and no packet is copied. Such a link holds and counts no packet.
    pub(crate) fn is_direct(&self) -> bool {
        // Outages, loss, delay and order follow each other in the same order in both layouts, so either layout is accepted.
        let Self { layout, outages, loss, delay, order, .. } = self.clone();
        *self == Self { layout, outages, loss, delay, order, ..Self::default() }
    }

    /// Returns the configuration without its bottleneck, and without a token bucket if no packet of `load` waits there.
    fn without_queues(&self, load: Load) -> Self {
        // After jitter, packets can be closer together than at their offer. In the layout of netem the bucket comes after jitter.
        let keeps_gaps = self.layout == Layout::Physical || self.delay.jitter().is_none();
        let token_bucket = self.token_bucket.filter(|bucket| !(keeps_gaps && bucket.lets_all_pass(load)));
        Self { bottleneck: None, token_bucket, ..self.clone() }
    }

    /// Returns whether the link is [direct](LinkConfig::is_direct) under `load` once its bottleneck is removed.
    pub(crate) fn is_direct_but_for_queue(&self, load: Load) -> bool {
        self.without_queues(load).is_direct()
    }

    /// Returns whether a packet of `load` can wait for the serialiser or for tokens.
    #[must_use]
    pub fn makes_wait(&self, load: Load) -> bool {
        // In the layout of netem the gaps before the bottleneck are the gaps after the delay, so the load says nothing. Nor does the load count cross packets.
        let is_unknown = self.layout == Layout::Netem || self.cross_traffic.is_some();
        let waits_for_line = self.bottleneck.as_ref().is_some_and(|bottleneck| is_unknown || bottleneck.time_without_wait(load).is_none());
        waits_for_line || self.without_queues(load).token_bucket.is_some()
    }

    /// Returns the link's delay of every packet of `load`, or `None` if the link does more. The span is the transmission time, if no packet waits for a
    /// transmission, plus the propagation delay.
    #[must_use]
    pub(crate) fn constant_delay_of(&self, load: Load) -> Option<Duration> {
        let line = self.bottleneck.as_ref().map_or(Some(Duration::ZERO), |bottleneck| bottleneck.time_without_wait(load))?;
        self.without_queues(load).is_constant_delay().then(|| line.saturating_add(self.delay.mean()))
    }
}

/// Parameter of the largest packet.
const MTU: [Key; 1] = [usual("mtu", Form::AnyOf(&[Form::Size, UNLIMITED]), "\"unlimited\"", "Size above which packets are dropped")];
/// Parameter of the number of packets inside the link.
const LIMIT: [Key; 1] = [usual(
    "limit",
    Form::Like(&["1000 packets", "unlimited"]),
    "\"unlimited\"",
    "Largest number of packets in the link, waiting and propagating together",
)];

/// Parameters of a link, grouped by stage, in the order of `explain`.
pub const LINK_PARAMETERS: [&[Key]; 15] = [
    &delay::KEYS,
    &order::KEYS,
    &loss::KEYS,
    &chance::KEYS,
    &corruption::KEYS,
    &reorder::KEYS,
    &bottleneck::KEYS,
    &cross_traffic::KEYS,
    &token_bucket::KEYS,
    &slots::KEYS,
    &MTU,
    &LIMIT,
    &outage::KEYS,
    &path_trace::KEYS,
    Impairments::KEYS,
];

impl LinkConfig {
    /// Returns the stages in words with their numbers, in the order of the fields, joined by ", then ".
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
        stages.extend(self.bottleneck.as_ref().map(|bottleneck| {
            let shared = self.cross_traffic.as_ref().map_or_else(String::new, |traffic| format!(", shared with cross-traffic ({})", traffic.words()));
            format!("{}{shared}", bottleneck.words())
        }));
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
