//! Links with one line of one rate, before which packets of one size wait under a discipline that looks at them while they wait: CoDel, RED, dropping from the head.
//!
//! A packet's time on the line is known, so that all that is kept is when the line will be free, the discipline's memory, and the packets that wait. It does what
//! [`BottleneckStage`](crate::stages::queue::BottleneckStage) does between the stages of [`Staged`](crate::line::staged::Staged), in a tenth of the memory.

use alloc::collections::VecDeque;

use cohaptic_units::{Bytes, Instant};

use super::Offer;
use crate::fates::fate::DropCause;
use crate::fates::stats::{Flow, LinkStats};
use crate::line::model::LinkModel;
use crate::network::direct_links::kind::{Kind, Line, Remembered};
use crate::random::{Purpose, Stream};
use crate::stages::config::{Layout, LinkConfig};
use crate::stages::queue::{CoDelState, CoDelVerdict, Discipline, EqualPackets, Load, RedState, RedVerdict, idle_packets};

/// What such links of one configuration have in common.
#[derive(Clone, Debug)]
pub(super) struct QueuedKind {
    /// Loss before the line, and delay behind it.
    stages: Kind,
    queue: EqualPackets,
    discipline: Discipline,
    size: Bytes,
    /// How long a mean packet of RED is on the line \[s\].
    mean_packet: f64,
}

impl QueuedKind {
    /// The kind of such links, for packets of that size; `None` if they are no such links, or mark packets.
    pub(super) fn new(model: &LinkModel, size: Bytes) -> Option<Self> {
        let config: &LinkConfig = model.as_fixed()?;
        let bottleneck = config.bottleneck.as_ref()?;
        if config.layout == Layout::Netem || !config.is_direct_but_for_queue(Load::of(size)) {
            return None;
        }
        let mean_packet = match bottleneck.discipline {
            Discipline::TailDrop | Discipline::HeadDrop => 0.0,
            Discipline::CoDel(codel) if !codel.ecn => 0.0,
            Discipline::Red(red) if !red.ecn() => bottleneck.time_of_mean_packet(&red),
            Discipline::CoDel(_) | Discipline::Red(_) => return None,
        };
        let queue = EqualPackets::of_any_discipline(bottleneck, size)?;
        Some(Self { stages: Kind::with_line(config, Line::Queued(queue))?, queue, discipline: bottleneck.discipline, size, mean_packet })
    }
}

/// One such link, with the packets that wait.
#[derive(Clone, Debug)]
pub(super) struct QueuedLink<T> {
    draws: Stream,
    flow: Flow,
    latest: Instant,
    /// When the packet on the line leaves; `None` if there is none.
    leaves: Option<Instant>,
    /// Since when the line has had nothing to send.
    idle_since: Instant,
    waiting: VecDeque<Waiting<T>>,
    discipline: DisciplineState,
    remembered: Remembered,
    lost: u64,
    /// Packets that the discipline dropped before the queue was full.
    dropped: u64,
    found_full: u64,
}

/// What a discipline remembers.
#[derive(Clone, Debug)]
enum DisciplineState {
    Nothing,
    CoDel(CoDelState),
    Red(RedState),
}

#[derive(Clone, Debug)]
struct Waiting<T> {
    since: Instant,
    number: u64,
    item: T,
}

impl<T> QueuedLink<T> {
    /// An idle link of that kind.
    pub(super) fn new(draws: Stream, kind: &QueuedKind) -> Self {
        let discipline = match kind.discipline {
            Discipline::TailDrop | Discipline::HeadDrop => DisciplineState::Nothing,
            Discipline::CoDel(_) => DisciplineState::CoDel(CoDelState::default()),
            Discipline::Red(_) => DisciplineState::Red(RedState::default()),
        };
        Self {
            draws,
            flow: Flow::default(),
            latest: Instant::ZERO,
            leaves: None,
            idle_since: Instant::ZERO,
            waiting: VecDeque::new(),
            discipline,
            remembered: kind.stages.beginning(draws),
            lost: 0,
            dropped: 0,
            found_full: 0,
        }
    }

    /// See [`SteppedLinks::offer`](super::SteppedLinks::offer).
    #[inline(always)]
    pub(super) fn offer(
        &mut self,
        Offer { now, next, until }: Offer,
        kind: &mut QueuedKind,
        item: T,
        mut arrives: impl FnMut(Instant, bool, u64, T),
    ) {
        let number = self.flow.offered;
        self.flow.offered += 1;
        self.take((now, until), kind, Waiting { since: now, number, item }, &mut arrives);
        self.pass((next, until), kind, arrives);
    }

