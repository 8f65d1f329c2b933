//! Usable workspace of the grip.

use core::f64::consts::PI;

use super::{Jacobian, Triple, inverse};

/// Least and greatest usable angle of an arm \[rad\]: −25° and 90°.
pub const ANGLE_LIMITS: [f64; 2] = [-25.0 * PI / 180.0, PI / 2.0];

/// Returns whether the grip can be at a position \[m\] with every arm within [`ANGLE_LIMITS`] and able to push.
///
/// Around the axis the usable radius is 92 mm at z = 0.10 m, 80 mm at 0.125, 61 mm at 0.15 and 33 mm at 0.17.
#[must_use]
pub fn is_usable(position: Triple) -> bool {
    let [lowest, highest] = ANGLE_LIMITS;
    inverse(position).is_some_and(|angles| angles.iter().all(|angle| (lowest..=highest).contains(angle))) && Jacobian::at(position).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the radius up to which every direction is usable, in whole millimetres.
    fn radius(z: f64) -> u32 {
        let round = |millimetres: u32| {
            (0..360).all(|degree| {
                let (angle, radius) = (f64::from(degree) * PI / 180.0, f64::from(millimetres) / 1000.0);
                is_usable([radius * libm::cos(angle), radius * libm::sin(angle), z])
            })
        };
        // The first radius that fails ends the count, even if a larger radius were usable again.
        (0..150).take_while(|millimetres| round(*millimetres)).last().unwrap_or(0)
    }

    #[test]
    fn the_radii_of_the_design_page() {
        for (z, millimetres) in [(0.10, 92), (0.125, 80), (0.15, 61), (0.16, 49), (0.17, 33), (0.175, 23)] {
            assert!(radius(z).abs_diff(millimetres) <= 1, "{z}: {}", radius(z));
        }
    }

    #[test]
    fn nothing_is_usable_far_away_or_without_a_place() {
        for place in [[0.0, 0.0, 0.3], [0.2, 0.0, 0.12], [f64::NAN, 0.0, 0.12], [0.0, 0.0, f64::INFINITY]] {
            assert!(!is_usable(place));
        }
    }
}
