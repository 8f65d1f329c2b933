//! Lengths, angles and encoder counts of the device.

use core::f64::consts::{FRAC_1_SQRT_2, PI};

/// Length of an arm, from the motor's drum to the knee \[m\].
pub(super) const ARM: f64 = 0.060;
/// Length of the shin, a parallelogram \[m\].
pub(super) const SHIN: f64 = 0.1025;
/// Half the width of the grip's plate, from the middle to the end of the shin \[m\].
pub(super) const C: f64 = 0.01443;
/// Sum d + e of the end pieces of the shin \[m\].
pub(super) const ENDS: f64 = 0.01125 + 0.01125;
/// Offset of the shin's end from the plane of the arm \[m\].
pub(super) const F: f64 = -0.025;
/// Offset r of an arm's axis from the middle, along the leg \[m\].
pub(super) const R: f64 = 0.0400;
/// Offset s of an arm's axis from the middle, across the leg \[m\].
pub(super) const S: f64 = -0.02309;

/// Angle of an arm at the index of its encoder \[degrees\].
pub(crate) const HOME_ANGLE: f64 = 35.0;
/// Encoder counts per turn of an arm: 320 slots with four counts each, and drums of 110 mm and 14.25 mm.
pub(crate) const COUNTS_PER_TURN: f64 = 320.0 * 4.0 * 110.0 / 14.25;
/// Angle of an arm per count \[degrees\]: 0.036434659…
pub(crate) const DEGREES_PER_COUNT: f64 = 360.0 / COUNTS_PER_TURN;

/// Returns the angle of an arm \[rad\] at a count, which may have a fraction.
#[must_use]
pub fn angle_of_count(count: f64) -> f64 {
    (count * DEGREES_PER_COUNT + HOME_ANGLE) * (PI / 180.0)
}

/// Returns the count, with its fraction, at an angle of the arm \[rad\].
#[must_use]
pub fn count_of_angle(angle: f64) -> f64 {
    (angle * (180.0 / PI) - HOME_ANGLE) / DEGREES_PER_COUNT
}

/// Cosine and sine of the azimuths of the legs top, right and left around the middle: 105°, −15° and −135° clockwise from the front.
pub(super) const DIRECTIONS: [(f64, f64); 3] =
    [(-0.258_819_045_102_520_74, 0.965_925_826_289_068_3), (0.965_925_826_289_068_3, -0.258_819_045_102_520_74), (-FRAC_1_SQRT_2, -FRAC_1_SQRT_2)];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drums_and_slots_give_the_published_step() {
        // The published values are 9880.70 counts and 0.036434659 degrees.
        assert!((COUNTS_PER_TURN - 9880.70).abs() < 0.005);
        assert!((DEGREES_PER_COUNT - 0.036_434_659).abs() < 0.51e-9);
    }

    #[test]
    fn directions_are_those_of_the_azimuths() {
        for (azimuth, (cosine, sine)) in [105.0_f64, -15.0, -135.0].into_iter().zip(DIRECTIONS) {
            assert!((azimuth.to_radians().cos() - cosine).abs() < 3e-16 && (azimuth.to_radians().sin() - sine).abs() < 3e-16);
        }
    }

    #[test]
    fn counts_and_angles_are_inverses() {
        for count in [-2000.0, -516.32, 0.0, 1.0, 1500.0] {
            assert!((count_of_angle(angle_of_count(count)) - count).abs() < 1e-10);
        }
        assert!((angle_of_count(0.0) - 35.0_f64.to_radians()).abs() < 1e-15);
    }
}
