//! Queue before a transmitter: choice of the packets to wait, to transmit, to mark and to drop. First in, first out, except with FQ-CoDel, which has a queue
//! per flow, and DualPI2, which has two queues.
//!
//! The queue serves packets of any type over any transmitter; [`Rules`] has the differences. A stage of a link keeps packets of any size, each boxed, over
//! transmitters of constant rate or of recorded opportunities ([`BottleneckStage`](super::BottleneckStage)). A link of a large mesh keeps packets of one size
//! over a transmitter of constant rate, with size and transmission time known beforehand and stored once for all links of a kind.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use core::time::Duration;

use cohaptic_units::{Bytes, Ecn, Instant};

use super::bottleneck::{Bottleneck, Discipline, idle_packets};
use super::codel::{self, CoDelState};
use super::dualpi2::DualQueues;
use super::fq_codel::FlowQueues;
use super::limit::{QueueLimit, Waiting};
use super::pie::{self, PieState};
use super::red::{self, Red, RedState};
use crate::fates::fate::DropCause;

/// Packets of type `P` and their transmitter.
pub(crate) trait Rules<P> {
    /// Sums over the waiting packets, as far as not determined by the number of packets.
    type Sums: Default;

    fn bottleneck(&self) -> &Bottleneck;

    /// Returns the instant of a packet's offer.
    fn offered(&self, packet: &P) -> Instant;

    /// Returns the size of a packet, framing not counted.
    fn size(&self, packet: &P) -> Bytes;

    /// Returns the bits to transmit for a packet, in 10⁻⁹ bit.
    fn bits(&self, packet: &P) -> u128;

    /// Returns the number of a packet's flow, or `None` for a packet of the cross-traffic: all these packets are one flow, which is no flow of the link.
    fn flow(&self, packet: &P) -> Option<u32>;

    /// Returns the ECN codepoint of a packet, with the marks that the packet has got so far.
    fn ecn(&self, packet: &P) -> Ecn;

    fn mark(&self, packet: &mut P);

    fn add(&self, sums: &mut Self::Sums, packet: &P);

    fn remove(&self, sums: &mut Self::Sums, packet: &P);

    /// Returns the bytes of `count` waiting packets, framing not counted, and the bits to transmit for these packets, in 10⁻⁹ bit.
    fn waiting(&self, sums: &Self::Sums, count: usize) -> (u128, u128);

    /// Returns the transmission time of RED's mean packet \[s\].
    fn mean_packet(&self, red: &Red) -> f64;

    /// Returns the instant of the next event of a packet with `left` bits (10⁻⁹ bit) to send from `now` on: the departure of the packet, or, on a transmitter
    /// with a recording, the next opportunity to send, with the number of opportunities at this instant.
    fn next(&self, now: Instant, left: u128) -> (Instant, u64);
}

/// Waiting packets, the packet in transmission, and the memory of the discipline.
#[derive(Clone, Debug)]
pub(crate) struct Fifo<P, S> {
    /// Waiting packets, the oldest first. Empty with FQ-CoDel and DualPI2, whose queues are in `discipline`.
    waiting: VecDeque<P>,
    sums: S,
    on_line: Option<OnLine<P>>,
    /// Instant since which the transmitter is idle, or up to which idle time has been counted. Meaningful only with RED, while no packet is in transmission.
    idle_since: Instant,
    discipline: DisciplineState<P>,
}

/// Packet in transmission.
#[derive(Clone, Debug)]
pub(crate) struct OnLine<P> {
    pub(crate) packet: P,
    /// Begin of sending the remaining bits at the present rate.
    since: Instant,
    /// Remaining bits at `since`, in 10⁻⁹ bit.
    pub(crate) left: u128,
    /// Instant of the next event, from [`Rules::next`].
    pub(crate) next: Instant,
    /// Number of opportunities at `next`. Used only for a transmitter with a recording.
    pub(crate) opportunities: u64,
}

