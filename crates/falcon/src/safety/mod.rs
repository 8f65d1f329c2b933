//! The force gate: nothing else makes motor counts.

mod gate;
mod limits;

pub use gate::{Admitted, Changes, ForceGate, Moment, Verdict, ZeroCause};
pub use limits::{Limits, LimitsError};

/// What the three motors are told. Zero, or made by a [`ForceGate`]: there is no other way to get one, so whatever reaches a motor passed the gate.
///
/// ```compile_fail
/// let counts = cohaptic_falcon::safety::MotorCounts([4000; 3]);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct MotorCounts([i16; 3]);

impl MotorCounts {
    /// No torque.
    pub const ZERO: Self = Self([0; 3]);

    /// The counts of the motors top, right, left; each within ±[`MOTOR_LIMIT`](crate::calibration::MOTOR_LIMIT).
    #[must_use]
    pub const fn get(self) -> [i16; 3] {
        self.0
    }
}

#[cfg(test)]
mod tests;
