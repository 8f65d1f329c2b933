//! Links in which packets wait for one transmitter of constant rate only, for packets of one size.
//!
//! A link keeps the stages that decide at once, the packet in transmission, and the waiting packets. Its answers are those of [`BottleneckStage`] between the
//! stages of [`Staged`](crate::line::staged::Staged), with less memory per link: equal packet sizes make the waiting bytes and bits multiples of the number
//! of packets.
//!

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use core::time::Duration;

use cohaptic_units::{Bytes, Instant, Rate};

use super::ahead::Ahead;
use super::{Other, Sent};
use crate::fates::fate::DropCause;
use crate::fates::stats::{Flow, LinkStats, Seldom};
use crate::line::Line;
use crate::line::direct::Direct;
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::line::pipeline::Pipeline;
use crate::packet::{Carried, Marks, Packet, PacketInfo};
use crate::random::Purpose;
use crate::stages::config::{Layout, LinkConfig};
use crate::stages::queue::{
    Bottleneck, BottleneckStage, CoDelState, CoDelVerdict, Discipline, InService, Load, QueueLimit, RedState, RedVerdict, Service, Waiting,
    giga_bits, idle_packets,
};

/// Data that all queued links of one configuration share.
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
            Discipline::CoDel(codel) if !codel.ecn => 0.0,
            Discipline::Red(red) if !red.ecn() => bottleneck.time_of_mean_packet(&red),
            // Marks would have to be carried with each waiting packet, for which `Offered` has no field.
            Discipline::CoDel(_) | Discipline::Red(_) => return None,
        };
        let bits = giga_bits(bottleneck.framing.on_the_line(size));
        Some(Self { bottleneck: bottleneck.clone(), rate, size, bits, time: rate.transmission_time(bits), mean_packet })
    }

    /// Returns the size of this number of packets \[byte\].
    fn bytes(&self, packets: usize) -> u128 {
        packets as u128 * u128::from(self.size.get())
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
    line: Option<LineState<T>>,
    /// Boxed, because few packets are dropped.
    drops: Option<Box<Drops>>,
}

/// Counters of dropped packets, and the drops that the link's driver has not reached.
#[derive(Clone, Debug, Default)]
struct Drops {
    counted: Seldom,
    ahead: Ahead,
}

/// The packet in transmission and the waiting packets.
#[derive(Clone, Debug)]
struct LineState<T> {
    on_line: Option<OnLine<T>>,
    /// Instant since which the transmitter has had nothing to send. Meaningful while `on_line` is empty.
    idle_since: Instant,
    waiting: VecDeque<Offered<T>>,
    discipline: DisciplineState,
}

/// A packet in transmission: at `since`, `left` of the packet was still to be sent \[10⁻⁹ bit\]; its transmission ends at `leaves`.
#[derive(Clone, Debug)]
struct OnLine<T> {
    packet: Offered<T>,
    since: Instant,
    left: u128,
    leaves: Instant,
}

/// A packet, its number on the link, and the instant of its offer.
#[derive(Clone, Debug)]
struct Offered<T> {
    at: Instant,
    number: u64,
    item: T,
}

/// State that a discipline keeps between packets.
#[derive(Clone, Debug)]
enum DisciplineState {
    Nothing,
    CoDel(CoDelState),
    Red(RedState),
}

impl DisciplineState {
    fn new(discipline: &Discipline) -> Self {
        match discipline {
            Discipline::TailDrop | Discipline::HeadDrop => Self::Nothing,
            Discipline::CoDel(_) => Self::CoDel(CoDelState::default()),
            Discipline::Red(_) => Self::Red(RedState::default()),
        }
    }
}

impl<T> QueuedLink<T> {
    /// Makes an idle link of this kind.
    pub(super) fn new(seed: u64, name: &LinkName, kind: &QueuedKind) -> Self {
        let line = kind.line.as_ref().map(LineState::new);
        Self { direct: Direct::new(seed, name, &kind.config), flow: Flow::default(), latest: Instant::ZERO, line, drops: None }
    }