/// State of a discipline between packets. The larger states are boxed, because a large mesh has many queues and most of them have none of these disciplines.
#[derive(Clone, Debug)]
enum DisciplineState<P> {
    Nothing,
    CoDel(CoDelState),
    DualPi2(Box<DualQueues<P>>),
    FqCoDel(Box<FlowQueues<P>>),
    Pie(Box<PieState>),
    Red(RedState),
}

impl<P> DisciplineState<P> {
    fn new(discipline: &Discipline) -> Self {
        match discipline {
            Discipline::TailDrop | Discipline::HeadDrop => Self::Nothing,
            Discipline::CoDel(_) => Self::CoDel(CoDelState::default()),
            Discipline::DualPi2(_) => Self::DualPi2(Box::new(DualQueues::new())),
            Discipline::FqCoDel(_) => Self::FqCoDel(Box::new(FlowQueues::new())),
            Discipline::Pie(pie) => Self::Pie(Box::new(PieState::new(pie))),
            Discipline::Red(_) => Self::Red(RedState::default()),
        }
    }

    fn converted<Q>(self, convert: impl FnMut(P) -> Q) -> DisciplineState<Q> {
        match self {
            Self::Nothing => DisciplineState::Nothing,
            Self::CoDel(state) => DisciplineState::CoDel(state),
            Self::DualPi2(queues) => DisciplineState::DualPi2(Box::new(queues.converted(convert))),
            Self::FqCoDel(flows) => DisciplineState::FqCoDel(Box::new(flows.converted(convert))),
            Self::Pie(state) => DisciplineState::Pie(state),
            Self::Red(state) => DisciplineState::Red(state),
        }
    }

    /// Returns the number of packets that wait in queues of the discipline, or `None` if the discipline has no queues of its own.
    fn len(&self) -> Option<usize> {
        match self {
            Self::DualPi2(queues) => Some(queues.len()),
            Self::FqCoDel(flows) => Some(flows.len()),
            Self::Nothing | Self::CoDel(_) | Self::Pie(_) | Self::Red(_) => None,
        }
    }

    /// Calls `take` for each packet that waits in a queue of the discipline, in the order of the queues.
    fn for_each(&self, take: impl FnMut(&P)) {
        match self {
            Self::DualPi2(queues) => queues.packets().for_each(take),
            Self::FqCoDel(flows) => flows.packets().for_each(take),
            Self::Nothing | Self::CoDel(_) | Self::Pie(_) | Self::Red(_) => {}
        }
    }

    /// Appends the packets that wait in queues of the discipline to `packets`, in the order of their offers.
    fn empty_into(self, packets: &mut VecDeque<P>) {
        match self {
            Self::DualPi2(queues) => packets.extend(queues.into_packets()),
            Self::FqCoDel(flows) => packets.extend(flows.into_packets()),
            Self::Nothing | Self::CoDel(_) | Self::Pie(_) | Self::Red(_) => {}
        }
    }
}

impl<P, S: Default> Fifo<P, S> {
    /// Returns an empty queue before an idle transmitter.
    pub(crate) fn new(discipline: &Discipline) -> Self {
        Self { waiting: VecDeque::new(), sums: S::default(), on_line: None, idle_since: Instant::ZERO, discipline: DisciplineState::new(discipline) }
    }

    pub(crate) fn on_line(&self) -> Option<&OnLine<P>> {
        self.on_line.as_ref()
    }

    /// Returns the sums over the waiting packets.
    pub(crate) const fn sums(&self) -> &S {
        &self.sums
    }

    /// Returns the waiting packets, the oldest first.
    pub(crate) fn waiting(&self) -> impl Iterator<Item = &P> {
        self.waiting.iter()
    }

    /// Returns the packet in transmission, for a transmitter with opportunities.
    pub(crate) fn on_line_mut(&mut self) -> &mut Option<OnLine<P>> {
        &mut self.on_line
    }

