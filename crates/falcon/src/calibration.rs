//! Properties of a device that are known only roughly, as parameters that a laboratory can measure and replace.

use thiserror::Error;

use crate::kinematics::Triple;

/// Largest motor count, in either direction. Novint's own library stops at this value: a captured packet for 100 N holds 4095.
pub const MOTOR_LIMIT: i16 = 4095;

/// Motor counts per torque, and the origin of positions.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Calibration {
    counts_per_newton_metre: f64,
    origin: Triple,
}

impl Calibration {
    /// Default values: 10,000 counts per N·m at an arm, and the origin 125 mm in front of the base.
    ///
    /// The counts are libnifalcon's. Novint's own library seems to use 2200 to 5400 counts, fitted to four of its packets of unknown pose. If Novint's
    /// newtons are correct, a device pushes up to 4.5 times as hard as asked with this default.
    ///
    /// At 125 mm the usable radius is 80 mm, and the inner and the outer end of the workspace are 45 mm and 50 mm away, so a ball of 40 mm around the origin
    /// lies within the workspace. VRPN uses the same origin. libnifalcon and HAPI use 150 mm, where 61 mm are left sideways and 30 mm outwards.
    pub const DEFAULT: Self = Self { counts_per_newton_metre: 10_000.0, origin: [0.0, 0.0, 0.125] };

    /// Returns a calibration with `counts_per_newton_metre`, counts per N·m at an arm, and `origin`, the origin of positions in the frame of the device
    /// \[m\].
    ///
    /// # Errors
    ///
    /// [`CalibrationError`] for a number out of range.
    pub fn new(counts_per_newton_metre: f64, origin: Triple) -> Result<Self, CalibrationError> {
        // `contains` is false for NaN, so NaN is refused too.
        if !(100.0..=100_000.0).contains(&counts_per_newton_metre) {
            return Err(CalibrationError::Gain(counts_per_newton_metre));
        }
        if !crate::kinematics::is_usable(origin) {
            return Err(CalibrationError::Origin(origin));
        }
        Ok(Self { counts_per_newton_metre, origin })
    }

    /// Returns the motor counts per N·m of torque at an arm, without a sign: a positive count turns the arm backwards.
    #[must_use]
    pub(crate) const fn counts_per_newton_metre(&self) -> f64 {
        self.counts_per_newton_metre
    }

    /// Returns the origin of positions in the frame of the device \[m\].
    #[must_use]
    pub const fn origin(&self) -> Triple {
        self.origin
    }
}

/// Error of a calibration with a number out of range.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// The counts per N·m are far from the counts of any known Falcon.
    #[error("{0} counts per N·m are not within 100 to 100000: 10000 is libnifalcon's value, 2200 to 5400 fits Novint's own packets")]
    Gain(f64),
    /// The grip cannot be at the origin.
    #[error("the origin {0:?} m is not within the workspace: [0, 0, 0.125] is the default")]
    Origin(Triple),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_makes_no_sense_is_refused() {
        for gain in [0.0, -10_000.0, f64::NAN, f64::INFINITY, 1e9] {
            assert!(matches!(Calibration::new(gain, [0.0, 0.0, 0.125]), Err(CalibrationError::Gain(_))));
        }
        for z in [0.0, 0.5, f64::NAN] {
            assert!(matches!(Calibration::new(5000.0, [0.0, 0.0, z]), Err(CalibrationError::Origin(_))));
        }
        assert_eq!(Calibration::new(10_000.0, [0.0, 0.0, 0.125]), Ok(Calibration::DEFAULT));
    }
}