    /// Offers a packet to the link; see [`SteppedLinks::offer`](super::SteppedLinks::offer).
    #[inline(always)]
    pub(super) fn offer(&mut self, (now, until): (Instant, Instant), kind: &QueuedKind, item: T, mut arrives: impl FnMut(Instant, bool, u64, T)) {
        let number = self.flow.offered;
        self.flow.offered += 1;
        let packet = Offered { at: now, number, item };
        let draws = self.direct.draws;
        match (self.direct.dropped(now, number, self.direct.words(number)), &mut self.line, &kind.line) {
            (Some(cause), ..) => self.count_drop(now, cause),
            (None, Some(line), Some(kind)) => {
                let dropped = |cause| count_drop(&mut self.drops, (now, now), cause);
                line.take(now, kind, packet, || draws.packet(number).first(Purpose::Queue), dropped);
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
            && let Some((leaves, packet)) = line.leave(next, kind, |at, cause| count_drop(&mut self.drops, (now, at), cause))
        {
            self.propagate((leaves, until), packet, &mut arrives);
        }
    }

    #[inline(always)]
    fn propagate(&mut self, (leaves, until): (Instant, Instant), packet: Offered<T>, arrives: &mut (impl FnMut(Instant, bool, u64, T) + ?Sized)) {
        // The words are computed again from the packet's number, so that waiting packets need not carry them.
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
                let given_up = line.into_iter().flat_map(LineState::dismantle);
                given_up.for_each(|packet| self.propagate((now, until), packet, arrives));
                kind.as_ref().map(LineState::new)
            }
        };
    }

    /// Converts the link to one of any kind, with all packets and counters inside.
    pub(super) fn into_other(self, now: Instant, kind: &QueuedKind, info: PacketInfo) -> Other<T>
    where
        T: Clone,
    {
        let Self { direct, flow, latest, line, drops } = self;
        let Drops { counted, ahead } = drops.map_or_else(Drops::default, |drops| *drops);
        let stats = LinkStats { flow, seldom: counted };
        let pipeline = match (line, &kind.line) {
            (Some(line), Some(line_kind)) => Pipeline::resumed(now, direct, kind.config.clone(), line.into_stage(line_kind, info)),
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
        LinkStats { flow: self.flow, seldom: self.drops.as_ref().map_or_else(Seldom::default, |drops| drops.counted) }
    }
}

/// Counts a drop at the second instant of `span`. The first instant is the latest one of the driver, which may be earlier.
fn count_drop(drops: &mut Option<Box<Drops>>, span: (Instant, Instant), cause: DropCause) {
    let Drops { counted, ahead } = &mut **drops.get_or_insert_default();
    counted.dropped[cause.index()] += 1;
    ahead.note(span, Some(cause));
}

impl<T> LineState<T> {
    fn new(kind: &LineKind) -> Self {
        let discipline = DisciplineState::new(&kind.bottleneck.discipline);
        Self { on_line: None, idle_since: Instant::ZERO, waiting: VecDeque::new(), discipline }
    }

    /// Drops a packet, sends it if the transmitter is idle, or lets it wait; with head drop, waiting packets may be dropped in its place. `word` gives the
    /// packet's random word for queues, and is called by RED only.
    #[inline(always)]
    fn take(&mut self, now: Instant, kind: &LineKind, packet: Offered<T>, word: impl FnOnce() -> u64, mut dropped: impl FnMut(DropCause)) {
        if let (DisciplineState::Red(state), Discipline::Red(red)) = (&mut self.discipline, &kind.bottleneck.discipline) {
            let idle = if self.on_line.is_none() { now.saturating_duration_since(self.idle_since) } else { Duration::ZERO };
            // Idle time since the previous packet is counted now, so that the next packet does not count it again.
            self.idle_since = now;
            let verdict = state.verdict(red, kind.bytes(self.waiting.len()), idle_packets(idle, kind.mean_packet), false, word());
            if verdict == RedVerdict::Drop {
                return dropped(DropCause::Red);
            }
        }
        if self.on_line.is_none() {
            return self.serve(now, kind, packet, dropped);
        }
        // Head drop removes waiting packets until the new packet has room. Other disciplines drop the new packet, as does head drop once no packet waits.
        while !self.admits(now, kind) {
            dropped(DropCause::QueueFull);
            if kind.bottleneck.discipline != Discipline::HeadDrop || self.waiting.pop_front().is_none() {
                return;
            }
        }
        self.waiting.push_back(packet);
    }

    /// Returns whether the queue's limit has room for one more packet.
    fn admits(&self, now: Instant, kind: &LineKind) -> bool {
        let Some(limit) = kind.bottleneck.limit else { return true };
        let (packets, bytes) = (self.waiting.len(), kind.bytes(self.waiting.len()));
        let time = match (limit, &self.on_line) {
            // The waiting time is that of the rest of the packet in transmission plus that of all waiting packets.
            (QueueLimit::Time(_), Some(on_line)) => {
                let sent = kind.rate.bits_sent(now.saturating_duration_since(on_line.since));
                kind.rate.transmission_time(on_line.left.saturating_sub(sent) + packets as u128 * kind.bits)
            }
            _ => Duration::ZERO,
        };
        limit.admits(Waiting { packets: packets as u64, bytes, time }, kind.size)
    }