    /// Takes a packet. The packet is then sent, waits, or is dropped; older packets may be dropped in its place. `word` gives the packet's random word for
    /// queues, and is called by RED and PIE only. `dropped` takes each dropped packet.
    #[inline(always)]
    pub(crate) fn offer<R: Rules<P, Sums = S>>(
        &mut self,
        now: Instant,
        rules: &R,
        mut packet: P,
        word: impl Fn() -> u64,
        mut dropped: impl FnMut(DropCause, P),
    ) {
        // RED sees every offer, even at an idle transmitter, because its average moves with every packet.
        if let Discipline::Red(red) = &rules.bottleneck().discipline {
            match self.red_verdict(now, rules, red, &packet, word()) {
                red::Verdict::Pass => {}
                red::Verdict::Mark => rules.mark(&mut packet),
                red::Verdict::Drop => return dropped(DropCause::Red, packet),
            }
        }
        // With several queues, the next packet is chosen in turn, even if only one packet waits: its queue then has had a part of its turn.
        match rules.bottleneck().discipline {
            Discipline::FqCoDel(_) => return self.offer_to_flow(now, rules, packet, dropped),
            Discipline::DualPi2(_) => return self.offer_to_dual(now, rules, packet, dropped),
            Discipline::TailDrop | Discipline::HeadDrop | Discipline::CoDel(_) | Discipline::Pie(_) | Discipline::Red(_) => {}
        }
        // An idle transmitter implies an empty queue, so no limit applies.
        if self.on_line.is_none() {
            return self.serve(now, rules, packet, dropped);
        }
        // Head drop removes waiting packets until the new packet has room. Other disciplines drop the new packet, as does head drop once no packet waits.
        while !self.admits(now, rules, &packet) {
            let head = if rules.bottleneck().discipline == Discipline::HeadDrop { self.take_head(rules) } else { None };
            match head {
                Some(head) => dropped(DropCause::QueueFull, head),
                None => {
                    if let DisciplineState::Pie(state) = &mut self.discipline {
                        state.overflows();
                    }
                    return dropped(DropCause::QueueFull, packet);
                }
            }
        }
        // PIE sees only packets that find room. At an idle transmitter no packet waits, and PIE drops none.
        if matches!(rules.bottleneck().discipline, Discipline::Pie(_)) {
            match self.pie_verdict(now, rules, &packet, word) {
                pie::Verdict::Pass => {}
                pie::Verdict::Mark => rules.mark(&mut packet),
                pie::Verdict::Drop => return dropped(DropCause::Pie, packet),
            }
        }
        rules.add(&mut self.sums, &packet);
        self.waiting.push_back(packet);
    }

    /// Removes the packet leaving the transmitter by `until`, and returns it with its instant. The next packet is in transmission afterwards. For a
    /// transmitter of constant rate.
    #[inline(always)]
    pub(crate) fn leave<R: Rules<P, Sums = S>>(
        &mut self,
        until: Instant,
        rules: &R,
        mut dropped: impl FnMut(Instant, DropCause, P),
    ) -> Option<(Instant, P)> {
        let OnLine { packet, next, .. } = self.on_line.take_if(|on_line| on_line.next <= until)?;
        // The next transmission begins at the departure, not at the later `until`.
        self.serve_next(next, rules, |cause, packet| dropped(next, cause, packet));
        Some((next, packet))
    }

    /// Begins to send the oldest waiting packet, or notes that the transmitter is idle if no packet waits.
    #[inline(always)]
    pub(crate) fn serve_next<R: Rules<P, Sums = S>>(&mut self, now: Instant, rules: &R, dropped: impl FnMut(DropCause, P)) {
        if self.discipline.len().is_some() {
            return self.serve_next_of_several(now, rules, dropped);
        }
        match self.take_head(rules) {
            Some(packet) => self.serve(now, rules, packet, dropped),
            None => self.idle_since = now,
        }
    }

