//! Which packets are lost.

use cohaptic_units::Probability;

use crate::GilbertElliott;
use crate::gilbert_elliott::State;
use crate::random::{Draws, Stream};

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
    /// The stage for a model; `None` if nothing is ever lost. `initial` draws the state in which a chain begins.
    pub(crate) fn new(loss: Loss, initial: &mut Draws) -> Option<Self> {
        match loss {
            Loss::None => None,
            Loss::Independent(probability) => Some(Self::Independent(probability)),
            Loss::GilbertElliott(chain) => Some(Self::GilbertElliott(chain, chain.stationary_state(initial.next_word()))),
        }
    }

    /// The same stage with a new model; a chain stays in the state it is in.
    pub(crate) fn reconfigured(self, loss: Loss, initial: &mut Draws) -> Option<Self> {
        match (self, loss) {
            (Self::GilbertElliott(_, state), Loss::GilbertElliott(chain)) => Some(Self::GilbertElliott(chain, state)),
            _ => Self::new(loss, initial),
        }
    }

    /// Whether that packet of the link is lost.
    #[inline]
    pub(crate) fn loses(&mut self, stream: Stream, packet: u64) -> bool {
        match self {
            Self::Independent(probability) => probability.happens(stream.first_word(packet)),
            Self::GilbertElliott(chain, state) => {
                let mut draws = stream.at(packet);
                chain.loses(state, draws.next_word(), draws.next_word())
            }
        }
    }
}
