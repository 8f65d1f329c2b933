//! Limits of forces.

use core::time::Duration;

use thiserror::Error;

/// Limits of every force.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limits {
    /// Greatest length of a force \[N\], 0 to 20.
    pub force: f64,
    /// Fastest change of an admitted force \[N/s\], by the length of the change; above 0 and at most 10⁶. The gate makes a force zero at once.
    pub slew: f64,
    /// Age of a setpoint above which the force is zero; above 0 and at most 1 s.
    pub setpoint_age: Duration,
    /// Age of the newest reading above which the force is zero; above 0 and at most 1 s.
    pub reading_age: Duration,
    /// Pause of the loop above which the next force is zero; above 0 and at most 1 s.
    pub gap: Duration,
}

impl Limits {
    /// Default values: 4 N, 1000 N/s, and zero force 50 ms after the last setpoint, 10 ms after the last reading, and after a pause of 20 ms.
    pub const DEFAULT: Self = Self {
        force: 4.0,
        slew: 1000.0,
        setpoint_age: Duration::from_millis(50),
        reading_age: Duration::from_millis(10),
        gap: Duration::from_millis(20),
    };

    /// Returns the limits if all numbers are within their ranges.
    ///
    /// # Errors
    ///
    /// [`LimitsError`] with the first limit out of range.
    pub fn checked(self) -> Result<Self, LimitsError> {
        // `contains` is false for NaN, so NaN is refused too.
        if !(0.0..=20.0).contains(&self.force) {
            return Err(LimitsError::Force(self.force));
        }
        if !(self.slew > 0.0 && self.slew <= 1e6) {
            return Err(LimitsError::Slew(self.slew));
        }
        for (name, span) in [("age of a setpoint", self.setpoint_age), ("age of a reading", self.reading_age), ("gap of the loop", self.gap)] {
            if span.is_zero() || span > Duration::from_secs(1) {
                return Err(LimitsError::Span { name, span });
            }
        }
        Ok(self)
    }
}

/// Error of a limit out of range.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
#[non_exhaustive]
pub enum LimitsError {
    #[error("the limit of force is {0} N, not within 0 to 20")]
    Force(f64),
    #[error("the limit of slew is {0} N/s, not within 0 to 1000000: 1000 is the default")]
    Slew(f64),
    #[error("the limit of the {name} is {span:?}, not within 0 to 1 s")]
    Span { name: &'static str, span: Duration },
}