    /// See [`SteppedLinks::pass`](super::SteppedLinks::pass).
    #[inline(always)]
    pub(super) fn pass(&mut self, (next, until): (Instant, Instant), kind: &mut QueuedKind, mut arrives: impl FnMut(Instant, bool, u64, T)) {
        while let Some(leaves) = self.leaves.filter(|leaves| *leaves <= next) {
            match self.waiting.pop_front() {
                Some(first) => self.serve((leaves, until), kind, first, &mut arrives),
                None => self.run_empty(leaves),
            }
        }
    }

    /// A packet is lost, or dropped at once, or on the line, or waits.
    #[inline(always)]
    fn take(&mut self, (now, until): (Instant, Instant), kind: &mut QueuedKind, packet: Waiting<T>, arrives: &mut impl FnMut(Instant, bool, u64, T)) {
        let draws = self.draws.packet(packet.number);
        let [word, _] = if kind.stages.is_random { draws.loss_and_jitter() } else { [0; 2] };
        if kind.stages.loses(&mut self.remembered, word, draws) {
            self.lost += 1;
            return;
        }
        let waiting = self.waiting.len() as u64;
        if let (DisciplineState::Red(state), Discipline::Red(red)) = (&mut self.discipline, &kind.discipline) {
            let idle = if self.leaves.is_none() { now.saturating_duration_since(self.idle_since) } else { core::time::Duration::ZERO };
            // Time that was idle counts once.
            self.idle_since = now;
            let queued = u128::from(waiting) * u128::from(kind.size.get());
            let verdict = state.verdict(red, queued, idle_packets(idle, kind.mean_packet), false, draws.first(Purpose::Queue));
            if verdict == RedVerdict::Drop {
                self.dropped += 1;
                return;
            }
        }
        let Some(leaves) = self.leaves else {
            return self.serve((now, until), kind, packet, arrives);
        };
        while !kind.queue.admits(now, leaves, self.waiting.len() as u64) {
            self.found_full += 1;
            if kind.discipline != Discipline::HeadDrop || self.waiting.pop_front().is_none() {
                return;
            }
        }
        self.waiting.push_back(packet);
    }

    /// Begins to send a packet, or one behind it if CoDel drops it. When it arrives is known then.
    #[inline(always)]
    fn serve(
        &mut self,
        (now, until): (Instant, Instant),
        kind: &mut QueuedKind,
        mut packet: Waiting<T>,
        arrives: &mut impl FnMut(Instant, bool, u64, T),
    ) {
        if let (DisciplineState::CoDel(state), Discipline::CoDel(codel)) = (&mut self.discipline, &kind.discipline) {
            let left = |waiting: usize| waiting as u128 * u128::from(kind.size.get());
            while state.verdict(codel, now, now.saturating_duration_since(packet.since), left(self.waiting.len()), false) == CoDelVerdict::Drop {
                self.dropped += 1;
                match self.waiting.pop_front() {
                    Some(next) => packet = next,
                    None => return self.run_empty(now),
                }
            }
        }
        let leaves = kind.queue.departure(now);
        self.leaves = Some(leaves);
        let draws = self.draws.packet(packet.number);
        let [_, word] = if kind.stages.is_random { draws.loss_and_jitter() } else { [0; 2] };
        let at = kind.stages.arrival(leaves, &mut self.remembered, word, draws);
        self.flow.deliver_by(until, packet.since, at);
        arrives(at, at <= self.latest, packet.number, packet.item);
        self.latest = at.max(self.latest);
    }

    /// Nothing is left to send.
    fn run_empty(&mut self, now: Instant) {
        self.leaves = None;
        self.idle_since = now;
        if let DisciplineState::CoDel(state) = &mut self.discipline {
            state.empty();
        }
    }

    /// Takes back that a packet is delivered.
    pub(super) fn forget(&mut self, sent: Instant, arrival: Instant) {
        self.flow.forget(sent, arrival);
    }

    /// The counters.
    pub(super) fn stats(&self) -> LinkStats {
        let Flow { offered, delivered, delay_nanos } = self.flow;
        let cause = match self.discipline {
            DisciplineState::Red(_) => DropCause::Red,
            DisciplineState::Nothing | DisciplineState::CoDel(_) => DropCause::CoDel,
        };
        let dropped = [(DropCause::Loss, self.lost), (DropCause::QueueFull, self.found_full), (cause, self.dropped)];
        LinkStats::counted(offered, delivered, delay_nanos, dropped)
    }
}
