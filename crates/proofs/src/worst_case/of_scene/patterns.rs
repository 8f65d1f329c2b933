//! The patterns of losses and delays that the network may choose from.

use std::time::Duration;

use cohaptic_scene::Scene;
use cohaptic_stability::frames::NominalNetwork;

use super::error::SceneWorstCaseError;

/// What the network may do.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Patterns {
    /// The most samples in a row that are lost on a link.
    pub losses_in_a_row: u32,
    /// Every sample takes any time between these two, which differ by less than the period of sending, whatever the scene's links do. `None`: the delays
    /// of the scene's links.
    pub delay: Option<(Duration, Duration)>,
    /// Which links share their fate.
    pub links: Links,
}

/// Which links share their fate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Links {
    /// In every frame all links lose the samples that are due, or none does, and all delay it alike: an outage of something that they share.
    Together,
    /// Each link in each direction on its own. For up to three peers, or any number of equal ones.
    Each,
}

impl Links {
    /// The word in JSON: `together` or `each`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Together => "together",
            Self::Each => "each",
        }
    }
}

impl Patterns {
    /// The least delays.
    pub(super) fn network(&self, scene: &Scene) -> Result<NominalNetwork, SceneWorstCaseError> {
        let update = scene.coordination.update;
        match self.delay {
            None => Ok(NominalNetwork::of(scene)?),
            Some((least, most)) if least > most => Err(SceneWorstCaseError::Delays { least, most }),
            Some((least, most)) if most - least >= update => Err(SceneWorstCaseError::Overtaking { least, most, update }),
            Some((least, _)) => Ok(NominalNetwork::uniform(least)),
        }
    }

    /// Whether they leave the network anything to choose.
    pub(super) fn choose(&self) -> bool {
        self.losses_in_a_row > 0 || !self.width().is_zero()
    }

    /// How far delays may differ.
    pub(super) fn width(&self) -> Duration {
        self.delay.map_or(Duration::ZERO, |(least, most)| most.saturating_sub(least))
    }
}
