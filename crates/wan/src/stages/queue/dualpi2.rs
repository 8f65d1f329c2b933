//! DualPI2: a queue for scalable senders beside a queue for all others, with coupled marks and drops (De Schepper, Briscoe & White, RFC 9332, 2023,
//! appendix A).
//!
//! ```text
//!            ┌─ ECT(1), CE ──► L queue ── marked with k·p′, and after a wait of more than step_thresh ──┐
//! packet ──► ┤                                                                                          ├─► scheduler ──► line
//!            └─ all others ──► C queue ── marked, or dropped without ECN, with p′² ─────────────────────┘
//! ```
//!
//! A controller computes the probability p′ from the longer wait of the two queues. A classic sender slows down with the square root of the losses, a scalable
//! sender in proportion to the marks, so the square in one queue makes both rates equal.
//!
//! RFC 9332 leaves the scheduler open and names several marks for the L queue. The choices are the choices of Linux: a step of the wait, and a scheduler with a
//! credit that keeps a share of the line for the C queue. A step needs a second packet in the L queue, as in the RFC: on a slow line the packet in transmission
//! alone takes longer than the step. Marks and drops are counted out, not drawn, by the function `recur` of the RFC.

use alloc::collections::VecDeque;
use alloc::vec::Vec;
use core::num::NonZeroU8;
use core::time::Duration;

use cohaptic_units::{Ecn, Instant, Probability};

use super::fifo::Rules;
use super::nanos;
use crate::fates::fate::DropCause;
use crate::parameters::{Form, Quantity, Table, number, usual};

/// Parameters of DualPI2.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DualPi2 {
    /// Wanted wait of the longer queue, usually 15 ms.
    pub target: Duration,
    /// Time between two updates of the probability, usually 16 ms. Updates happen at the multiples of this time since the start of the run, before the packets
    /// of the same instant. Zero counts as a nanosecond.
    pub tupdate: Duration,
    /// Gain of the deviation from the target \[Hz\], usually 0.16. Finite and at least 0.
    pub alpha: f64,
    /// Gain of the growth since the update before \[Hz\], usually 3.2. Finite and at least 0.
    pub beta: f64,
    /// Factor k from the probability p′ to the marks of the L queue, usually 2.
    pub coupling_factor: NonZeroU8,
    /// Longest wait in the L queue without a mark, usually 1 ms.
    pub step_thresh: Duration,
    /// Share of the line for the C queue while packets wait in both queues, usually a tenth.
    pub classic_protection: Probability,
}

impl Default for DualPi2 {
    /// Returns the defaults of Linux: 15 ms, 16 ms, 0.16 Hz, 3.2 Hz, 2, 1 ms, 10 %.
    fn default() -> Self {
        Self {
            target: Duration::from_millis(15),
            tupdate: Duration::from_millis(16),
            alpha: 0.16,
            beta: 3.2,
            coupling_factor: NonZeroU8::MIN.saturating_add(1),
            step_thresh: Duration::from_millis(1),
            classic_protection: Probability::new(0.1).unwrap_or(Probability::ZERO),
        }
    }
}

impl DualPi2 {
    /// Returns the time between two updates \[ns\].
    fn period(&self) -> u64 {
        nanos(self.tupdate).max(1)
    }
}

/// Most updates between two changes of the queues: 27 minutes with the usual time. Of queues that change nothing for longer, the updates before are left out.
const MOST_UPDATES: u64 = 100_000;

/// L queue and C queue, with the state of the controller and of the scheduler.
#[derive(Clone, Debug)]
pub(crate) struct DualQueues<P> {
    /// Packets with ECT(1) or CE, each with its place in the order of offers.
    low_latency: VecDeque<(u64, P)>,
    /// All other packets, each with its place in the order of offers.
    classic: VecDeque<(u64, P)>,
    /// Number of packets so far. Gives the order of the waiting packets after a change to another discipline.
    offered: u64,
    controller: Controller,
    /// Sum of the likelihoods of hits in the L queue, less the hits.
    low_latency_sum: Recur,
    /// Sum of the likelihoods of hits in the C queue, less the hits.
    classic_sum: Recur,
    /// Credit of the C queue \[byte\]. While packets wait in both queues, the C queue is served with a positive credit, else the L queue.
    credit: f64,
}

