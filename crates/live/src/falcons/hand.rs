//! Hand of a scene on the grip of a simulated Falcon.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use cohaptic_falcon::simulator::{Hand, Waypoints};
use cohaptic_units::Instant;

/// Beginning of the session on the clock of a simulated device, in nanoseconds. The session's thread sets the beginning, and the device's thread reads the
/// beginning. Until then the hand homes the device.
#[derive(Clone, Debug)]
pub(super) struct Beginning(Arc<AtomicU64>);

/// Value before the session begins: no device reaches this instant.
const NOT_YET: u64 = u64::MAX;

impl Default for Beginning {
    fn default() -> Self {
        Self(Arc::new(AtomicU64::new(NOT_YET)))
    }
}

impl Beginning {
    /// Sets the beginning to `at`, unless the session has begun.
    pub(super) fn begin(&self, at: Instant) {
        // A failed exchange means that the beginning is set already, and the first call counts. `Relaxed` is enough, because no other data depends on the
        // value.
        let _ = self.0.compare_exchange(NOT_YET, at.as_nanos(), Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Returns the time of the session at the device's time `now`, or `None` before the session begins.
    fn since(&self, now: Instant) -> Option<Instant> {
        let begun = self.0.load(Ordering::Relaxed);
        (begun != NOT_YET).then(|| Instant::from_nanos(now.as_nanos().saturating_sub(begun)))
    }
}

/// Hand for homing the device and holding the device at the origin until the session begins. From then on the hand does as the scene says.
#[derive(Debug)]
pub(super) struct SceneHand {
    homing: Waypoints,
    /// Hand of the peer in the scene. `None` applies no force.
    hand: Option<cohaptic_peer::Hand>,
    /// Origin of the scene in the frame of the device \[m\].
    origin: [f64; 3],
    beginning: Beginning,
}

impl SceneHand {
    /// Returns a hand before `beginning`. `origin`: origin of the scene in the frame of the device \[m\].
    pub(super) fn new(hand: Option<cohaptic_peer::Hand>, origin: [f64; 3], beginning: Beginning) -> Self {
        Self { homing: Waypoints::homing(Duration::ZERO), hand, origin, beginning }
    }

    /// Mass of an arm, in addition to the mass of the grip \[kg\]. Zero for other hands.
    pub(super) fn mass(&self) -> f64 {
        match &self.hand {
            Some(cohaptic_peer::Hand::Arm { arm, .. }) => arm.mass,
            Some(cohaptic_peer::Hand::Force(_) | cohaptic_peer::Hand::Operator { .. }) | None => 0.0,
        }
    }
}

impl Hand for SceneHand {
    fn force(&mut self, now: Instant, position: [f64; 3], velocity: [f64; 3]) -> [f64; 3] {
        let Some(elapsed) = self.beginning.since(now) else { return self.homing.force(now, position, velocity) };
        match &self.hand {
            // A scene with an operator at a Falcon is refused.
            None | Some(cohaptic_peer::Hand::Operator { .. }) => [0.0; 3],
            Some(cohaptic_peer::Hand::Force(signal)) => signal.value(elapsed),
            Some(cohaptic_peer::Hand::Arm { arm, follows }) => {
                // The arm as spring and damper between grip and wanted position. The mass of the arm is part of the mechanics of the device.
                let (wanted, speed) = (follows.value::<3>(elapsed), follows.slope::<3>(elapsed));
                core::array::from_fn(|axis| {
                    arm.stiffness * (self.origin[axis] + wanted[axis] - position[axis]) + arm.damping * (speed[axis] - velocity[axis])
                })
            }
        }
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
