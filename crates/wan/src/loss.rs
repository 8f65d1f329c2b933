//! Which packets are lost.

use cohaptic_units::Probability;

use crate::GilbertElliott;
use crate::gilbert_elliott::State;
use crate::random::{PacketDraws, Purpose};

/// A loss model.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[non_exhaustive]
pub enum Loss {
    /// Nothing is lost, and no random number is drawn.
    #[default]
    None,
    /// Every packet is lost with the same probability, whatever happened to the others.
    Independent(Probability),
    /// Losses come in bursts: a Markov chain of a good and a bad state.
    GilbertElliott(GilbertElliott),
}

impl Loss {
    /// The long-run fraction of packets lost, `None` where the chain never leaves the state it is in, so that the fraction depends on the start.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        match self {
            Self::None => Some(0.0),
            Self::Independent(probability) => Some(probability.get()),
            Self::GilbertElliott(chain) => chain.mean_loss(),
        }
    }
}

/// The loss stage of one link: the model and what it remembers.
#[derive(Clone, Copy, Debug)]
pub(crate) enum LossStage {
    Independent(Probability),
    GilbertElliott(GilbertElliott, State),
}

impl LossStage {
    /// The stage for a model; `None` if nothing is ever lost. `initial` is the random word for the state in which a chain begins.
    pub(crate) fn new(loss: Loss, initial: u64) -> Option<Self> {
        match loss {
            Loss::None => None,
            Loss::Independent(probability) => Some(Self::Independent(probability)),
            Loss::GilbertElliott(chain) => Some(Self::GilbertElliott(chain, chain.stationary_state(initial))),
        }
    }

    /// The same stage with a new model; a chain stays in the state it is in.
    pub(crate) fn reconfigured(self, loss: Loss, initial: u64) -> Option<Self> {
        match (self, loss) {
            (Self::GilbertElliott(_, state), Loss::GilbertElliott(chain)) => Some(Self::GilbertElliott(chain, state)),
            _ => Self::new(loss, initial),
        }
    }

    /// Whether a packet is lost. `word` is the first of its words for loss.
    #[inline]
    pub(crate) fn loses(&mut self, word: u64, packet: PacketDraws) -> bool {
        match self {
            Self::Independent(probability) => probability.happens(word),
            Self::GilbertElliott(chain, state) => chain.loses(state, word, packet.more(Purpose::Loss).next_word()),
        }
    }
}