/// Verdict about the packet at the head of a queue.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Verdict {
    Send,
    Mark,
    Drop,
}

impl<P> DualQueues<P> {
    pub(crate) const fn new() -> Self {
        Self {
            low_latency: VecDeque::new(),
            classic: VecDeque::new(),
            offered: 0,
            controller: Controller { probability: 0.0, delay_before: Duration::ZERO, updates: 0 },
            low_latency_sum: Recur(0.0),
            classic_sum: Recur(0.0),
            credit: 0.0,
        }
    }

    /// Returns the number of waiting packets.
    pub(crate) fn len(&self) -> usize {
        self.low_latency.len() + self.classic.len()
    }

    /// Appends a packet to its queue `now`.
    pub(crate) fn push<R: Rules<P>>(&mut self, now: Instant, rules: &R, dualpi2: &DualPi2, packet: P) {
        // The result would be the same without this call, but the updates of empty queues take no time only as long as the queues are empty.
        self.pass(now, rules, dualpi2);
        let queue = match rules.ecn(&packet) {
            Ecn::Capable1 | Ecn::Congestion => &mut self.low_latency,
            Ecn::NotCapable | Ecn::Capable0 => &mut self.classic,
        };
        queue.push_back((self.offered, packet));
        self.offered += 1;
    }

    /// Removes the next packet to send (RFC 9332, appendix A.2). `dropped` takes the packets that are dropped, and `sums` loses all of these packets.
    pub(crate) fn take<R: Rules<P>>(
        &mut self,
        now: Instant,
        rules: &R,
        dualpi2: &DualPi2,
        sums: &mut R::Sums,
        mut dropped: impl FnMut(DropCause, P),
    ) -> Option<P> {
        self.pass(now, rules, dualpi2);
        loop {
            let is_low_latency = !self.low_latency.is_empty() && (self.classic.is_empty() || self.credit <= 0.0);
            let queue = if is_low_latency { &mut self.low_latency } else { &mut self.classic };
            let Some((_, mut packet)) = queue.pop_front() else {
                self.credit = 0.0;
                return None;
            };
            rules.remove(sums, &packet);
            let verdict = if is_low_latency {
                let sojourn = now.saturating_duration_since(rules.offered(&packet));
                self.low_latency_verdict(dualpi2, sojourn)
            } else {
                self.classic_verdict(dualpi2, rules.ecn(&packet).is_capable())
            };
            match verdict {
                Verdict::Drop => {
                    dropped(DropCause::DualPi2, packet);
                    continue;
                }
                Verdict::Mark => rules.mark(&mut packet),
                Verdict::Send => {}
            }
            #[expect(clippy::cast_precision_loss, reason = "a credit")]
            let size = rules.size(&packet).get() as f64;
            let share = dualpi2.classic_protection.get();
            // A queue that is served alone takes nothing from the other one.
            if is_low_latency && !self.classic.is_empty() {
                self.credit += share * size;
            } else if !is_low_latency && !self.low_latency.is_empty() {
                self.credit -= (1.0 - share) * size;
            }
            return Some(packet);
        }
    }

    /// Decides about the packet taken from the L queue after a wait of `sojourn`.
    fn low_latency_verdict(&mut self, dualpi2: &DualPi2, sojourn: Duration) -> Verdict {
        let coupled = self.controller.coupled(dualpi2);
        // Marks alone cannot slow the senders any more, so packets are dropped as in the C queue.
        if coupled >= 1.0 && self.low_latency_sum.hits(self.controller.squared()) {
            return Verdict::Drop;
        }
        // The packet itself has left the queue.
        let has_waited = sojourn > dualpi2.step_thresh && !self.low_latency.is_empty();
        let likelihood = if has_waited { 1.0 } else { coupled };
        if self.low_latency_sum.hits(likelihood) { Verdict::Mark } else { Verdict::Send }
    }

