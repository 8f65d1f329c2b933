//! Motor counts, made of admitted forces alone.

use cohaptic_device::GatedForce;

use crate::calibration::{Calibration, MOTOR_LIMIT};
use crate::kinematics::Jacobian;

/// Counts of the three motors. The only values are zero and results of a [`ForceGate`](super::ForceGate), so every count that reaches a motor has passed the
/// gate.
///
/// ```compile_fail
/// let counts = cohaptic_falcon::safety::MotorCounts([4000; 3]);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct MotorCounts([i16; 3]);

impl MotorCounts {
    /// Zero torque.
    pub const ZERO: Self = Self([0; 3]);

    /// Returns the counts that make a force with the grip at the place of the Jacobian, and whether a motor was at its limit; `None` for a force without
    /// torques.
    pub(super) fn of(force: GatedForce, jacobian: &Jacobian, calibration: &Calibration) -> Option<(Self, bool)> {
        // A positive count turns an arm backwards, hence the sign.
        let counts = jacobian.torques(force.newtons())?.map(|torque| -calibration.counts_per_newton_metre() * torque);
        let largest = counts.iter().fold(0.0_f64, |largest, count| largest.max(count.abs()));
        let limit = f64::from(MOTOR_LIMIT);
        let saturated = largest > limit;
        // A common factor for all motors keeps the direction of the force.
        let scale = if saturated { limit / largest } else { 1.0 };
        counts.iter().all(|count| count.is_finite()).then(|| (Self(counts.map(|count| whole(count * scale))), saturated))
    }

    /// Returns the counts of the motors top, right, left, each within ±[`MOTOR_LIMIT`].
    #[must_use]
    pub const fn get(self) -> [i16; 3] {
        self.0
    }
}

/// Rounds a count to the nearest integer within the limit of a motor.
#[expect(clippy::cast_possible_truncation, reason = "clamped to what a motor takes")]
fn whole(count: f64) -> i16 {
    libm::rint(count).clamp(-f64::from(MOTOR_LIMIT), f64::from(MOTOR_LIMIT)) as i16
}
