//! What a force must keep to.

use core::time::Duration;

use thiserror::Error;

/// Limits that every force keeps to.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limits {
    /// The largest force \[N\], by its length.
    pub force: f64,
    /// The fastest change of force \[N/s\], by its length, when it goes on. Going off is at once.
    pub slew: f64,
    /// A force asked for longer ago than this is no force.
    pub setpoint_age: Duration,
    /// If the newest report of the device is older than this there is no force.
    pub reading_age: Duration,
    /// If the loop pauses longer than this, its next force is zero.
    pub gap: Duration,
}

impl Limits {
    /// 4 N, which is half of what the device is said to give; 1000 N/s; no force 50 ms after it was last asked for, 10 ms after the last report,
    /// and after a pause of 20 ms.
    pub const DEFAULT: Self = Self {
        force: 4.0,
        slew: 1000.0,
        setpoint_age: Duration::from_millis(50),
        reading_age: Duration::from_millis(10),
        gap: Duration::from_millis(20),
    };

    /// The same, if they make sense.
    ///
    /// # Errors
    ///
    /// [`LimitsError`] names the first that does not.
    pub fn checked(self) -> Result<Self, LimitsError> {
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

/// A limit that makes no sense.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
pub enum LimitsError {
    #[error("the limit of force is {0} N, not within 0 to 20: the device is said to give 8")]
    Force(f64),
    #[error("the limit of slew is {0} N/s, not within 0 to 1000000: 1000 is the default")]
    Slew(f64),
    #[error("the limit of the {name} is {span:?}, not within 0 to 1 s")]
    Span { name: &'static str, span: Duration },
}
