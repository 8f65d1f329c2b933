//! The four-state model of loss (Salsano, Ludovici & Ordine 2009; notation of `tc-netem`).
//!
//! ```text
//!            p13                  p23
//!   gap ──────────► burst, lost ◄────────── burst, received
//!   (1) ◄────────── (3)         ──────────► (2)
//!    │ ▲     p31                  p32
//! p14│ │1
//!    ▼ │
//!   isolated loss (4)
//! ```
//!
//! Each packet moves the chain. The packet is lost if the *new* state is 3 or 4.

use core::fmt;

use cohaptic_units::Probability;

/// Parameters of the chain: `pij` is the probability that a packet moves the chain from state i to state j.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FourState {
    p13: Probability,
    p31: Probability,
    p32: Probability,
    p23: Probability,
    p14: Probability,
}

/// Reason for the refusal of a four-state model.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum FourStateError {
    /// The probabilities of leaving the gap exceed 1 together.
    Gap {
        /// Probability of moving to the burst.
        p13: Probability,
        /// Probability of moving to an isolated loss.
        p14: Probability,
    },
    /// The probabilities of leaving a loss within a burst exceed 1 together.
    Burst {
        /// Probability of moving to the gap.
        p31: Probability,
        /// Probability of moving to a packet received within the burst.
        p32: Probability,
    },
    /// No chain has these [`Bursts`]. The text gives the reason.
    Bursts(&'static str),
}

impl fmt::Display for FourStateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gap { p13, p14 } => write!(f, "p13 = {p13} and p14 = {p14} are more than 1 together: expected a sum of at most 1"),
            Self::Burst { p31, p32 } => write!(f, "p31 = {p31} and p32 = {p32} are more than 1 together: expected a sum of at most 1"),
            Self::Bursts(error) => fmt::Display::fmt(error, f),
        }
    }
}

impl core::error::Error for FourStateError {}

/// Four-state model given by observable quantities: the parameters of Salsano et al., called GI by tc.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bursts {
    /// Mean fraction of packets lost.
    pub loss: f64,
    /// Mean length of a burst \[packet\], at least 1.
    pub length: f64,
    /// Fraction of packets lost within a burst.
    pub density: f64,
    /// Fraction of packets lost outside of bursts, relative to the packets outside of bursts.
    pub isolated: f64,
    /// Mean number of packets received in a row within a burst, at least 1.
    pub good_run: f64,
}

/// State of the chain.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum State {
    Gap,
    BurstReceived,
    BurstLost,
    Isolated,
}

impl FourState {
    /// Returns a chain with checked parameters. The defaults of tc are p31 = 1 − p13, p32 = 0, p23 = 1, p14 = 0.
    ///
    /// # Errors
    ///
    /// [`FourStateError`] if the probabilities of leaving a state exceed 1 together.
    pub fn new(p13: Probability, p31: Probability, p32: Probability, p23: Probability, p14: Probability) -> Result<Self, FourStateError> {
        if p13.get() + p14.get() > 1.0 {
            return Err(FourStateError::Gap { p13, p14 });
        }
        if p31.get() + p32.get() > 1.0 {
            return Err(FourStateError::Burst { p31, p32 });
        }
        Ok(Self { p13, p31, p32, p23, p14 })
    }

    /// Returns the chain with the given bursts: p31 = 1/(ρB), p23 = 1/G, p32 = (1−ρ)/(ρG), p14 = I/(1−I), p13 = (P−I)/(B(1−I)(ρ−P)).
    ///
    /// # Errors
    ///
    /// [`FourStateError`] if no chain has such bursts.
    pub fn from_bursts(bursts: Bursts) -> Result<Self, FourStateError> {
        let Bursts { loss, length, density, isolated, good_run } = bursts;
        let unit = 0.0..1.0;
        // NaN fails every comparison, so NaN is refused here.
        let within = (unit.contains(&loss) && unit.contains(&isolated) && density > 0.0 && density <= 1.0 && length >= 1.0 && good_run >= 1.0)
            && isolated <= loss
            && loss < density;
        if !within {
            return Err(FourStateError::Bursts(
                "bursts need 0 ≤ isolated ≤ loss < density ≤ 1, a length of at least 1 packet and a good run of at least 1",
            ));
        }
        let p =
            |value| Probability::new(value).map_err(|_| FourStateError::Bursts("no chain has such bursts: a probability of moving would exceed 1"));
        Self::new(
            p((loss - isolated) / (length * (1.0 - isolated) * (density - loss)))?,
            p(1.0 / (density * length))?,
            p((1.0 - density) / (density * good_run))?,
            p(1.0 / good_run)?,
            p(isolated / (1.0 - isolated))?,
        )
    }

    /// Returns the probability that a packet moves the chain from a state (row) to a state (column). A packet that moves the chain to the third or fourth state
    /// is lost. The states are, in order: gap, received within a burst, lost within a burst, isolated loss (states 1 to 4).
    #[must_use]
    pub fn transitions(&self) -> [[f64; 4]; 4] {
        let [p13, p31, p32, p23, p14] = [self.p13, self.p31, self.p32, self.p23, self.p14].map(Probability::get);
        [
            [1.0 - p13 - p14, 0.0, p13, p14], //
            [0.0, 1.0 - p23, p23, 0.0],
            [p31, p32, 1.0 - p31 - p32, 0.0],
            [1.0, 0.0, 0.0, 0.0],
        ]
    }

