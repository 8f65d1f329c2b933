//! PIE, proportional integral controller enhanced (Pan, Natarajan, Baker & White, RFC 8033, 2017).
//!
//! A controller computes a probability of drops from the delay of the queue, every 15 ms. A packet is dropped with this probability before the packet waits.
//! The delay is the wait of the latest packet sent, and zero after the last waiting packet, as in Linux: RFC 8033 allows time stamps in place of an estimate of
//! the rate.

use core::time::Duration;

use crate::parameters::{Form, Table, usual};
use cohaptic_units::{Bytes, Instant, Probability};

/// Parameters of PIE. The gains of the controller are the gains of RFC 8033: 0.125 and 1.25 per second.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Pie {
    /// Wanted delay of the queue, usually 15 ms.
    pub target: Duration,
    /// Time without drops after the queue was short, usually 150 ms: a burst of this length passes. Counted in whole updates of 15 ms.
    pub burst: Duration,
    /// Size of a packet. Up to two packets of this size wait without drops.
    pub mtu: Bytes,
    /// `true` if an ECN-capable packet is marked instead of dropped while the probability of drops is at most a tenth.
    pub ecn: bool,
}

impl Default for Pie {
    /// Returns a target of 15 ms, a burst of 150 ms, an MTU of 1500 bytes, and no ECN.
    fn default() -> Self {
        Self { target: Duration::from_millis(15), burst: Duration::from_millis(150), mtu: Bytes::new(1500), ecn: false }
    }
}

/// Time between two updates of the probability \[ns\] (RFC 8033, `T_UPDATE`). Updates happen at the multiples of this time since the start of the run, before
/// the packets of the same instant.
const UPDATE_NANOS: u64 = 15_000_000;
/// Gain of the deviation from the target \[1/s\] (RFC 8033, alpha).
const PROPORTIONAL: f64 = 0.125;
/// Gain of the growth since the update before \[1/s\] (RFC 8033, beta).
const DIFFERENTIAL: f64 = 1.25;
/// Most updates between two changes of the queue: 25 minutes. Of a queue that changes nothing for longer, the updates before are left out.
const MOST_UPDATES: u64 = 100_000;

/// Divisor of a step for probabilities below a bound (RFC 8033, section 4.2): the smaller the probability, the smaller the steps.
const DIVISORS: [(f64, f64); 6] = [(1e-6, 2048.0), (1e-5, 512.0), (1e-4, 128.0), (1e-3, 32.0), (1e-2, 8.0), (1e-1, 2.0)];

/// Verdict of PIE about an offered packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Verdict {
    Pass,
    Mark,
    Drop,
}

/// State of the controller.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct PieState {
    /// Probability of a drop.
    probability: f64,
    /// Delay of the queue now.
    delay: Duration,
    /// Delay of the queue at the latest update.
    delay_before: Duration,
    /// Rest of the time without drops.
    burst: Duration,
    /// Sum of the probabilities since the latest drop (RFC 8033, section 5.4): keeps drops from following too closely or too late.
    accumulated: f64,
    /// Number of updates since the start of the run.
    updates: u64,
}

impl PieState {
    pub(crate) fn new(pie: &Pie) -> Self {
        Self { probability: 0.0, delay: Duration::ZERO, delay_before: Duration::ZERO, burst: pie.burst, accumulated: 0.0, updates: 0 }
    }

    /// Performs the updates due by `now`. Called before each change of the queue, so the delay was the same at all these updates.
    pub(crate) fn pass(&mut self, pie: &Pie, now: Instant) {
        let due = now.as_nanos() / UPDATE_NANOS;
        // A queue that stands still for longer has the last updates only, so that centuries of silence take no centuries of updates.
        self.updates = self.updates.max(due.saturating_sub(MOST_UPDATES));
        while self.updates < due {
            self.updates += 1;
            let before = *self;
            self.update(pie);
            // Further updates change nothing either. Without this exit a long silence would take a step per 15 ms.
            if *self == before {
                self.updates = due;
            }
        }
    }

