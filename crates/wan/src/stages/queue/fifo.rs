//! First-in-first-out queue before a transmitter: choice of the packets to wait, to transmit, to mark and to drop.
//!
//! The queue serves packets of any type over any transmitter; [`Rules`] has the differences. A stage of a link keeps packets of any size, each boxed, over
//! transmitters of constant rate or of recorded opportunities ([`BottleneckStage`](super::BottleneckStage)). A link of a large mesh keeps packets of one size
//! over a transmitter of constant rate, with size and transmission time known beforehand and stored once for all links of a kind.

use alloc::collections::VecDeque;
use core::time::Duration;

use cohaptic_units::{Bytes, Instant};

use super::bottleneck::{Bottleneck, Discipline, idle_packets};
use super::codel::{self, CoDelState};
use super::limit::{QueueLimit, Waiting};
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

    /// Returns whether a packet is marked in place of a drop.
    fn ecn_capable(&self, packet: &P) -> bool;

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
    /// Waiting packets, the oldest first.
    waiting: VecDeque<P>,
    sums: S,
    on_line: Option<OnLine<P>>,
    /// Instant since which the transmitter is idle, or up to which idle time has been counted. Meaningful only with RED, while no packet is in transmission.
    idle_since: Instant,
    discipline: DisciplineState,
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

/// State of a discipline between packets.
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
    /// queues, and is called by RED only. `dropped` takes each dropped packet.
    #[inline(always)]
    pub(crate) fn offer<R: Rules<P, Sums = S>>(
        &mut self,
        now: Instant,
        rules: &R,
        mut packet: P,
        word: impl FnOnce() -> u64,
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
        // An idle transmitter implies an empty queue, so no limit applies.
        if self.on_line.is_none() {
            return self.serve(now, rules, packet, dropped);
        }
        // Head drop removes waiting packets until the new packet has room. Other disciplines drop the new packet, as does head drop once no packet waits.
        while !self.admits(now, rules, &packet) {
            let head = if rules.bottleneck().discipline == Discipline::HeadDrop { self.take_head(rules) } else { None };
            match head {
                Some(head) => dropped(DropCause::QueueFull, head),
                None => return dropped(DropCause::QueueFull, packet),
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
        match self.take_head(rules) {
            Some(packet) => self.serve(now, rules, packet, dropped),
            None => self.idle_since = now,
        }
    }

    /// Begins to send `packet`, or the first packet after `packet` without a drop by CoDel.
    #[inline(always)]
    fn serve<R: Rules<P, Sums = S>>(&mut self, now: Instant, rules: &R, mut packet: P, mut dropped: impl FnMut(DropCause, P)) {
        // CoDel decides at the exit of the queue, unlike all other disciplines.
        if let Discipline::CoDel(codel) = &rules.bottleneck().discipline {
            while let DisciplineState::CoDel(state) = &mut self.discipline {
                let (sojourn, left) = (now.saturating_duration_since(rules.offered(&packet)), rules.waiting(&self.sums, self.waiting.len()).0);
                match state.verdict(codel, now, sojourn, left, rules.ecn_capable(&packet)) {
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
        if core::mem::discriminant(old) != core::mem::discriminant(new) {
            self.discipline = DisciplineState::new(new);
        }
        // The sums are made anew, because the new framing changes the bits of every waiting packet.
        self.sums = S::default();
        self.waiting.iter().for_each(|packet| rules.add(&mut self.sums, packet));
        self.announce(now, rules);
    }

    /// Returns the packet in transmission and all waiting packets, in order, when a link loses its bottleneck.
    pub(crate) fn dismantle(self) -> impl Iterator<Item = P> {
        self.on_line.into_iter().map(|on_line| on_line.packet).chain(self.waiting)
    }

    /// Returns the queue with each packet converted to another type, under other rules.
    pub(crate) fn converted<Q, R: Rules<Q>>(self, rules: &R, mut convert: impl FnMut(P) -> Q) -> Fifo<Q, R::Sums> {
        let Self { waiting, on_line, idle_since, discipline, .. } = self;
        let on_line =
            on_line.map(|OnLine { packet, since, left, next, opportunities }| OnLine { packet: convert(packet), since, left, next, opportunities });
        let waiting: VecDeque<Q> = waiting.into_iter().map(convert).collect();
        // The new rules may need no sums, or different sums.
        let mut sums = R::Sums::default();
        waiting.iter().for_each(|packet| rules.add(&mut sums, packet));
        Fifo { waiting, sums, on_line, idle_since, discipline }
    }

    /// Returns whether the limit admits another packet.
    fn admits<R: Rules<P, Sums = S>>(&self, now: Instant, rules: &R, packet: &P) -> bool {
        let bottleneck = rules.bottleneck();
        let Some(limit) = bottleneck.limit else { return true };
        let (bytes, bits) = rules.waiting(&self.sums, self.waiting.len());
        let time = match (limit, &self.on_line) {
            // The waiting time is the time of the rest of the packet in transmission and of all waiting packets.
            (QueueLimit::Time(_), Some(on_line)) => bottleneck.time_to_send((on_line.since, on_line.left), bits, now),
            _ => Duration::ZERO,
        };
        limit.admits(Waiting { packets: self.waiting.len() as u64, bytes, time }, rules.size(packet))
    }

    /// Returns RED's verdict about an offered packet.
    fn red_verdict<R: Rules<P, Sums = S>>(&mut self, now: Instant, rules: &R, red: &Red, packet: &P, word: u64) -> red::Verdict {
        let idle = if self.on_line.is_none() { now.saturating_duration_since(self.idle_since) } else { Duration::ZERO };
        // A drop by RED leaves the transmitter idle. Moving `idle_since` keeps the next packet from counting the same idle time again.
        self.idle_since = now;
        let (bytes, _) = rules.waiting(&self.sums, self.waiting.len());
        let DisciplineState::Red(state) = &mut self.discipline else { return red::Verdict::Pass };
        state.verdict(red, bytes, idle_packets(idle, rules.mean_packet(red)), rules.ecn_capable(packet), word)
    }

    /// Removes the oldest waiting packet.
    #[inline(always)]
    fn take_head<R: Rules<P, Sums = S>>(&mut self, rules: &R) -> Option<P> {
        let packet = self.waiting.pop_front()?;
        rules.remove(&mut self.sums, &packet);
        Some(packet)
    }
}
