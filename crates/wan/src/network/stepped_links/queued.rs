//! Links whose packets wait only for a transmitter of constant rate, for packets of one size.
//!
//! A link keeps the stages with immediate decisions, and its queue. The answers are the answers of [`BottleneckStage`](crate::stages::queue::BottleneckStage)
//! between the stages of [`Staged`](crate::line::staged::Staged), with less memory per link: packets are not boxed, and equal packet sizes make the waiting
//! bytes and bits multiples of the number of packets.

use alloc::boxed::Box;
use core::time::Duration;

use cohaptic_units::{Bytes, Ecn, Instant, Rate};

use super::ahead::Ahead;
use super::{Other, Sent};
use crate::fates::fate::DropCause;
use crate::fates::stats::{Flow, LinkStats, Seldom};
use crate::line::Line;
use crate::line::direct::Direct;
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::line::pipeline::Pipeline;
use crate::packet::{Marks, Packet, PacketInfo};
use crate::random::Purpose;
use crate::stages::config::{Layout, LinkConfig};
use crate::stages::queue::{Bottleneck, BottleneckStage, Discipline, Fifo, FqCoDel, Load, Queued, Red, Rules, Service, giga_bits};

/// Data shared by all queued links of one configuration.
#[derive(Clone, Debug)]
pub(super) struct QueuedKind {
    config: LinkConfig,
    line: Option<LineKind>,
}

/// A transmitter of constant rate and its queue, for packets of one size.
#[derive(Clone, Debug)]
struct LineKind {
    bottleneck: Bottleneck,
    rate: Rate,
    /// Size of each packet.
    size: Bytes,
    /// Size of a packet in transmission, framing included \[10⁻⁹ bit\].
    bits: u128,
    /// Transmission time of a packet.
    time: Duration,
    /// Transmission time of a mean packet of RED \[s\]; 0 for other disciplines.
    mean_packet: f64,
}

impl QueuedKind {
    /// Returns the kind of queued links of this model, for packets of `size`. Returns `None` if the model needs further stages, has the layout of netem, has
    /// a transmitter without a constant rate, or marks packets.
    pub(super) fn new(model: &LinkModel, size: Bytes) -> Option<Self> {
        let config = model.as_fixed()?;
        if config.layout == Layout::Netem || !config.is_direct_but_for_queue(Load::of(size)) {
            return None;
        }
        let line = match &config.bottleneck {
            None => None,
            Some(bottleneck) => Some(LineKind::new(bottleneck, size)?),
        };
        Some(Self { config: config.clone(), line })
    }
}

impl LineKind {
    fn new(bottleneck: &Bottleneck, size: Bytes) -> Option<Self> {
        let Service::Rate(rate) = bottleneck.service else { return None };
        let mean_packet = match bottleneck.discipline {
            Discipline::TailDrop | Discipline::HeadDrop => 0.0,
            Discipline::CoDel(codel) | Discipline::FqCoDel(FqCoDel { codel, .. }) if !codel.ecn => 0.0,
            Discipline::Pie(pie) if !pie.ecn => 0.0,
            Discipline::Red(red) if !red.ecn() => bottleneck.time_of_mean_packet(&red),
            // Marks would have to be carried with each waiting packet, but `Sent` has no field for marks.
            Discipline::CoDel(_) | Discipline::DualPi2(_) | Discipline::FqCoDel(_) | Discipline::Pie(_) | Discipline::Red(_) => return None,
        };
        // Framing is the same for all packets, because all packets have one size.
        let bits = giga_bits(bottleneck.framing.on_the_line(size));
        Some(Self { bottleneck: bottleneck.clone(), rate, size, bits, time: rate.transmission_time(bits), mean_packet })
    }

    /// Returns an idle link of this kind.
    fn idle<T>(&self) -> Fifo<Sent<T>, ()> {
        Fifo::new(&self.bottleneck.discipline)
    }
}

impl<T> Rules<Sent<T>> for LineKind {
    // All sums follow from the number of packets.
    type Sums = ();

    fn bottleneck(&self) -> &Bottleneck {
        &self.bottleneck
    }