    /// Computes the probability anew (RFC 8033, sections 4.2, 4.4 and 5.5).
    fn update(&mut self, pie: &Pie) {
        let [delay, before, target] = [self.delay, self.delay_before, pie.target].map(|span| span.as_secs_f64());
        let divisor = DIVISORS.iter().find(|(bound, _)| self.probability < *bound).map_or(1.0, |(_, divisor)| *divisor);
        let mut step = (PROPORTIONAL * (delay - target) + DIFFERENTIAL * (delay - before)) / divisor;
        if self.probability >= 0.1 {
            step = step.min(0.02);
        }
        self.probability += step;
        if self.delay.is_zero() && self.delay_before.is_zero() {
            self.probability *= 0.98;
        }
        self.probability = self.probability.clamp(0.0, 1.0);
        self.burst = self.burst.saturating_sub(Duration::from_nanos(UPDATE_NANOS));
        let half = pie.target / 2;
        if self.probability == 0.0 && self.delay < half && self.delay_before < half {
            self.burst = pie.burst;
        }
        self.delay_before = self.delay;
    }

    /// Notes that a packet begins to be sent `now` after waiting for `sojourn`. `is_last` tells that no further packet waits.
    pub(crate) fn sends(&mut self, pie: &Pie, now: Instant, sojourn: Duration, is_last: bool) {
        self.pass(pie, now);
        self.delay = if is_last { Duration::ZERO } else { sojourn };
    }

    /// Notes the drop of an offered packet at a full queue.
    pub(crate) fn overflows(&mut self) {
        self.accumulated = 0.0;
    }

    /// Decides about a packet offered `now` behind `queued` waiting bytes. `word` gives the packet's random word for queues.
    pub(crate) fn verdict(&mut self, pie: &Pie, now: Instant, queued: u128, ecn_capable: bool, word: impl Fn() -> u64) -> Verdict {
        self.pass(pie, now);
        let is_short = self.delay_before < pie.target / 2 && self.probability < 0.2;
        if !self.burst.is_zero() || is_short || queued <= 2 * u128::from(pie.mtu.get()) {
            return Verdict::Pass;
        }
        if self.probability == 0.0 {
            self.accumulated = 0.0;
        }
        self.accumulated += self.probability;
        if self.accumulated < 0.85 {
            return Verdict::Pass;
        }
        // After 8.5 expected drops without a drop the packet is dropped with certainty.
        let probability = Probability::new(self.probability).unwrap_or(Probability::ONE);
        if self.accumulated < 8.5 && !probability.happens(word()) {
            return Verdict::Pass;
        }
        self.accumulated = 0.0;
        // A queue that marks more than a tenth of its packets without success drops them (RFC 8033, section 5.1).
        if pie.ecn && ecn_capable && self.probability <= 0.1 { Verdict::Mark } else { Verdict::Drop }
    }
}