    /// Decides about the packet taken from the C queue.
    fn classic_verdict(&mut self, dualpi2: &DualPi2, is_capable: bool) -> Verdict {
        if !self.classic_sum.hits(self.controller.squared()) {
            return Verdict::Send;
        }
        // Of a sender that answers to no marks, marks would make the queue grow for ever.
        let is_overload = self.controller.coupled(dualpi2) >= 1.0;
        if is_capable && !is_overload { Verdict::Mark } else { Verdict::Drop }
    }

    /// Performs the updates due by `now`. Called before each change of the queues, so both queues had the same heads at all these updates.
    pub(crate) fn pass<R: Rules<P>>(&mut self, now: Instant, rules: &R, dualpi2: &DualPi2) {
        let heads = [self.low_latency.front(), self.classic.front()];
        // The longer wait is the wait of the older head.
        let oldest = heads.into_iter().flatten().map(|(_, packet)| rules.offered(packet)).min();
        self.controller.pass(now, dualpi2, oldest);
    }

    /// Goes on with the time between two updates in `dualpi2`, after all updates due by `now`.
    pub(crate) fn retime(&mut self, now: Instant, dualpi2: &DualPi2) {
        self.controller.updates = now.as_nanos() / dualpi2.period();
    }

    /// Returns the waiting packets, first those of the L queue.
    pub(crate) fn packets(&self) -> impl Iterator<Item = &P> {
        self.low_latency.iter().chain(&self.classic).map(|(_, packet)| packet)
    }

    /// Returns the waiting packets in the order of their offers.
    pub(crate) fn into_packets(self) -> impl Iterator<Item = P> {
        let mut packets: Vec<(u64, P)> = self.low_latency.into_iter().chain(self.classic).collect();
        packets.sort_unstable_by_key(|(order, _)| *order);
        packets.into_iter().map(|(_, packet)| packet)
    }

    /// Returns the same queues with each packet converted to another type.
    pub(crate) fn converted<Q>(self, mut convert: impl FnMut(P) -> Q) -> DualQueues<Q> {
        let Self { low_latency, classic, offered, controller, low_latency_sum, classic_sum, credit } = self;
        let [low_latency, classic] = [low_latency, classic].map(|queue| queue.into_iter().map(|(order, packet)| (order, convert(packet))).collect());
        DualQueues { low_latency, classic, offered, controller, low_latency_sum, classic_sum, credit }
    }
}

/// Counter that hits a given share of the packets at even distances (RFC 9332, appendix A.1, `recur`).
#[derive(Clone, Copy, PartialEq, Debug)]
struct Recur(f64);

impl Recur {
    /// Returns whether the next packet is hit, with a likelihood of at most 1.
    fn hits(&mut self, likelihood: f64) -> bool {
        self.0 += likelihood;
        let is_hit = self.0 > 1.0;
        if is_hit {
            self.0 -= 1.0;
        }
        is_hit
    }
}

/// State of the controller.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Controller {
    /// Probability p′, from 0 to 1.
    probability: f64,
    /// Wait of the longer queue at the latest update.
    delay_before: Duration,
    /// Number of updates since the start of the run.
    updates: u64,
}

impl Controller {
    /// Returns the probability of a mark in the L queue, k·p′ and at most 1.
    fn coupled(&self, dualpi2: &DualPi2) -> f64 {
        (f64::from(dualpi2.coupling_factor.get()) * self.probability).min(1.0)
    }

    /// Returns the probability of a hit in the C queue, p′².
    fn squared(&self) -> f64 {
        self.probability * self.probability
    }

    /// Performs the updates due by `now`. `oldest` is the instant of the offer of the older head of the queues.
    fn pass(&mut self, now: Instant, dualpi2: &DualPi2, oldest: Option<Instant>) {
        let period = dualpi2.period();
        let due = now.as_nanos() / period;
        let delay = |update: u64| oldest.map_or(Duration::ZERO, |oldest| Instant::from_nanos(update * period).saturating_duration_since(oldest));
        // Queues that stand still for longer have the last updates only, so that centuries of silence take no centuries of updates.
        let left_out = due.saturating_sub(MOST_UPDATES);
        if self.updates < left_out {
            (self.updates, self.delay_before) = (left_out, delay(left_out));
        }
        while self.updates < due {
            self.updates += 1;
            let before = *self;
            self.update(dualpi2, delay(self.updates));
            // Further updates of empty queues change nothing either. Without this exit a long silence would take a step per update.
            if oldest.is_none() && *self == before {
                self.updates = due;
            }
        }
    }