    /// Begins to send the next packet of a discipline with several queues.
    #[inline(never)]
    fn serve_next_of_several<R: Rules<P, Sums = S>>(&mut self, now: Instant, rules: &R, dropped: impl FnMut(DropCause, P)) {
        let Self { sums, discipline, .. } = self;
        let packet = match (discipline, &rules.bottleneck().discipline) {
            (DisciplineState::FqCoDel(flows), Discipline::FqCoDel(fq_codel)) => flows.take(now, rules, fq_codel, sums, dropped),
            (DisciplineState::DualPi2(queues), Discipline::DualPi2(dualpi2)) => queues.take(now, rules, dualpi2, sums, dropped),
            _ => None,
        };
        if let Some(packet) = packet {
            self.send(now, rules, packet);
        }
    }

    /// Takes a packet into one of two queues, if the limit admits the packet.
    #[inline(never)]
    fn offer_to_dual<R: Rules<P, Sums = S>>(&mut self, now: Instant, rules: &R, packet: P, mut dropped: impl FnMut(DropCause, P)) {
        let is_idle = self.on_line.is_none();
        if !is_idle && !self.admits(now, rules, &packet) {
            return dropped(DropCause::QueueFull, packet);
        }
        let (DisciplineState::DualPi2(queues), Discipline::DualPi2(dualpi2)) = (&mut self.discipline, &rules.bottleneck().discipline) else { return };
        rules.add(&mut self.sums, &packet);
        queues.push(now, rules, dualpi2, packet);
        if is_idle {
            self.serve_next_of_several(now, rules, dropped);
        }
    }

    /// Takes a packet into the queue of its flow, and drops packets of the longest queue until the limit holds.
    #[inline(never)]
    fn offer_to_flow<R: Rules<P, Sums = S>>(&mut self, now: Instant, rules: &R, packet: P, mut dropped: impl FnMut(DropCause, P)) {
        let (DisciplineState::FqCoDel(flows), Discipline::FqCoDel(fq_codel)) = (&mut self.discipline, &rules.bottleneck().discipline) else { return };
        let bits = rules.bits(&packet);
        rules.add(&mut self.sums, &packet);
        let newest = flows.push(rules, fq_codel, packet);
        if self.on_line.is_none() {
            return self.serve_next_of_several(now, rules, dropped);
        }
        // The newest packet counts from the beginning, so the longest queue may be its own. Without the newest packet the others are within the limit, or as
        // far beyond a limit that was made smaller as before.
        while !self.holds(now, rules, bits) {
            let Self { sums, discipline, .. } = self;
            let DisciplineState::FqCoDel(flows) = discipline else { return };
            let last = flows.drop_from_longest(rules, sums, &mut dropped);
            if last.is_none_or(|last| last == newest) {
                return;
            }
        }
    }

    /// Begins to send `packet`, or the first packet after `packet` without a drop by CoDel.
    #[inline(always)]
    fn serve<R: Rules<P, Sums = S>>(&mut self, now: Instant, rules: &R, mut packet: P, mut dropped: impl FnMut(DropCause, P)) {
        // CoDel decides at the exit of the queue, unlike all other disciplines.
        if let Discipline::CoDel(codel) = &rules.bottleneck().discipline {
            while let DisciplineState::CoDel(state) = &mut self.discipline {
                let (sojourn, left) = (now.saturating_duration_since(rules.offered(&packet)), rules.waiting(&self.sums, self.waiting.len()).0);
                match state.verdict(codel, now, sojourn, left, rules.ecn(&packet).is_capable()) {
                    codel::Verdict::Send => break,
                    codel::Verdict::Mark => {
                        rules.mark(&mut packet);
                        break;
                    }
                    codel::Verdict::Drop => {
                        dropped(DropCause::CoDel, packet);
                        // CoDel drops a packet only while others wait.
                        let Some(next) = self.take_head(rules) else { return };
                        packet = next;
                    }
                }
            }
        }
        if let (DisciplineState::Pie(state), Discipline::Pie(pie)) = (&mut self.discipline, &rules.bottleneck().discipline) {
            state.sends(pie, now, now.saturating_duration_since(rules.offered(&packet)), self.waiting.is_empty());
        }
        self.send(now, rules, packet);
    }

