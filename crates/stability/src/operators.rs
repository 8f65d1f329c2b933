//! Operators whose law is linear, as a scene describes them.
//!
//! The analysis follows the linear part of the law crossover: the seen place, the visual delay, and the velocity of the wanted place. Of the law moves the
//! analysis follows the arm alone, as if the wanted place stood still: movements are planned in sequence, and such plans are not linear.

use cohaptic_peer::ArmConfig;
use cohaptic_peer::operator::{OperatorLaw, Seen};
use cohaptic_scene::Scene;

/// Linear part of an operator with the law crossover.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Crossover {
    /// Crossover frequency ωc [rad/s].
    pub(crate) frequency: f64,
    /// Arm of the person.
    pub(crate) arm: ArmConfig,
    /// Visual delay in ticks of the peer.
    pub(crate) lag: usize,
    /// Tick of the peer \[s\].
    pub(crate) tick: f64,
    /// Copy of the object that the person sees.
    pub(crate) sees: Seen,
}

impl Crossover {
    /// Returns the operator that holds the device of a peer; `None` without an operator, or for an operator with another law.
    pub(crate) fn of(scene: &Scene, peer: usize) -> Option<Self> {
        let (config, arm) = (scene.operator(peer)?, scene.peers[peer].hand.as_ref()?.arm()?);
        let OperatorLaw::Crossover { frequency } = config.law else { return None };
        let tick = scene.peers[peer].clock.tick;
        let lag = usize::try_from(config.visual_ticks(tick)).unwrap_or(usize::MAX);
        Some(Self { frequency, arm, lag, tick: tick.as_secs_f64(), sees: config.sees })
    }

    /// Returns the first peer whose device an operator with the law crossover holds.
    pub(crate) fn first_peer(scene: &Scene) -> Option<usize> {
        (0..scene.peers.len()).find(|peer| Self::of(scene, *peer).is_some())
    }

    /// Returns the other peer whose samples the person sees; `None` for the own copy.
    pub(crate) const fn seen_peer(&self) -> Option<usize> {
        match self.sees {
            Seen::Own => None,
            Seen::Peer(other) => Some(other),
        }
    }
}