    /// Computes the probability anew (RFC 9332, appendix A.1, `dualpi2_update`).
    fn update(&mut self, dualpi2: &DualPi2, delay: Duration) {
        let [now, before, target] = [delay, self.delay_before, dualpi2.target].map(|span| span.as_secs_f64());
        let probability = self.probability + dualpi2.alpha * (now - target) + dualpi2.beta * (now - before);
        // Written with a comparison, so that NaN of a gain that is not finite counts as zero.
        self.probability = if probability > 0.0 { probability.min(1.0) } else { 0.0 };
        self.delay_before = delay;
    }
}

/// Parameters of the discipline.
pub(crate) static DUALPI2: Table = Table::of(&[&[
    usual("target", Form::PositiveDuration, "\"15ms\"", "Wait of the longer queue towards which the controller works"),
    usual("tupdate", Form::PositiveDuration, "\"16ms\"", "Time between two updates of the controller"),
    usual("alpha", number(Quantity::not_negative("Hz")), "0.16", "Gain of the deviation from the target"),
    usual("beta", number(Quantity::not_negative("Hz")), "3.2", "Gain of the growth since the update before"),
    usual("coupling-factor", Form::Integer(1, 255), "2", "Factor from the controller's probability to the marks of the L queue"),
    usual("step-thresh", Form::Duration, "\"1ms\"", "Wait from which every packet of the L queue is marked"),
    usual("classic-protection", Form::Probability, "0.1", "Share of the line for the C queue while packets wait in both"),
]]);

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::from_nanos(millis * 1_000_000)
    }

    fn probability_of(p: f64) -> DualQueues<()> {
        DualQueues { controller: Controller { probability: p, delay_before: Duration::from_millis(15), updates: 0 }, ..DualQueues::new() }
    }

    /// With waits of 10, 20, 40, 40, 30 and 15 ms, alpha·(q − 15 ms) + beta·(q − q before) is 0.0312, 0.0328, 0.068, 0.004, −0.0296 and −0.048.
    #[test]
    fn waits_give_the_probabilities_of_the_formula() {
        let (dualpi2, mut state) = (DualPi2::default(), Controller { probability: 0.0, delay_before: Duration::ZERO, updates: 0 });
        for (wait, expected) in [(10, 0.0312), (20, 0.064), (40, 0.132), (40, 0.136), (30, 0.1064), (15, 0.0584)] {
            state.update(&dualpi2, Duration::from_millis(wait));
            assert!((state.probability - expected).abs() < 1e-12, "{wait} ms: {}, expected {expected}", state.probability);
            assert!((state.coupled(&dualpi2) - 2.0 * expected).abs() < 1e-12);
            assert!((state.squared() - (state.coupled(&dualpi2) / 2.0).powi(2)).abs() < 1e-15);
        }
        // Without waits the probability falls by 3.2·15 ms once, and by 0.16·15 ms at each update.
        state.update(&dualpi2, Duration::ZERO);
        assert!((state.probability - 0.008).abs() < 1e-12);
        for _ in 0..4 {
            state.update(&dualpi2, Duration::ZERO);
        }
        assert_eq!(state.probability, 0.0);
        state.update(&dualpi2, Duration::from_secs(10));
        assert_eq!(state.probability, 1.0);
    }

    /// A head that waits is older at each update: at 16, 32 and 48 ms a packet of 1 ms has waited 15, 31 and 47 ms.
    #[test]
    fn the_wait_of_a_head_grows_between_the_changes_of_the_queues() {
        let (dualpi2, mut state) = (DualPi2::default(), Controller { probability: 0.0, delay_before: Duration::ZERO, updates: 0 });
        state.pass(at(48), &dualpi2, Some(at(1)));
        let expected = 3.2 * 0.047 + 0.16 * (0.016 + 0.032);
        assert!((state.probability - expected).abs() < 1e-12 && state.updates == 3, "{state:?}");
    }

    /// Hits at even distances: the n-th one is the first packet at which the sum of the likelihoods exceeds n.
    #[test]
    fn hits_recur_at_even_distances() {
        let mut sum = Recur(0.0);
        let hits: Vec<u32> = (1..=1000).filter(|_| sum.hits(0.3125)).collect();
        assert_eq!(hits[..5], [4, 7, 10, 13, 17]);
        for (before, place) in hits.iter().enumerate() {
            let excess = f64::from(*place) * 0.3125 - (before as f64 + 1.0);
            assert!(excess > 0.0 && excess <= 0.3125, "{place}");
        }
    }

    /// With p′ of 0.1, one of a hundred classic packets is hit, and of the packets of the L queue every fifth is marked.
    #[test]
    fn the_square_of_the_probability_hits_the_one_queue_and_twice_the_probability_the_other() {
        let (dualpi2, mut queues) = (DualPi2::default(), probability_of(0.1));
        let classic: Vec<Verdict> = (0..10_000).map(|number| queues.classic_verdict(&dualpi2, number % 2 == 0)).collect();
        let of = |verdict| classic.iter().filter(|one| **one == verdict).count();
        assert!((99..=100).contains(&(of(Verdict::Mark) + of(Verdict::Drop))), "{} {}", of(Verdict::Mark), of(Verdict::Drop));
        assert!((1..=10_000).step_by(2).all(|place| classic[place] != Verdict::Mark));
        let marked = (0..10_000).filter(|_| queues.low_latency_verdict(&dualpi2, Duration::ZERO) == Verdict::Mark).count();
        assert!((1_999..=2_000).contains(&marked), "{marked}");
    }

    /// From p′ = 1/k on, ECN is of no use: both queues drop p′² of their packets, and all others of the L queue are marked.
    #[test]
    fn overload_drops_in_both_queues() {
        let (dualpi2, mut queues) = (DualPi2::default(), probability_of(0.5));
        let mut shares = |is_low_latency| {
            let mut verdict =
                || if is_low_latency { queues.low_latency_verdict(&dualpi2, Duration::MAX) } else { queues.classic_verdict(&dualpi2, true) };
            let all: Vec<Verdict> = (0..4_000).map(|_| verdict()).collect();
            [Verdict::Drop, Verdict::Mark].map(|one| all.iter().filter(|verdict| **verdict == one).count())
        };
        let ([low_dropped, low_marked], [dropped, marked]) = (shares(true), shares(false));
        assert!((999..=1000).contains(&low_dropped) && low_dropped + low_marked == 4_000, "{low_dropped} {low_marked}");
        assert!((999..=1000).contains(&dropped) && marked == 0, "{dropped} {marked}");
    }

    /// A silence of a hundred years is a few steps: updates that change nothing are left out. A packet that waits so long has the last updates only.
    #[test]
    fn a_long_silence_costs_little() {
        for (target, oldest) in [(Duration::ZERO, None), (Duration::from_millis(15), None), (Duration::MAX, Some(Instant::ZERO))] {
            let dualpi2 = DualPi2 { target, ..DualPi2::default() };
            let mut state = Controller { probability: 0.5, delay_before: Duration::ZERO, updates: 0 };
            state.pass(Instant::MAX, &dualpi2, oldest);
            assert_eq!(state.updates, Instant::MAX.as_nanos() / 16_000_000);
        }
    }

    #[test]
    fn a_time_of_zero_between_two_updates_counts_as_a_nanosecond() {
        let dualpi2 = DualPi2 { tupdate: Duration::ZERO, ..DualPi2::default() };
        let mut state = Controller { probability: 0.5, delay_before: Duration::ZERO, updates: 0 };
        state.pass(Instant::from_nanos(5), &dualpi2, Some(Instant::ZERO));
        assert_eq!(state.updates, 5);
    }

    #[test]
    fn gains_that_are_no_numbers_hit_nothing() {
        let mut state = Controller { probability: 0.5, delay_before: Duration::ZERO, updates: 0 };
        state.update(&DualPi2 { alpha: f64::NAN, ..DualPi2::default() }, Duration::ZERO);
        assert_eq!(state.probability, 0.0);
    }
}
