//! The Gilbert–Elliott model in continuous time: how long a burst lasts does not depend on how many packets are sent.
//!
//! The link is good and bad in turn, for exponential times. A packet sees the state at its instant: over a gap Δ the chain goes to the bad state with
//! πB + (1−πB)·e^(−(α+β)Δ) from the bad one, and πB·(1−e^(−(α+β)Δ)) from the good one, where α and β are the rates of leaving good and bad and
//! πB = α/(α+β). So the law at the packets is exact for any gaps.

use core::fmt;
use core::time::Duration;

use cohaptic_units::{Instant, Probability};

/// The parameters of the chain.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GilbertElliottInTime {
    good: Duration,
    bad: Duration,
    /// The probability that a packet gets through while the link is bad; 0 by custom.
    pub h: Probability,
    /// The probability that a packet gets through while the link is good; 1 by custom.
    pub k: Probability,
}

/// A time in a state is zero.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NoTime;

impl fmt::Display for NoTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a link cannot be good or bad for no time at all: expected mean times above zero")
    }
}

impl core::error::Error for NoTime {}

/// Where the chain was, and when.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Seen {
    bad: bool,
    at: Instant,
}

impl GilbertElliottInTime {
    /// A link that is good and bad for exponential times of these means.
    ///
    /// # Errors
    ///
    /// [`NoTime`] if one of them is zero.
    pub fn new(good: Duration, bad: Duration, h: Probability, k: Probability) -> Result<Self, NoTime> {
        if good.is_zero() || bad.is_zero() {
            return Err(NoTime);
        }
        Ok(Self { good, bad, h, k })
    }

    /// The mean times in the good and the bad state.
    #[must_use]
    pub const fn mean_times(&self) -> (Duration, Duration) {
        (self.good, self.bad)
    }

    /// The fraction of the time that the link is bad, πB.
    #[must_use]
    pub fn bad_fraction(&self) -> f64 {
        let (good, bad) = (self.good.as_secs_f64(), self.bad.as_secs_f64());
        bad / (good + bad)
    }

    /// The long-run fraction of packets lost, whatever their spacing.
    #[must_use]
    pub fn mean_loss(&self) -> f64 {
        let bad = self.bad_fraction();
        (1.0 - self.k.get()) * (1.0 - bad) + (1.0 - self.h.get()) * bad
    }

    /// Moves the chain to a packet's instant and says whether the packet is lost. `seen` is `None` before the first.
    pub(crate) fn loses(&self, seen: &mut Option<Seen>, now: Instant, transition: u64, loss: u64) -> bool {
        let stationary = self.bad_fraction();
        let bad = match *seen {
            None => stationary,
            Some(before) => {
                let gap = now.saturating_duration_since(before.at).as_secs_f64();
                let rate = 1.0 / self.good.as_secs_f64() + 1.0 / self.bad.as_secs_f64();
                let memory = libm::exp(-rate * gap);
                if before.bad { stationary + (1.0 - stationary) * memory } else { stationary * -libm::expm1(-rate * gap) }
            }
        };
        let bad = Probability::new(bad.clamp(0.0, 1.0)).unwrap_or_default().happens(transition);
        *seen = Some(Seen { bad, at: now });
        let gets_through = if bad { self.h } else { self.k };
        !gets_through.happens(loss)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Stream};

    /// Bursts of 40 ms on the average after 160 ms without: a fifth is lost, and a burst lasts 40 ms whether packets come every millisecond or every 8.
    /// Of about 10 000 bursts the mean length has a standard error of 0.4 ms; seen at a spacing of s it is s/(1 − e^(−s/40 ms)·(…)): the law of the
    /// sampled chain, P(bad stays bad) = 0.2 + 0.8·e^(−s/32 ms), gives a mean run of s/(1 − that).
    #[test]
    fn a_burst_lasts_as_long_at_any_packet_rate() {
        let millis = Duration::from_millis;
        let chain = GilbertElliottInTime::new(millis(160), millis(40), Probability::ZERO, Probability::ONE).unwrap();
        assert!((chain.mean_loss() - 0.2).abs() < 1e-15);
        for spacing in [1, 8] {
            let stream = Stream::new(9, b"bursts");
            let count = 2_000_000 / spacing;
            let mut seen = None;
            let lost: Vec<bool> = (0..count)
                .map(|number| {
                    let mut draws = stream.packet(number).draws(Purpose::Loss);
                    chain.loses(&mut seen, Instant::from_nanos(number * spacing * 1_000_000), draws.next_word(), draws.next_word())
                })
                .collect();
            let total = lost.iter().filter(|lost| **lost).count() as f64;
            let bursts = lost.windows(2).filter(|pair| !pair[0] && pair[1]).count() as f64;
            let stays = 0.2 + 0.8 * (-(spacing as f64) / 32.0).exp();
            let expected = spacing as f64 / (1.0 - stays);
            assert!((total / bursts * spacing as f64 - expected).abs() < 4.5 * expected / bursts.sqrt(), "{spacing} ms: {}", total / bursts);
            // The relative variance of the time spent bad is that of `bursts` renewals.
            assert!((total / count as f64 - 0.2).abs() < 4.5 * 0.2 * 1.5 / bursts.sqrt());
        }
    }

    #[test]
    fn no_time_is_refused() {
        assert!(GilbertElliottInTime::new(Duration::ZERO, Duration::from_secs(1), Probability::ZERO, Probability::ONE).is_err());
    }
}
