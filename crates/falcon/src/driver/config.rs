//! Configuration of a driver.

use core::time::Duration;

use thiserror::Error;

use crate::calibration::Calibration;
use crate::safety::{Limits, LimitsError};

/// Configuration of a driver.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DriverConfig {
    /// Gain of the motors, and origin of positions.
    pub calibration: Calibration,
    /// Limits of forces.
    pub limits: Limits,
    /// Time for which an exchange waits for its report.
    pub patience: Duration,
    /// Silence of the device after which the driver fails.
    pub longest_silence: Duration,
    /// Bandwidth of the velocity estimate \[Hz\], above 0 and at most 500.
    pub velocity_bandwidth: f64,
    /// Number of consecutive reports with all encoders homed after which the device counts as homed. A single such report can be a flipped bit.
    pub homing_confirmations: u32,
    /// Greatest speed of an encoder \[counts per ms\]. A faster change counts as a byte changed on the wire.
    pub fastest_encoder: u16,
    /// Distance from the base \[m, frame of the device\] beyond which a pull of the grip switches forces on after homing. `None` switches forces on at once.
    pub arm_beyond: Option<f64>,
}

impl DriverConfig {
    /// Default values: 3 ms for a report, 1 s of silence, 30 Hz, ten confirmations, 100 counts per ms (about 3 m/s), forces on beyond 170 mm, as in existing
    /// programs.
    pub const DEFAULT: Self = Self {
        calibration: Calibration::DEFAULT,
        limits: Limits::DEFAULT,
        patience: Duration::from_millis(3),
        longest_silence: Duration::from_secs(1),
        velocity_bandwidth: 30.0,
        homing_confirmations: 10,
        fastest_encoder: 100,
        arm_beyond: Some(0.170),
    };

    /// Returns the configuration if all numbers are within their ranges.
    ///
    /// # Errors
    ///
    /// [`DriverConfigError`] with the first number out of range.
    pub(crate) fn checked(self) -> Result<Self, DriverConfigError> {
        self.limits.checked()?;
        for (name, span, most) in [
            ("patience of an exchange", self.patience, Duration::from_millis(100)),
            ("longest silence", self.longest_silence, Duration::from_secs(60)),
        ] {
            if span.is_zero() || span > most {
                return Err(DriverConfigError::Span { name, span, most });
            }
        }
        // Written so that NaN is refused.
        if !(self.velocity_bandwidth > 0.0 && self.velocity_bandwidth <= 500.0) {
            return Err(DriverConfigError::Bandwidth(self.velocity_bandwidth));
        }
        if self.homing_confirmations == 0 || self.fastest_encoder == 0 {
            return Err(DriverConfigError::Zero);
        }
        match self.arm_beyond {
            Some(z) if !(0.08..=0.18).contains(&z) => Err(DriverConfigError::Arming(z)),
            Some(_) | None => Ok(self),
        }
    }
}

/// Error of a configuration with a number out of range.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
#[non_exhaustive]
pub enum DriverConfigError {
    /// A limit of forces is out of range.
    #[error(transparent)]
    Limits(#[from] LimitsError),
    #[error("the {name} is {span:?}, not within 0 to {most:?}")]
    Span { name: &'static str, span: Duration, most: Duration },
    #[error("the bandwidth of the velocity is {0} Hz, not within 0 to 500: half the rate of the loop is the most it can have")]
    Bandwidth(f64),
    #[error("homing confirmations and the fastest encoder must not be zero")]
    Zero,
    #[error("forces are to be on beyond {0} m from the base, not within 0.08 to 0.18: the grip cannot be pulled there")]
    Arming(f64),
}
