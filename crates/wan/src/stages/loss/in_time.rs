//! Gilbert–Elliott model in continuous time: the length of a burst does not depend on the number of packets sent.
//!
//! The link is good and bad in turn, for exponential times. A packet meets the state at its instant. Over a gap Δ the chain goes to the bad state with
//! probability πB + (1−πB)·e^(−(α+β)Δ) from the bad state, and πB·(1−e^(−(α+β)Δ)) from the good state, where α and β are the rates of leaving good and bad
//! and πB = α/(α+β). The law at the packets is therefore exact for any gaps.

use core::fmt;
use core::time::Duration;

use cohaptic_units::{Instant, Probability};

/// Parameters of the chain.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GilbertElliottInTime {
    good: Duration,
    bad: Duration,
    /// Probability that a packet gets through while the link is bad. The usual value is 0.
    pub h: Probability,
    /// Probability that a packet gets through while the link is good. The usual value is 1.
    pub k: Probability,
}

/// Error: the mean time in a state is zero.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NoTime;

impl fmt::Display for NoTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a link cannot be good or bad for no time at all: expected mean times above zero")
    }
}

impl core::error::Error for NoTime {}

/// State of the chain at the latest packet, and the packet's instant.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Seen {
    bad: bool,
    at: Instant,
}

impl GilbertElliottInTime {
    /// Returns a link with good and bad states for exponential times with the means `good` and `bad`.
    ///
    /// # Errors
    ///
    /// [`NoTime`] if a mean is zero.
    pub fn new(good: Duration, bad: Duration, h: Probability, k: Probability) -> Result<Self, NoTime> {
        if good.is_zero() || bad.is_zero() {
            return Err(NoTime);
        }
        Ok(Self { good, bad, h, k })
    }

    /// Returns the mean times in the good and in the bad state.
    #[must_use]
    pub const fn mean_times(&self) -> (Duration, Duration) {
        (self.good, self.bad)
    }

    /// Returns the fraction of time in the bad state, πB.
    #[must_use]
    pub fn bad_fraction(&self) -> f64 {
        let (good, bad) = (self.good.as_secs_f64(), self.bad.as_secs_f64());
        bad / (good + bad)
    }

    /// Returns the long-run fraction of packets lost, whatever the spacing of packets.
    #[must_use]
    pub fn mean_loss(&self) -> f64 {
        let bad = self.bad_fraction();
        (1.0 - self.k.get()) * (1.0 - bad) + (1.0 - self.h.get()) * bad
    }

    /// Returns the probability of the bad state at the first packet: the stationary law.
    pub(crate) fn bad_at_first(&self) -> Probability {
        Probability::new(self.bad_fraction()).unwrap_or_default()
    }

    /// Returns the probability of the bad state at a packet that comes `gap` after the packet before, at which the chain was in the bad state if `was_bad`
    /// is set.
    pub(crate) fn bad_after(&self, gap: Duration, was_bad: bool) -> Probability {
        let (stationary, gap) = (self.bad_fraction(), gap.as_secs_f64());
        let rate = 1.0 / self.good.as_secs_f64() + 1.0 / self.bad.as_secs_f64();
        let bad = if was_bad {
            stationary + (1.0 - stationary) * libm::exp(-rate * gap)
        } else {
            // `expm1` keeps the precision of 1 − e^(−x) for gaps much shorter than the times in the states.
            stationary * -libm::expm1(-rate * gap)
        };
        // Rounding can lead a little outside of 0 to 1, and `Probability` refuses such numbers.
        Probability::new(bad.clamp(0.0, 1.0)).unwrap_or_default()
    }

    /// Returns whether a packet is lost that meets the state. The word for the loss is drawn only for a loss that is uncertain within the state.
    pub(crate) fn loses_in(&self, bad: bool, loss: impl FnOnce() -> u64) -> bool {
        let gets_through = if bad { self.h } else { self.k };
        gets_through == Probability::ZERO || gets_through != Probability::ONE && !gets_through.happens(loss())
    }

    /// Moves the chain to a packet's instant, and returns whether the packet is lost. `seen` is `None` before the first packet. `transition` and `loss` are
    /// random words.
    pub(crate) fn loses(&self, seen: &mut Option<Seen>, now: Instant, transition: u64, loss: impl FnOnce() -> u64) -> bool {
        let bad = match *seen {
            None => self.bad_at_first(),
            Some(before) => self.bad_after(now.saturating_duration_since(before.at), before.bad),
        };
        let bad = bad.happens(transition);
        *seen = Some(Seen { bad, at: now });
        self.loses_in(bad, loss)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Stream};

    /// Bursts of 40 ms on average come after 160 ms without loss: a fifth is lost, and a burst lasts 40 ms whether packets come every millisecond or every 8
    /// ms. In the chain sampled at a spacing of s, P(bad stays bad) = 0.2 + 0.8·e^(−s/32 ms), so that the mean run of losses lasts s/(1 − P). The relative
    /// standard error of the mean run is below 1/√(number of bursts).
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
                    let transition = draws.next_word();
                    chain.loses(&mut seen, Instant::from_nanos(number * spacing * 1_000_000), transition, || draws.next_word())
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
