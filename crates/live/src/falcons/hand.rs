//! The hand of a scene on the grip of a simulated Falcon.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use cohaptic_falcon::simulator::{Hand, Waypoints};
use cohaptic_units::Instant;

/// When the session begins for a hand, on the clock of its device; it homes the device until then.
#[derive(Clone, Debug)]
pub(super) struct Beginning(Arc<AtomicU64>);

const NOT_YET: u64 = u64::MAX;

impl Default for Beginning {
    fn default() -> Self {
        Self(Arc::new(AtomicU64::new(NOT_YET)))
    }
}

impl Beginning {
    /// The session begins at `at`, unless it has begun.
    pub(super) fn begin(&self, at: Instant) {
        // The first thread has set it.
        let _ = self.0.compare_exchange(NOT_YET, at.as_nanos(), Ordering::Relaxed, Ordering::Relaxed);
    }

    fn since(&self, now: Instant) -> Option<Instant> {
        let begun = self.0.load(Ordering::Relaxed);
        (begun != NOT_YET).then(|| Instant::from_nanos(now.as_nanos().saturating_sub(begun)))
    }
}

/// Homes the device, waits at the origin, and does what the scene says from the beginning of the session on.
#[derive(Debug)]
pub(super) struct SceneHand {
    homing: Waypoints,
    hand: Option<cohaptic_peer::Hand>,
    origin: [f64; 3],
    beginning: Beginning,
}

impl SceneHand {
    /// `origin`: the origin of the scene in the frame of the device.
    pub(super) fn new(hand: Option<cohaptic_peer::Hand>, origin: [f64; 3], beginning: Beginning) -> Self {
        Self { homing: Waypoints::homing(Duration::ZERO), hand, origin, beginning }
    }

    /// What an arm adds to the mass of the grip \[kg\].
    pub(super) fn mass(&self) -> f64 {
        match &self.hand {
            Some(cohaptic_peer::Hand::Arm { arm, .. }) => arm.mass,
            Some(cohaptic_peer::Hand::Force(_)) | None => 0.0,
        }
    }
}

impl Hand for SceneHand {
    fn force(&mut self, now: Instant, position: [f64; 3], velocity: [f64; 3]) -> [f64; 3] {
        let Some(elapsed) = self.beginning.since(now) else { return self.homing.force(now, position, velocity) };
        match &self.hand {
            None => [0.0; 3],
            Some(cohaptic_peer::Hand::Force(signal)) => signal.value(elapsed),
            Some(cohaptic_peer::Hand::Arm { arm, follows }) => {
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
