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
//! Each packet draws a transition and then its loss, with the probability of the state *before* the transition, as the Linux kernel does.

use cohaptic_units::Probability;

/// The parameters of the chain.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GilbertElliott {
    /// The probability of going from good to bad, per packet.
    pub p: Probability,
    /// The probability of going from bad to good, per packet. The mean stay in the bad state is 1/r packets.
    pub r: Probability,
    /// The probability that a packet gets through in the bad state; 0 by custom: everything is lost there.
    pub h: Probability,
    /// The probability that a packet gets through in the good state; 1 by custom: nothing is lost there.
    pub k: Probability,
}

/// Where the chain is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum State {
    Good,
    Bad,
}

impl GilbertElliott {
    /// The long-run fraction of packets lost, ((1−k)·r + (1−h)·p) / (p + r); `None` if p = r = 0, where the chain never moves.
    #[must_use]
    pub fn mean_loss(&self) -> Option<f64> {
        let [p, r, h, k] = [self.p, self.r, self.h, self.k].map(Probability::get);
        (p + r > 0.0).then(|| ((1.0 - k) * r + (1.0 - h) * p) / (p + r))
    }

    /// The autocorrelation of the loss indicator at lag `n` packets, `None` where it has no meaning (nothing or everything is lost, p = r = 0).
    ///
    /// (1−h − (1−k))²·πB·πG / (ℓ(1−ℓ)) · (1−p−r)ⁿ with the stationary πB = p/(p+r), πG = r/(p+r) and the mean loss ℓ.
    #[must_use]
    pub fn autocorrelation(&self, lag: u32) -> Option<f64> {
        let [p, r, h, k] = [self.p, self.r, self.h, self.k].map(Probability::get);
        let mean = self.mean_loss().filter(|&mean| mean > 0.0 && mean < 1.0)?;
        let spread = (1.0 - h) - (1.0 - k);
        let stationary = p * r / ((p + r) * (p + r));
        Some(spread * spread * stationary / (mean * (1.0 - mean)) * libm::pow(1.0 - p - r, f64::from(lag)))
    }

    /// A state drawn from the stationary law; good if the chain never moves.
    pub(crate) fn stationary_state(&self, bits: u64) -> State {
        let (p, r) = (self.p.get(), self.r.get());
        let bad = if p + r > 0.0 { Probability::new(p / (p + r)).unwrap_or(Probability::ZERO) } else { Probability::ZERO };
        if bad.happens(bits) { State::Bad } else { State::Good }
    }

    /// Moves the chain by one packet and says whether that packet is lost. Mostly that is certain in both states, and the word for it not drawn.
    #[inline(always)]
    pub(crate) fn loses(&self, state: &mut State, transition: u64, loss: impl FnOnce() -> u64) -> bool {
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
