//! Hand of a scene on the grip of a simulated Falcon.

use std::time::Duration;

use cohaptic_falcon::simulator::{Hand, Waypoints};
use cohaptic_units::Instant;

use crate::scene_hand::{Beginning, SceneForce};

/// Hand for homing the device and holding the device at the origin until the session begins. From then on the hand does as the scene says.
#[derive(Debug)]
pub(super) struct SceneHand {
    homing: Waypoints,
    scene: SceneForce,
}

impl SceneHand {
    /// Returns a hand before `beginning`. `origin`: origin of the scene in the frame of the device \[m\].
    pub(super) fn new(hand: Option<cohaptic_peer::Hand>, origin: [f64; 3], beginning: Beginning) -> Self {
        Self { homing: Waypoints::homing(Duration::ZERO), scene: SceneForce::new(hand, origin, beginning) }
    }

    /// Mass of an arm, in addition to the mass of the grip \[kg\]. Zero for other hands.
    pub(super) fn mass(&self) -> f64 {
        self.scene.mass()
    }
}

impl Hand for SceneHand {
    fn force(&mut self, now: Instant, position: [f64; 3], velocity: [f64; 3]) -> [f64; 3] {
        self.scene.force(now, position, velocity).unwrap_or_else(|| self.homing.force(now, position, velocity))
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_peer::{ArmConfig, Signal};

    use super::*;

    const ORIGIN: [f64; 3] = [0.0, 0.0, 0.125];

    #[test]
    fn a_hand_homes_until_the_session_begins_and_counts_time_from_there() {
        let beginning = Beginning::default();
        let arm = ArmConfig { mass: 0.5, damping: 2.0, stiffness: 100.0 };
        let follows = Signal::Constant([0.01, 0.0, 0.0]);
        let mut hand = SceneHand::new(Some(cohaptic_peer::Hand::Arm { arm, follows }), ORIGIN, beginning.clone());
        let mut homing = Waypoints::homing(Duration::ZERO);
        let at = |millis: u64| Instant::from_nanos(millis * 1_000_000);
        let bits = |force: [f64; 3]| force.map(f64::to_bits);
        assert_eq!(bits(hand.force(at(500), ORIGIN, [0.0; 3])), bits(homing.force(at(500), ORIGIN, [0.0; 3])));
        beginning.begin(at(6000));
        beginning.begin(at(9000));
        assert_eq!(beginning.since(at(6500)), Some(at(500)));
        // 100 N/m over 10 mm, less 2 N·s/m at 0.1 m/s; the other axes are pulled to the origin.
        let force = hand.force(at(6500), [0.0, 0.002, 0.125], [0.1, 0.0, 0.0]);
        assert!((force[0] - 0.8).abs() < 1e-12 && (force[1] + 0.2).abs() < 1e-12 && force[2].abs() < 1e-12, "{force:?}");
        assert!((hand.mass() - 0.5).abs() < 1e-15);
    }
}
