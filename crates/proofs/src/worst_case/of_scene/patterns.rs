//! The patterns of losses and delays that the network may choose from.

use std::time::Duration;

use cohaptic_scene::Scene;
use cohaptic_stability::frames::NominalNetwork;

use super::error::SceneWorstCaseError;

/// The losses and delays that the network may choose.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Patterns {
    /// Largest number of samples in a row that a link loses.
    pub losses_in_a_row: u32,
    /// Shortest and longest delay of a sample, which replace the delays of the scene's links. The two differ by less than the period of sending. `None`: the
    /// delays of the scene's links.
    pub delay: Option<(Duration, Duration)>,
    /// Links that lose and delay together.
    pub links: Links,
}

/// Links that lose and delay samples together.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Links {
    /// In every frame either all links lose the samples that are due or none does, and all links add the same delay: an outage of a part that all links share.
    Together,
    /// Each link in each direction loses and delays on its own. For up to three peers, or any number of equal peers.
    Each,
}

impl Links {
    /// Returns the word in JSON: `together` or `each`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Together => "together",
            Self::Each => "each",
        }
    }
}

impl Patterns {
    /// Returns the network with the shortest delay of every link.
    ///
    /// # Errors
    ///
    /// [`SceneWorstCaseError`] if the interval of delays is empty or not shorter than the period of sending, or if the scene has no nominal network.
    pub(super) fn network(&self, scene: &Scene) -> Result<NominalNetwork, SceneWorstCaseError> {
        let update = scene.coordination.update;
        match self.delay {
            None => Ok(NominalNetwork::of(scene)?),
            Some((least, most)) if least > most => Err(SceneWorstCaseError::Delays { least, most }),
            Some((least, most)) if most - least >= update => Err(SceneWorstCaseError::Overtaking { least, most, update }),
            Some((least, _)) => Ok(NominalNetwork::uniform(least)),
        }
    }

    /// Returns whether the network has any choice, of losses or of delays.
    pub(super) fn choose(&self) -> bool {
        self.losses_in_a_row > 0 || !self.width().is_zero()
    }

    /// Returns the width of the interval of delays.
    pub(super) fn width(&self) -> Duration {
        self.delay.map_or(Duration::ZERO, |(least, most)| most.saturating_sub(least))
    }
}