/// Parameters of the discipline.
pub(crate) static PIE: Table = Table::of(&[&[
    usual("target", Form::PositiveDuration, "\"15ms\"", "Delay of the queue towards which the controller works"),
    usual("burst", Form::Duration, "\"150ms\"", "Time without drops after the queue was short"),
    usual("mtu", Form::Size, "\"1500B\"", "Size of a packet: up to two of this size wait without drops"),
    usual("ecn", Form::Boolean, "false", "Whether packets are marked instead of dropped, as long as at most a tenth is hit"),
]]);

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;
    use crate::random::{Purpose, Stream};

    /// Returns the probabilities after `updates` updates at a constant delay of the queue.
    fn probabilities(delay: u64, updates: usize) -> Vec<f64> {
        let pie = Pie::default();
        let mut state = PieState { delay: Duration::from_millis(delay), ..PieState::new(&pie) };
        let mut next = || {
            state.update(&pie);
            state.probability
        };
        (0..updates).map(|_| next()).collect()
    }

    /// Open loop at 25 ms: the first step is (0.125·10 ms + 1.25·25 ms)/2048 and the second 0.125·10 ms/128. The others were computed independently, in
    /// decimal arithmetic.
    #[test]
    fn a_constant_delay_gives_the_probabilities_of_the_formula() {
        let found = probabilities(25, 100);
        let expected = [(1, 1.586_914_06e-5), (2, 2.563_476_56e-5), (10, 1.037_597_66e-4), (100, 0.015_689_697_3)];
        for (number, expected) in expected {
            let found = found[number - 1];
            assert!((found / expected - 1.0).abs() < 5e-9, "update {number}: {found}, expected {expected}");
        }
    }

    #[test]
    fn a_step_is_at_most_two_hundredths_from_a_tenth_on() {
        let found = probabilities(1000, 60);
        let steps: Vec<(f64, f64)> =
            found.windows(2).map(|pair| (pair[0], pair[1] - pair[0])).filter(|(before, _)| (0.1..0.98).contains(before)).collect();
        assert!(steps.len() > 40 && steps.iter().all(|(_, step)| (step - 0.02).abs() < 1e-12), "{steps:?}");
        assert_eq!(found.last(), Some(&1.0));
    }

    #[test]
    fn without_a_delay_twice_the_probability_decays() {
        let pie = Pie { target: Duration::ZERO, ..Pie::default() };
        let mut state = PieState { probability: 0.5, ..PieState::new(&pie) };
        state.update(&pie);
        assert_eq!(state.probability, 0.5 * 0.98);
        state.delay = Duration::from_nanos(1);
        state.update(&pie);
        assert!(state.probability > 0.48);
    }

    /// The burst passes: ten updates with a long queue follow before the first drop, and a short queue gives the allowance back.
    #[test]
    fn a_burst_passes() {
        let pie = Pie::default();
        let mut state = PieState { delay: Duration::from_secs(10), probability: 1.0, ..PieState::new(&pie) };
        let mut first = None;
        for milli in 0..300 {
            let now = Instant::from_nanos(milli * 1_000_000);
            if state.verdict(&pie, now, 100_000, false, || 0) == Verdict::Drop {
                first.get_or_insert(milli);
            }
        }
        assert_eq!(first, Some(150));
        state.sends(&pie, Instant::from_nanos(300_000_000), Duration::ZERO, true);
        state.pass(&pie, Instant::from_nanos(100_000_000_000));
        assert_eq!((state.probability, state.burst), (0.0, pie.burst));
    }

    /// At a probability of 1/16 the sum reaches 0.85 with the 14th packet and 8.5 with the 136th. In between the gap is geometric, so that its mean is
    /// 13 + 16·(1 − (15/16)^123) = 28.9943. Of 20 000 packets about 690 are hit, and with a standard deviation of 15.5 packets the standard error is 0.59.
    #[test]
    fn drops_are_neither_too_close_nor_too_far() {
        let pie = Pie { burst: Duration::ZERO, ..Pie::default() };
        let mut state = PieState { probability: 1.0 / 16.0, delay_before: Duration::from_millis(15), ..PieState::new(&pie) };
        let stream = Stream::new(3, b"pie");
        let mut ask = |number| state.verdict(&pie, Instant::ZERO, 100_000, false, || stream.packet(number).first(Purpose::Queue));
        let hits: Vec<u64> = (0..20_000).filter(|number| ask(*number) == Verdict::Drop).collect();
        let gaps: Vec<u64> = hits.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(gaps.iter().all(|gap| (14..=136).contains(gap)), "{gaps:?}");
        let mean = gaps.iter().sum::<u64>() as f64 / gaps.len() as f64;
        assert!((mean - 28.9943).abs() < 4.5 * 0.59, "{mean}");
    }

    #[test]
    fn a_capable_packet_is_marked_up_to_a_tenth() {
        let pie = Pie { ecn: true, burst: Duration::ZERO, ..Pie::default() };
        let at = |probability, capable, queued| {
            let mut state = PieState { probability, accumulated: 8.5, delay_before: Duration::from_millis(15), ..PieState::new(&pie) };
            state.verdict(&pie, Instant::ZERO, queued, capable, || u64::MAX)
        };
        assert_eq!([at(0.1, true, 3001), at(0.1, false, 3001), at(0.11, true, 3001)], [Verdict::Mark, Verdict::Drop, Verdict::Drop]);
        assert_eq!(at(0.1, true, 3000), Verdict::Pass);
    }

    /// A silence of a hundred years is a few thousand steps: updates that change nothing are skipped.
    #[test]
    fn a_long_silence_costs_little() {
        for target in [Duration::ZERO, Duration::from_millis(15)] {
            let pie = Pie { target, ..Pie::default() };
            let mut state = PieState { probability: 1.0, delay: Duration::ZERO, ..PieState::new(&pie) };
            state.pass(&pie, Instant::MAX);
            assert_eq!(state.updates, Instant::MAX.as_nanos() / UPDATE_NANOS);
            assert!(state.probability < 1e-300);
        }
    }
}