    /// Puts a packet on the line.
    #[inline(always)]
    fn send<R: Rules<P, Sums = S>>(&mut self, now: Instant, rules: &R, packet: P) {
        let left = rules.bits(&packet);
        let (next, opportunities) = rules.next(now, left);
        self.on_line = Some(OnLine { packet, since: now, left, next, opportunities });
    }

    /// Sets the next event of the packet in transmission, with the remaining bits of `now`.
    pub(crate) fn announce(&mut self, now: Instant, rules: &impl Rules<P, Sums = S>) {
        if let Some(on_line) = &mut self.on_line {
            on_line.since = now;
            (on_line.next, on_line.opportunities) = rules.next(now, on_line.left);
        }
    }

    /// Changes rate, framing, limit and discipline from `before` to `rules`. A waiting packet keeps its place even if a smaller limit is exceeded. The packet
    /// in transmission keeps the bits already sent.
    pub(crate) fn reconfigure<R: Rules<P, Sums = S>>(&mut self, now: Instant, before: &R, rules: &R) {
        if let Some(on_line) = &mut self.on_line {
            // The bits sent at the old rate stay sent.
            on_line.left = on_line.left.saturating_sub(before.bottleneck().bits_sent(now.saturating_duration_since(on_line.since)));
        }
        // A new kind of discipline begins without memory. New parameters of the same kind keep the memory.
        let (old, new) = (&before.bottleneck().discipline, &rules.bottleneck().discipline);
        let is_same = match (old, new) {
            // With a new number of queues, the flows are spread anew.
            (Discipline::FqCoDel(old), Discipline::FqCoDel(new)) => old.flows == new.flows,
            (old, new) => core::mem::discriminant(old) == core::mem::discriminant(new),
        };
        // The old parameters apply up to `now`.
        match (&mut self.discipline, old) {
            (DisciplineState::Pie(state), Discipline::Pie(pie)) => state.pass(pie, now),
            (DisciplineState::DualPi2(queues), Discipline::DualPi2(dualpi2)) => queues.pass(now, before, dualpi2),
            _ => {}
        }
        if !is_same {
            core::mem::replace(&mut self.discipline, DisciplineState::new(new)).empty_into(&mut self.waiting);
        }
        // The sums are made anew, because the new framing changes the bits of every waiting packet.
        self.sums = S::default();
        let Self { waiting, discipline, .. } = self;
        match (discipline, new) {
            (DisciplineState::FqCoDel(flows), Discipline::FqCoDel(fq_codel)) => {
                for packet in waiting.drain(..) {
                    flows.push(rules, fq_codel, packet);
                }
            }
            (DisciplineState::DualPi2(queues), Discipline::DualPi2(dualpi2)) => {
                queues.retime(now, dualpi2);
                for packet in waiting.drain(..) {
                    queues.push(now, rules, dualpi2, packet);
                }
            }
            _ => {}
        }
        self.waiting.iter().for_each(|packet| rules.add(&mut self.sums, packet));
        self.discipline.for_each(|packet| rules.add(&mut self.sums, packet));
        self.announce(now, rules);
    }

    /// Returns the packet in transmission and all waiting packets, in order, when a link loses its bottleneck.
    pub(crate) fn dismantle(mut self) -> impl Iterator<Item = P> {
        self.discipline.empty_into(&mut self.waiting);
        self.on_line.into_iter().map(|on_line| on_line.packet).chain(self.waiting)
    }