    /// Removes the packet whose transmission ends by `next`, and returns the packet and its instant. The first waiting packet is in transmission afterwards.
    #[inline(always)]
    fn leave(&mut self, next: Instant, kind: &LineKind, mut dropped: impl FnMut(Instant, DropCause)) -> Option<(Instant, Offered<T>)> {
        let OnLine { packet, leaves, .. } = self.on_line.take_if(|on_line| on_line.leaves <= next)?;
        match self.waiting.pop_front() {
            Some(first) => self.serve(leaves, kind, first, |cause| dropped(leaves, cause)),
            None => self.run_empty(leaves),
        }
        Some((leaves, packet))
    }

    /// Begins to send `packet`, or the first packet after it that CoDel does not drop.
    #[inline(always)]
    fn serve(&mut self, now: Instant, kind: &LineKind, mut packet: Offered<T>, mut dropped: impl FnMut(DropCause)) {
        if let (DisciplineState::CoDel(state), Discipline::CoDel(codel)) = (&mut self.discipline, &kind.bottleneck.discipline) {
            let waited = |packet: &Offered<T>| now.saturating_duration_since(packet.at);
            while state.verdict(codel, now, waited(&packet), kind.bytes(self.waiting.len()), false) == CoDelVerdict::Drop {
                dropped(DropCause::CoDel);
                match self.waiting.pop_front() {
                    Some(next) => packet = next,
                    None => return self.run_empty(now),
                }
            }
        }
        self.on_line = Some(OnLine { packet, since: now, left: kind.bits, leaves: now.saturating_add(kind.time) });
        // Without waiting packets the transmitter becomes idle, as if the dropped packet had left.
    }

    /// Notes that the transmitter has nothing to send from `now` on.
    fn run_empty(&mut self, now: Instant) {
        self.idle_since = now;
        if let DisciplineState::CoDel(state) = &mut self.discipline {
            state.empty();
        }
    }

    /// Changes the kind of the transmitter; see [`BottleneckStage::reconfigure`].
    fn reconfigure(&mut self, now: Instant, before: &LineKind, kind: &LineKind) {
        if let Some(OnLine { since, left, leaves, .. }) = &mut self.on_line {
            // Bits sent so far count at the rate before the change, and the rest of the packet takes the time of the new rate.
            *left = left.saturating_sub(before.rate.bits_sent(now.saturating_duration_since(*since)));
            (*since, *leaves) = (now, now.saturating_add(kind.rate.transmission_time(*left)));
        }
        // A discipline with other parameters keeps its state. Another discipline starts anew.
        if core::mem::discriminant(&before.bottleneck.discipline) != core::mem::discriminant(&kind.bottleneck.discipline) {
            self.discipline = DisciplineState::new(&kind.bottleneck.discipline);
        }
    }

    /// Returns the packet in transmission, then the waiting packets in their order.
    fn dismantle(self) -> impl Iterator<Item = Offered<T>> {
        self.on_line.into_iter().map(|on_line| on_line.packet).chain(self.waiting)
    }

    /// Converts the transmitter to the stage that takes packets of any size.
    fn into_stage(self, kind: &LineKind, info: PacketInfo) -> BottleneckStage<Sent<T>> {
        let Self { on_line, idle_since, waiting, discipline } = self;
        let packet = |Offered { at, number, item }| -> (Instant, Carried<Sent<T>>) {
            (at, Packet::new(number, info, Marks::default(), Sent { at, number, item }))
        };
        let in_service = on_line.map(|OnLine { packet: offered, since, left, leaves }| InService {
            packet: packet(offered).1,
            since,
            left,
            next: leaves,
            opportunities: 0,
        });
        let (red, codel) = match discipline {
            DisciplineState::Nothing => (RedState::default(), CoDelState::default()),
            DisciplineState::CoDel(codel) => (RedState::default(), codel),
            DisciplineState::Red(red) => (red, CoDelState::default()),
        };
        BottleneckStage::resumed(kind.bottleneck.clone(), in_service, waiting.into_iter().map(packet).collect(), (idle_since, red, codel))
    }
}
