//! Random early detection (Floyd & Jacobson, *Random Early Detection Gateways for Congestion Avoidance*, IEEE/ACM ToN 1(4), 1993).

use crate::parameters::{FRACTION, Form, Table, number, required, usual};
use cohaptic_units::{Bytes, Probability};
use core::fmt;

/// Parameters of RED. The average queue decides about an offered packet: below `min` the packet passes, from `max` on the packet is dropped, and in
/// between the packet is dropped with a probability rising from zero to `max_probability`, with drops spread evenly over the packets.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Red {
    min: Bytes,
    max: Bytes,
    max_probability: Probability,
    weight: f64,
    mean_packet: Bytes,
    ecn: bool,
}

/// Reason for the refusal of parameters of RED.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum RedError {
    /// The lower threshold is not below the upper threshold.
    Thresholds {
        /// Lower threshold.
        min: Bytes,
        /// Upper threshold.
        max: Bytes,
    },
    /// The weight is not in (0, 1]: the average would never move or would overshoot.
    Weight(f64),
    /// The mean packet has no bytes.
    MeanPacket,
}

impl fmt::Display for RedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Thresholds { min, max } => write!(f, "RED begins to drop at {min} and drops all at {max}: expected the first below the second"),
            Self::Weight(weight) => write!(f, "the weight {weight} of the newest queue length in its average: expected a number above 0, at most 1"),
            Self::MeanPacket => f.write_str("a mean packet of 0 bytes: expected some"),
        }
    }
}

impl core::error::Error for RedError {}

impl Red {
    /// Returns checked parameters. `weight` is the weight of the newest queue length in the average, usually 0.002. `mean_packet` sets the decay of the average
    /// while the transmitter is idle: a factor of (1−weight)^m in the time of m mean packets. With `ecn`, an ECN-capable packet is marked instead of dropped
    /// while the average is below `max`.
    ///
    /// # Errors
    ///
    /// [`RedError`] if the thresholds are out of order, the weight is not in (0, 1] or the mean packet is empty.
    pub fn new(min: Bytes, max: Bytes, max_probability: Probability, weight: f64, mean_packet: Bytes, ecn: bool) -> Result<Self, RedError> {
        if min >= max {
            return Err(RedError::Thresholds { min, max });
        }
        // Written with a negation, so NaN is refused too.
        if !(weight > 0.0 && weight <= 1.0) {
            return Err(RedError::Weight(weight));
        }
        if mean_packet == Bytes::ZERO {
            return Err(RedError::MeanPacket);
        }
        Ok(Self { min, max, max_probability, weight, mean_packet, ecn })
    }

    /// Returns the lower threshold: no packet is dropped at a smaller average queue.
    pub(crate) const fn min(&self) -> Bytes {
        self.min
    }

    /// Returns whether ECN-capable packets are marked.
    pub(crate) const fn ecn(&self) -> bool {
        self.ecn
    }

    /// Returns the size of the mean packet. Its transmission time is the unit of the decay at an idle transmitter.
    #[must_use]
    pub(crate) const fn mean_packet(&self) -> Bytes {
        self.mean_packet
    }
}

/// Verdict of RED about an offered packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Verdict {
    Pass,
    Mark,
    Drop,
}

/// State of RED.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RedState {
    /// Average of the waiting bytes.
    average: f64,
    /// Number of packets passed between the thresholds since the last drop or mark.
    count: f64,
}

impl RedState {
    /// Decides about a packet behind `queued` waiting bytes, after an idle time of `idle_packets` mean packets. `word` is the packet's random word for queues.
    pub(crate) fn verdict(&mut self, red: &Red, queued: u128, idle_packets: f64, ecn_capable: bool, word: u64) -> Verdict {
        #[expect(clippy::cast_precision_loss, reason = "an average")]
        let queued = queued as f64;
        // While the transmitter is idle the average decays as if empty queues had been observed at the rate of mean packets.
        self.average *= libm::pow(1.0 - red.weight, idle_packets);
        self.average += red.weight * (queued - self.average);
        #[expect(clippy::cast_precision_loss, reason = "thresholds of an average")]
        let (min, max) = (red.min.get() as f64, red.max.get() as f64);
        if self.average < min {
            self.count = 0.0;
            return Verdict::Pass;
        }
        // Marks do not suffice above the upper threshold, so every packet is dropped there, with ECN as well.
        if self.average >= max {
            self.count = 0.0;
            return Verdict::Drop;
        }
        // The paper's p_b, linear between the thresholds.
        let base = red.max_probability.get() * (self.average - min) / (max - min);
        // With this correction the gap between hits is uniform on 1 … 1/base (the paper's method 2).
        let left = 1.0 - self.count * base;
        // When the count reaches the end of the uniform gap, the packet is hit with certainty.
        let hit = if left > base { base / left } else { 1.0 };
        if !Probability::new(hit).unwrap_or(Probability::ONE).happens(word) {
            self.count += 1.0;
            return Verdict::Pass;
        }
        self.count = 0.0;
        if red.ecn && ecn_capable { Verdict::Mark } else { Verdict::Drop }
    }
}