    /// Returns the long-run fraction of packets in each state, 1 to 4, for a chain with its start in the gap. A chain in a state without exit stays there.
    #[must_use]
    pub fn stationary(&self) -> [f64; 4] {
        let [p13, p31, p32, p23, p14] = [self.p13, self.p31, self.p32, self.p23, self.p14].map(Probability::get);
        // The chain never reaches a burst, and moves between the gap and isolated losses only.
        if p13 == 0.0 {
            let gap = 1.0 / (1.0 + p14);
            return [gap, 0.0, 0.0, gap * p14];
        }
        // The chain cannot leave the state "received within a burst" once there.
        if p32 > 0.0 && p23 == 0.0 {
            return [0.0, 1.0, 0.0, 0.0];
        }
        let received = if p32 == 0.0 { 0.0 } else { p32 / p23 };
        // The chain never returns from the burst to the gap.
        if p31 == 0.0 {
            let lost = 1.0 / (1.0 + received);
            return [0.0, lost * received, lost, 0.0];
        }
        // In the stationary law the flows between neighbouring states balance: gap·p13 = lost·p31 and lost·p32 = received·p23.
        let ratio = p13 / p31;
        let gap = 1.0 / (1.0 + p14 + ratio * (1.0 + received));
        [gap, gap * ratio * received, gap * ratio, gap * p14]
    }

    /// Returns the long-run fraction of packets lost.
    #[must_use]
    pub fn mean_loss(&self) -> f64 {
        let [_, _, lost, isolated] = self.stationary();
        lost + isolated
    }

    /// Returns a state drawn from the stationary law. `unit` is uniform on [0, 1).
    pub(crate) fn initial_state(&self, unit: f64) -> State {
        let [gap, received, lost, _] = self.stationary();
        if unit < gap {
            State::Gap
        } else if unit < gap + received {
            State::BurstReceived
        } else if unit < gap + received + lost {
            State::BurstLost
        } else {
            State::Isolated
        }
    }

    /// Moves the chain by one packet, and returns whether this packet is lost. `unit` is uniform on [0, 1).
    pub(crate) fn loses(&self, state: &mut State, unit: f64) -> bool {
        // One uniform number selects among at most three ways: [0, first), [first, first + second), and the rest.
        let pick = |first: Probability, to_first, second: Probability, to_second, otherwise| {
            if unit < first.get() {
                to_first
            } else if unit < first.get() + second.get() {
                to_second
            } else {
                otherwise
            }
        };
        *state = match *state {
            State::Gap => pick(self.p14, State::Isolated, self.p13, State::BurstLost, State::Gap),
            State::BurstLost => pick(self.p32, State::BurstReceived, self.p31, State::Gap, State::BurstLost),
            State::BurstReceived => pick(self.p23, State::BurstLost, Probability::ZERO, State::BurstLost, State::BurstReceived),
            State::Isolated => State::Gap,
        };
        matches!(state, State::BurstLost | State::Isolated)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Stream};

    /// Compares the loss of 10⁶ packets with the stationary law, for three chains. Losses in runs of B packets have about B times the variance of independent
    /// losses: the standard error is below √(0.25·20/10⁶) = 0.0023.
    #[test]
    fn the_fraction_lost_is_the_stationary_one() {
        let p = |value| Probability::new(value).unwrap();
        let chains = [
            FourState::new(p(0.1), p(0.4), p(0.2), p(0.5), p(0.02)).unwrap(),
            FourState::new(p(0.01), p(0.1), p(0.0), p(1.0), p(0.0)).unwrap(),
            FourState::from_bursts(Bursts { loss: 0.05, length: 10.0, density: 0.8, isolated: 0.005, good_run: 3.0 }).unwrap(),
        ];
        assert!((chains[2].mean_loss() - 0.05).abs() < 0.001, "{}", chains[2].mean_loss());
        for chain in chains {
            let stream = Stream::new(8, b"four states");
            let mut state = chain.initial_state(0.3);
            let lost = (0..1_000_000).filter(|number| chain.loses(&mut state, stream.packet(*number).draws(Purpose::Loss).next_unit())).count();
            assert!((lost as f64 / 1e6 - chain.mean_loss()).abs() < 4.5 * 0.0023, "{lost} {}", chain.mean_loss());
        }
    }

    #[test]
    fn a_chain_that_cannot_be_is_refused() {
        let p = |value| Probability::new(value).unwrap();
        assert!(matches!(FourState::new(p(0.6), p(0.1), p(0.1), p(0.1), p(0.6)), Err(FourStateError::Gap { .. })));
        assert!(matches!(FourState::new(p(0.6), p(0.7), p(0.7), p(0.1), p(0.1)), Err(FourStateError::Burst { .. })));
        let bursts = Bursts { loss: 0.9, length: 10.0, density: 0.8, isolated: 0.0, good_run: 3.0 };
        assert!(matches!(FourState::from_bursts(bursts), Err(FourStateError::Bursts(_))));
    }
}