    fn offered(&self, packet: &Sent<T>) -> Instant {
        packet.at
    }

    fn size(&self, _packet: &Sent<T>) -> Bytes {
        self.size
    }

    fn bits(&self, _packet: &Sent<T>) -> u128 {
        self.bits
    }

    fn flow(&self, _packet: &Sent<T>) -> Option<u32> {
        // All packets of a link are one flow.
        Some(0)
    }

    fn ecn(&self, _packet: &Sent<T>) -> Ecn {
        // `LineKind::new` refuses queues that mark packets, so no answer depends on this.
        Ecn::NotCapable
    }

    fn mark(&self, _packet: &mut Sent<T>) {}

    fn add(&self, _sums: &mut (), _packet: &Sent<T>) {}

    fn remove(&self, _sums: &mut (), _packet: &Sent<T>) {}

    fn waiting(&self, _sums: &(), count: usize) -> (u128, u128) {
        // Equal sizes make both sums products.
        (count as u128 * u128::from(self.size.get()), count as u128 * self.bits)
    }

    fn mean_packet(&self, _red: &Red) -> f64 {
        self.mean_packet
    }

    fn next(&self, now: Instant, left: u128) -> (Instant, u64) {
        // A whole packet takes a known time. The rest of a packet after a change of the rate takes a division of 128 bits.
        let time = if left == self.bits { self.time } else { self.rate.transmission_time(left) };
        (now.saturating_add(time), 0)
    }
}

/// A queued link, with the packet in transmission and the waiting packets.
#[derive(Clone, Debug)]
pub(super) struct QueuedLink<T> {
    direct: Direct,
    flow: Flow,
    /// Latest arrival of a packet so far.
    latest: Instant,
    /// The transmitter and its queue; `None` if the kind has no rate.
    line: Option<Fifo<Sent<T>, ()>>,
    /// Boxed, because few packets are dropped.
    drops: Option<Box<Drops>>,
}

/// Counters of dropped packets, and the drops ahead of the link's driver.
#[derive(Clone, Debug, Default)]
struct Drops {
    counted: Seldom,
    ahead: Ahead,
}

impl<T> QueuedLink<T> {
    /// Makes an idle link of this kind.
    pub(super) fn new(seed: u64, name: &LinkName, kind: &QueuedKind) -> Self {
        let line = kind.line.as_ref().map(LineKind::idle);
        Self { direct: Direct::new(seed, name, &kind.config), flow: Flow::default(), latest: Instant::ZERO, line, drops: None }
    }

    /// Offers a packet to the link; see [`SteppedLinks::offer`](super::SteppedLinks::offer).
    #[inline(always)]
    pub(super) fn offer(&mut self, (now, until): (Instant, Instant), kind: &QueuedKind, item: T, mut arrives: impl FnMut(Instant, bool, u64, T)) {
        let number = self.flow.offered;
        self.flow.offered += 1;
        let packet = Sent { at: now, number, item };
        let draws = self.direct.draws;
        match (self.direct.dropped(now, number, self.direct.words(number)), &mut self.line, &kind.line) {
            (Some(cause), ..) => self.count_drop(now, cause),
            (None, Some(line), Some(kind)) => {
                // A drop at the offer happens now, so it is not ahead of the driver.
                let dropped = |cause, _| count_drop(&mut self.drops, (now, now), cause);
                line.offer(now, kind, packet, || draws.packet(number).first(Purpose::Queue), dropped);
            }
            (None, ..) => self.propagate((now, until), packet, &mut arrives),
        }
    }

    /// Lets time pass until `next`; see [`SteppedLinks::pass`](super::SteppedLinks::pass).
    #[inline(always)]
    pub(super) fn pass(
        &mut self,
        (now, next, until): (Instant, Instant, Instant),
        kind: &QueuedKind,
        mut arrives: impl FnMut(Instant, bool, u64, T),
    ) {
        let Some(kind) = &kind.line else { return };
        while let Some(line) = &mut self.line
            && let Some((leaves, packet)) = line.leave(next, kind, |at, cause, _| count_drop(&mut self.drops, (now, at), cause))
        {
            self.propagate((leaves, until), packet, &mut arrives);
        }
    }

