//! Properties of a device that are known only roughly, as numbers that a laboratory may replace.

use thiserror::Error;

use crate::kinematics::Triple;

/// The largest count that a motor is ever told, either way. Novint's own library stops there: a captured packet for 100 N holds 4095.
pub const MOTOR_LIMIT: i16 = 4095;

/// How torques become motor counts, and where positions are counted from.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Calibration {
    counts_per_newton_metre: f64,
    origin: Triple,
}

impl Calibration {
    /// The default: 10,000 counts per N·m of an arm, and the origin 125 mm in front of the base.
    ///
    /// The counts are those of libnifalcon. Novint's own library seems to use 2200 to 5400, fitted to four of its packets of unknown pose: so a device may
    /// push up to 4.5 times as hard as it is asked to, if Novint's newtons are the true ones.
    ///
    /// There the usable radius is 80 mm and the device is 45 mm from its inner end and 50 mm from its outer one, so a ball of 40 mm around it lies within
    /// the workspace. VRPN uses the same origin; libnifalcon and HAPI use 150 mm, where 61 mm are left sideways and 30 mm outwards.
    pub const DEFAULT: Self = Self { counts_per_newton_metre: 10_000.0, origin: [0.0, 0.0, 0.125] };

    /// A calibration of one's own: counts per N·m at an arm, and the point of the device's frame that is to be the origin \[m\].
    ///
    /// # Errors
    ///
    /// [`CalibrationError`] if a number makes no sense.
    pub fn new(counts_per_newton_metre: f64, origin: Triple) -> Result<Self, CalibrationError> {
        if !(100.0..=100_000.0).contains(&counts_per_newton_metre) {
            return Err(CalibrationError::Gain(counts_per_newton_metre));
        }
        if !crate::kinematics::is_usable(origin) {
            return Err(CalibrationError::Origin(origin));
        }
        Ok(Self { counts_per_newton_metre, origin })
    }

    /// Motor counts for each N·m of torque at an arm. The sign is not in it: a positive count turns the arm backwards.
    #[must_use]
    pub const fn counts_per_newton_metre(&self) -> f64 {
        self.counts_per_newton_metre
    }

    /// The origin of positions, in the frame of the device \[m\].
    #[must_use]
    pub const fn origin(&self) -> Triple {
        self.origin
    }
}

/// A number of a calibration makes no sense.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
pub enum CalibrationError {
    /// Counts per N·m are far from those of any Falcon.
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