/// Parameters of the discipline.
pub(crate) static RED: Table = Table::of(&[&[
    required("min", Form::Size, "Average queue at which dropping begins")
        .expecting("the average queue at which dropping begins, a size such as \"5kB\""),
    required("max", Form::Size, "Average queue at which every packet is dropped")
        .expecting("the average queue at which everything is dropped, a size such as \"15kB\""),
    usual("max-probability", Form::Probability, "\"10%\"", "Probability of a drop just below max"),
    usual("weight", number(FRACTION), "0.002", "Weight of the newest length in the average"),
    usual("mean-packet", Form::Size, "\"500B\"", "Size of a packet, for the time when the line is idle"),
    usual("ecn", Form::Boolean, "false", "Whether packets are marked instead of dropped"),
]]);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Stream};

    fn red(ecn: bool) -> Red {
        Red::new(Bytes::new(1000), Bytes::new(3000), Probability::new(0.1).unwrap(), 1.0, Bytes::new(100), ecn).unwrap()
    }

    /// Half way between the thresholds the base probability is 1/20: gaps between hits are uniform on 1 … 20, with mean 10.5. Of 20 000 packets about 1905
    /// are hit. The standard error of the mean gap is √(399/12/1905) = 0.132.
    #[test]
    fn gaps_between_hits_are_uniform() {
        let mut state = RedState::default();
        let stream = Stream::new(3, b"red");
        let verdicts: Vec<Verdict> =
            (0..20_000).map(|number| state.verdict(&red(true), 2000, 0.0, true, stream.packet(number).first(Purpose::Queue))).collect();
        let hits: Vec<usize> = verdicts.iter().enumerate().filter(|(_, verdict)| **verdict == Verdict::Mark).map(|(place, _)| place).collect();
        let gaps: Vec<usize> = hits.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(gaps.iter().all(|gap| (1..=20).contains(gap)));
        let mean = gaps.iter().sum::<usize>() as f64 / gaps.len() as f64;
        assert!((mean - 10.5).abs() < 4.5 * 0.132, "{mean}");
    }

    #[test]
    fn below_nothing_and_above_everything_is_hit() {
        let mut state = RedState::default();
        assert_eq!(state.verdict(&red(true), 999, 0.0, true, 0), Verdict::Pass);
        assert_eq!(state.verdict(&red(true), 3000, 0.0, true, u64::MAX), Verdict::Drop);
        assert_eq!(state.verdict(&red(false), 2000, 0.0, true, 0), Verdict::Drop);
    }

    #[test]
    fn an_average_forgets_while_the_line_is_idle() {
        let slow = Red::new(Bytes::new(1000), Bytes::new(3000), Probability::ONE, 0.5, Bytes::new(100), false).unwrap();
        let mut state = RedState { average: 4000.0, count: 0.0 };
        // In the time of two mean packets the average decays to 1000, and the empty queue then halves it.
        assert_eq!(state.verdict(&slow, 0, 2.0, false, 0), Verdict::Pass);
        assert!((state.average - 500.0).abs() < 1e-9);
    }

    #[test]
    fn parameters_that_make_no_sense_are_refused() {
        let bytes = Bytes::new;
        assert!(matches!(Red::new(bytes(2), bytes(2), Probability::ONE, 0.1, bytes(1), false), Err(RedError::Thresholds { .. })));
        assert!(matches!(Red::new(bytes(1), bytes(2), Probability::ONE, 0.0, bytes(1), false), Err(RedError::Weight(_))));
        assert!(matches!(Red::new(bytes(1), bytes(2), Probability::ONE, 0.1, bytes(0), false), Err(RedError::MeanPacket)));
    }
}
