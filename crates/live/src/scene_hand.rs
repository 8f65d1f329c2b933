//! Hand of a scene on the grip of a simulated device, from the beginning of the session on.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use cohaptic_peer::Hand;
use cohaptic_units::Instant;

/// Beginning of the session on the clock of a simulated device, in nanoseconds. The session's thread sets the beginning, and the device's thread reads the
/// beginning. Until then the hand makes the device ready.
#[derive(Clone, Debug)]
pub(crate) struct Beginning(Arc<AtomicU64>);

/// Value before the session begins: no device reaches this instant.
const NOT_YET: u64 = u64::MAX;

impl Default for Beginning {
    fn default() -> Self {
        Self(Arc::new(AtomicU64::new(NOT_YET)))
    }
}

impl Beginning {
    /// Sets the beginning to `at`, unless the session has begun.
    pub(crate) fn begin(&self, at: Instant) {
        // A failed exchange means that the beginning is set already, and the first call counts. `Relaxed` is enough, because no other data depends on the
        // value.
        let _ = self.0.compare_exchange(NOT_YET, at.as_nanos(), Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Returns the time of the session at the device's time `now`, or `None` before the session begins.
    pub(crate) fn since(&self, now: Instant) -> Option<Instant> {
        let begun = self.0.load(Ordering::Relaxed);
        (begun != NOT_YET).then(|| Instant::from_nanos(now.as_nanos().saturating_sub(begun)))
    }
}

/// Force of a scene's hand on the grip of a simulated device.
#[derive(Debug)]
pub(crate) struct SceneForce {
    /// Hand of the peer in the scene. `None` applies no force.
    hand: Option<Hand>,
    /// Origin of the scene in the frame of the device \[m\].
    origin: [f64; 3],
    beginning: Beginning,
}

impl SceneForce {
    /// Returns the force before `beginning`. `origin`: origin of the scene in the frame of the device \[m\].
    pub(crate) const fn new(hand: Option<Hand>, origin: [f64; 3], beginning: Beginning) -> Self {
        Self { hand, origin, beginning }
    }

    /// Mass of an arm, in addition to the mass of the grip \[kg\]. Zero for other hands.
    pub(crate) fn mass(&self) -> f64 {
        match &self.hand {
            Some(Hand::Arm { arm, .. }) => arm.mass,
            Some(Hand::Force(_) | Hand::Operator { .. }) | None => 0.0,
        }
    }

    /// Returns the force on the grip \[N\], or `None` before the session begins. Position \[m\] and velocity \[m/s\] are those of the device.
    pub(crate) fn force(&self, now: Instant, position: [f64; 3], velocity: [f64; 3]) -> Option<[f64; 3]> {
        let elapsed = self.beginning.since(now)?;
        Some(match &self.hand {
            // A scene with an operator at such a device is refused.
            None | Some(Hand::Operator { .. }) => [0.0; 3],
            Some(Hand::Force(signal)) => signal.value(elapsed),
            Some(Hand::Arm { arm, follows }) => {
                // The arm as spring and damper between grip and wanted position. The mass of the arm is part of the mechanics of the device.
                let (wanted, speed) = (follows.value::<3>(elapsed), follows.slope::<3>(elapsed));
                core::array::from_fn(|axis| {
                    arm.stiffness * (self.origin[axis] + wanted[axis] - position[axis]) + arm.damping * (speed[axis] - velocity[axis])
                })
            }
        })
    }
}