    #[inline(always)]
    fn propagate(&mut self, (leaves, until): (Instant, Instant), packet: Sent<T>, arrives: &mut (impl FnMut(Instant, bool, u64, T) + ?Sized)) {
        // The words are computed again from the packet's number, so waiting packets need not carry the words.
        let at = self.direct.arrival(leaves, packet.number, self.direct.words(packet.number));
        self.flow.deliver_by(until, packet.at, at);
        arrives(at, at <= self.latest, packet.number, packet.item);
        self.latest = at.max(self.latest);
    }

    #[inline(never)]
    fn count_drop(&mut self, now: Instant, cause: DropCause) {
        count_drop(&mut self.drops, (now, now), cause);
    }

    /// Takes back the drops after `at`; see [`SteppedLinks::stop`](super::SteppedLinks::stop).
    pub(super) fn stop(&mut self, at: Instant) {
        if let Some(Drops { counted, ahead }) = self.drops.as_deref_mut() {
            ahead.after(at).for_each(|dropped| counted.take_back(dropped));
        }
    }

    /// Changes the kind of the link from `before` to `kind`; see [`Staged::reconfigure`](crate::line::staged::Staged::reconfigure).
    pub(super) fn reconfigure(
        &mut self,
        (now, until): (Instant, Instant),
        (before, kind): (&QueuedKind, &QueuedKind),
        arrives: &mut dyn FnMut(Instant, bool, u64, T),
    ) {
        self.direct.reconfigure(now, &kind.config);
        self.line = match (self.line.take(), &before.line, &kind.line) {
            (Some(mut line), Some(before), Some(kind)) => {
                line.reconfigure(now, before, kind);
                Some(line)
            }
            (line, _, kind) => {
                // Without a queue after the change, packets in transmission and in the queue go on to the delay at once.
                let given_up = line.into_iter().flat_map(Fifo::dismantle);
                given_up.for_each(|packet| self.propagate((now, until), packet, arrives));
                kind.as_ref().map(LineKind::idle)
            }
        };
    }

    /// Converts the link to a link of any kind, with all packets and counters inside.
    pub(super) fn into_other(self, now: Instant, kind: &QueuedKind, info: PacketInfo) -> Other<T>
    where
        T: Clone,
    {
        let Self { direct, flow, latest, line, drops } = self;
        let Drops { counted, ahead } = drops.map_or_else(Drops::default, |drops| *drops);
        let stats = LinkStats { flow, seldom: counted, ..LinkStats::default() };
        let pipeline = match (line, &kind.line) {
            (Some(line), Some(LineKind { bottleneck, .. })) => {
                // The number and the offer go on with the packet, so the general stages draw the same random numbers.
                let boxed = |sent: Sent<T>| Queued::Own(sent.at, Packet::new(sent.number, info, Marks::default(), sent));
                let stage = BottleneckStage::resumed(bottleneck.clone(), line.converted(bottleneck, boxed));
                Pipeline::resumed(now, direct, kind.config.clone(), stage)
            }
            _ => Pipeline::Direct(Box::new(direct)),
        };
        Other { line: Line::resumed(stats, pipeline), latest, ahead }
    }

    /// Takes back the count of a delivered packet.
    pub(super) fn forget(&mut self, sent: Instant, arrival: Instant) {
        self.flow.forget(sent, arrival);
    }

    /// Returns the counters of the link.
    pub(super) fn stats(&self) -> LinkStats {
        LinkStats { flow: self.flow, seldom: self.drops.as_ref().map_or_else(Seldom::default, |drops| drops.counted), ..LinkStats::default() }
    }
}

/// Counts a drop at the second instant of `span`. The first instant is the latest instant of the driver, possibly earlier.
fn count_drop(drops: &mut Option<Box<Drops>>, span: (Instant, Instant), cause: DropCause) {
    let Drops { counted, ahead } = &mut **drops.get_or_insert_default();
    counted.dropped[cause.index()] += 1;
    ahead.note(span, Some(cause));
}
