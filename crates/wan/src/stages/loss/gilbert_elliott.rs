//! The Gilbert–Elliott model of bursty loss (Gilbert 1960, Elliott 1963; notation of Hasslinger & Hohlfeld 2008 and `tc-netem`).
//!
//! ```text
//!             p
//!        ┌─────────►
//!      good         bad        a packet gets through with probability k in the good state, h in the bad one
//!        ◄─────────┘
//!             r
//! ```
//!
//! Each packet draws a transition and then its loss. As in the Linux kernel, the state *before* the transition decides the probability of loss.

use cohaptic_units::Probability;

/// Parameters of the chain.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GilbertElliott {
    /// Probability of going from good to bad, per packet.
    pub p: Probability,
    /// Probability of going from bad to good, per packet. The mean stay in the bad state is 1/r packets.
    pub r: Probability,
    /// Probability that a packet gets through in the bad state. The usual value is 0: every packet is lost.
    pub h: Probability,
    /// Probability that a packet gets through in the good state. The usual value is 1: no packet is lost.
    pub k: Probability,
}

/// State of the chain.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum State {
    Good,
    Bad,
}

impl GilbertElliott {
    /// Returns the long-run fraction of packets lost, ((1−k)·r + (1−h)·p) / (p + r), or `None` if p = r = 0: the chain never moves.
    #[must_use]
    pub fn mean_loss(&self) -> Option<f64> {
        let [p, r, h, k] = [self.p, self.r, self.h, self.k].map(Probability::get);
        (p + r > 0.0).then(|| ((1.0 - k) * r + (1.0 - h) * p) / (p + r))
    }

    /// Returns the autocorrelation of the loss indicator at lag `lag` packets, or `None` if losses do not vary (no packet or every packet is lost) or p = r =
    /// 0.
    ///
    /// With the stationary πB = p/(p+r), πG = r/(p+r) and the mean loss ℓ the value at lag n is (1−h − (1−k))²·πB·πG / (ℓ(1−ℓ)) · (1−p−r)ⁿ. At lag 0 the
    /// formula gives less than 1 if a state loses only some of its packets.
    #[must_use]
    pub fn autocorrelation(&self, lag: u32) -> Option<f64> {
        let [p, r, h, k] = [self.p, self.r, self.h, self.k].map(Probability::get);
        let mean = self.mean_loss().filter(|&mean| mean > 0.0 && mean < 1.0)?;
        let spread = (1.0 - h) - (1.0 - k);
        // πB·πG, written with one division by (p + r)².
        let stationary = p * r / ((p + r) * (p + r));
        Some(spread * spread * stationary / (mean * (1.0 - mean)) * libm::pow(1.0 - p - r, f64::from(lag)))
    }

    /// Returns a state drawn from the stationary law with the random word `bits`, or good if the chain never moves.
    pub(crate) fn stationary_state(&self, bits: u64) -> State {
        let (p, r) = (self.p.get(), self.r.get());
        let bad = if p + r > 0.0 { Probability::new(p / (p + r)).unwrap_or(Probability::ZERO) } else { Probability::ZERO };
        if bad.happens(bits) { State::Bad } else { State::Good }
    }

    /// Moves the chain by one packet, and returns whether this packet is lost. Mostly the loss is certain in both states; the word for the loss is then not
    /// drawn.
    #[inline(always)]
    pub(crate) fn loses(&self, state: &mut State, transition: u64, loss: impl FnOnce() -> u64) -> bool {
        // The transition always takes its word, and the loss takes a second word only if the loss is not certain.
        let before = *state;
        *state = match before {
            State::Good if self.p.happens(transition) => State::Bad,
            State::Bad if self.r.happens(transition) => State::Good,
            State::Good | State::Bad => before,
        };
        let gets_through = match before {
            State::Good => self.k,
            State::Bad => self.h,
        };
        gets_through == Probability::ZERO || gets_through != Probability::ONE && !gets_through.happens(loss())
    }
}
