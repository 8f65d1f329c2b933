//! Hand of a scene on the grip of a simulated Inverse3.

use cohaptic_inverse3::Triple;
use cohaptic_inverse3::service::Hand;
use cohaptic_units::Instant;

use crate::scene_hand::{Beginning, SceneForce};

/// Hand that holds the grip at the origin until the session begins, which arms the device. From then on the hand does as the scene says.
#[derive(Debug)]
pub(super) struct ArmingHand(SceneForce);

impl ArmingHand {
    pub(super) const fn new(hand: Option<cohaptic_peer::Hand>, beginning: Beginning) -> Self {
        Self(SceneForce::new(hand, [0.0; 3], beginning))
    }

    /// Mass of an arm, in addition to the mass of the grip \[kg\]. Zero for other hands.
    pub(super) fn mass(&self) -> f64 {
        self.0.mass()
    }
}

impl Hand for ArmingHand {
    fn force(&mut self, now: Instant, position: Triple, velocity: Triple) -> Triple {
        let hold = || core::array::from_fn(|axis| -100.0 * position[axis] - 5.0 * velocity[axis]);
        self.0.force(now, position, velocity).unwrap_or_else(hold)
    }
}