    /// Returns the queue with each packet converted to another type, under other rules.
    pub(crate) fn converted<Q, R: Rules<Q>>(self, rules: &R, mut convert: impl FnMut(P) -> Q) -> Fifo<Q, R::Sums> {
        let Self { waiting, on_line, idle_since, discipline, .. } = self;
        let on_line =
            on_line.map(|OnLine { packet, since, left, next, opportunities }| OnLine { packet: convert(packet), since, left, next, opportunities });
        let waiting: VecDeque<Q> = waiting.into_iter().map(&mut convert).collect();
        let discipline = discipline.converted(convert);
        // The new rules may need no sums, or different sums.
        let mut sums = R::Sums::default();
        waiting.iter().for_each(|packet| rules.add(&mut sums, packet));
        discipline.for_each(|packet| rules.add(&mut sums, packet));
        Fifo { waiting, sums, on_line, idle_since, discipline }
    }

    /// Returns the number of waiting packets.
    fn len(&self) -> usize {
        self.discipline.len().unwrap_or(self.waiting.len())
    }

    /// Returns whether the queue is within its limit, the newest packet with `newest` bits (10⁻⁹ bit) included.
    fn holds<R: Rules<P, Sums = S>>(&self, now: Instant, rules: &R, newest: u128) -> bool {
        let Some(limit) = rules.bottleneck().limit else { return true };
        let (bytes, bits) = rules.waiting(&self.sums, self.len());
        let time = self.time_to_send(now, rules, limit, bits - newest);
        limit.holds(Waiting { packets: self.len() as u64, bytes, time })
    }

    /// Returns whether the limit admits another packet.
    fn admits<R: Rules<P, Sums = S>>(&self, now: Instant, rules: &R, packet: &P) -> bool {
        let Some(limit) = rules.bottleneck().limit else { return true };
        let (bytes, bits) = rules.waiting(&self.sums, self.len());
        let time = self.time_to_send(now, rules, limit, bits);
        limit.admits(Waiting { packets: self.len() as u64, bytes, time }, rules.size(packet))
    }

    /// Returns the time of the rest of the packet in transmission and of `bits` (10⁻⁹ bit) after it, or zero if the limit is no time.
    fn time_to_send<R: Rules<P, Sums = S>>(&self, now: Instant, rules: &R, limit: QueueLimit, bits: u128) -> Duration {
        match (limit, &self.on_line) {
            (QueueLimit::Time(_), Some(on_line)) => rules.bottleneck().time_to_send((on_line.since, on_line.left), bits, now),
            _ => Duration::ZERO,
        }
    }

    /// Returns PIE's verdict about a packet offered while the transmitter is busy.
    #[inline(never)]
    fn pie_verdict<R: Rules<P, Sums = S>>(&mut self, now: Instant, rules: &R, packet: &P, word: impl Fn() -> u64) -> pie::Verdict {
        let (bytes, _) = rules.waiting(&self.sums, self.waiting.len());
        let (DisciplineState::Pie(state), Discipline::Pie(pie)) = (&mut self.discipline, &rules.bottleneck().discipline) else {
            return pie::Verdict::Pass;
        };
        state.verdict(pie, now, bytes, rules.ecn(packet).is_capable(), word)
    }

    /// Returns RED's verdict about an offered packet.
    fn red_verdict<R: Rules<P, Sums = S>>(&mut self, now: Instant, rules: &R, red: &Red, packet: &P, word: u64) -> red::Verdict {
        let idle = if self.on_line.is_none() { now.saturating_duration_since(self.idle_since) } else { Duration::ZERO };
        // A drop by RED leaves the transmitter idle. Moving `idle_since` keeps the next packet from counting the same idle time again.
        self.idle_since = now;
        let (bytes, _) = rules.waiting(&self.sums, self.waiting.len());
        let DisciplineState::Red(state) = &mut self.discipline else { return red::Verdict::Pass };
        state.verdict(red, bytes, idle_packets(idle, rules.mean_packet(red)), rules.ecn(packet).is_capable(), word)
    }

    /// Removes the oldest waiting packet.
    #[inline(always)]
    fn take_head<R: Rules<P, Sums = S>>(&mut self, rules: &R) -> Option<P> {
        let packet = self.waiting.pop_front()?;
        rules.remove(&mut self.sums, &packet);
        Some(packet)
    }
}
