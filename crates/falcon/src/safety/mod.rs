//! Force gate, the only source of motor counts.

mod gate;
mod limits;

pub use gate::{Admitted, Changes, ForceGate, Moment, Verdict, ZeroCause};
pub use limits::{Limits, LimitsError};

/// Counts of the three motors. The only values are zero and results of a [`ForceGate`], so every count that reaches a motor has passed the gate.
///
/// ```compile_fail
/// let counts = cohaptic_falcon::safety::MotorCounts([4000; 3]);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct MotorCounts([i16; 3]);

impl MotorCounts {
    /// Zero torque.
    pub const ZERO: Self = Self([0; 3]);

    /// Returns the counts of the motors top, right, left, each within ±[`MOTOR_LIMIT`](crate::calibration::MOTOR_LIMIT).
    #[must_use]
    pub const fn get(self) -> [i16; 3] {
        self.0
    }
}

#[cfg(test)]
mod tests;
