//! Jacobian of a device: from a change of position to a change of angles, and from a force to torques.

use super::linear::{dot, solve, transposed};
use super::{Triple, leg::Leg};

/// Jacobian dθ = J·dp at one position, with a row for each arm \[rad/m\].
///
/// The column of z is sin θ2·sin θ3/D. Existing drivers use sin² θ2 instead, which makes forces along z up to 37 % too strong, and adds sideways parts away
/// from the middle (libnifalcon, issue 66).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Jacobian {
    rows: [Triple; 3],
}

impl Jacobian {
    /// Returns the Jacobian at a position \[m\]. `None` where the grip cannot be, and at the edge of the workspace, where an arm has no influence on the
    /// grip.
    #[must_use]
    pub fn at(position: Triple) -> Option<Self> {
        let mut rows = [[0.0; 3]; 3];
        for (place, row) in rows.iter_mut().enumerate() {
            let leg = Leg::at(place, position);
            *row = leg.row(leg.arm_angle()?);
        }
        // At the edge of the workspace a division by zero gives an infinite entry.
        rows.iter().flatten().all(|entry| entry.is_finite()).then_some(Self { rows })
    }

    /// Returns the torques of the arms \[N·m\] that make a force \[N\]: τ = J⁻ᵀ·F. `None` for a singular Jacobian, and for a force that is not finite.
    #[must_use]
    pub fn torques(&self, force: Triple) -> Option<Triple> {
        let torques = solve(&transposed(&self.rows), force);
        // A singular Jacobian shows as torques that are not finite.
        torques.iter().all(|torque| torque.is_finite()).then_some(torques)
    }

    /// Returns the force \[N\] of the torques of the arms \[N·m\]: F = Jᵀ·τ.
    #[must_use]
    pub fn force(&self, torques: Triple) -> Triple {
        transposed(&self.rows).map(|column| dot(column, torques))
    }

    /// Returns the angular velocities of the arms \[rad/s\] at a velocity of the grip \[m/s\].
    #[must_use]
    pub(crate) fn turning(&self, velocity: Triple) -> Triple {
        self.rows.map(|row| dot(row, velocity))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::inverse;
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    #[test]
    fn torques_of_the_design_page() {
        let cases = [
            ([0.0, 0.0, 0.110], [0.015_487_698_043, -0.052_724_935_123, 0.037_237_237_080], [0.024_180_165_286; 3]),
            (
                [0.02, 0.0, 0.110],
                [0.016_963_470_270, -0.044_475_557_279, 0.041_839_293_291],
                [0.020_844_859_936, 0.033_815_259_898, 0.016_057_930_398],
            ),
            (
                [0.03, -0.03, 0.130],
                [0.017_156_326_167, -0.048_485_902_551, 0.043_076_205_197],
                [-0.002_861_463_544, 0.043_675_309_530, 0.026_949_143_442],
            ),
        ];
        for (position, sideways, out) in cases {
            let jacobian = Jacobian::at(position).unwrap();
            for (force, wanted) in [([1.0, 0.0, 0.0], sideways), ([0.0, 0.0, 1.0], out)] {
                let torques = jacobian.torques(force).unwrap();
                for (found, wanted) in torques.into_iter().zip(wanted) {
                    // The tolerance is half of the last printed digit.
                    assert!((found - wanted).abs() < 0.51e-12, "{position:?} {force:?}: {found} and {wanted}");
                }
                for (found, wanted) in jacobian.force(torques).into_iter().zip(force) {
                    assert!((found - wanted).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn the_squared_sine_of_existing_drivers_is_not_here() {
        // On the axis all rows have the same entry for z. One missing division by sin θ2 makes the force too strong by 1/sin θ2. The published sizes of the
        // error are 1.37 at z = 0.09, 1.29 at 0.125, and 1.13 at 0.16.
        for (z, gain) in [(0.09, 1.37), (0.11, 1.34), (0.125, 1.29), (0.14, 1.22), (0.16, 1.13)] {
            let position = [0.0, 0.0, z];
            let theta1 = inverse(position).unwrap()[0];
            // On the axis u + c is −r + c, and L follows from the constraint.
            let (along, out) = (-0.04 + 0.01443 - 0.06 * libm::cos(theta1), z - 0.06 * libm::sin(theta1));
            let sin_theta2 = out / libm::hypot(along, out);
            assert!((1.0 / sin_theta2 - gain).abs() < 0.006, "at {z}: {}", 1.0 / sin_theta2);
            let step = 1e-6;
            let moved = inverse([0.0, 0.0, z + step]).unwrap()[0] - inverse([0.0, 0.0, z - step]).unwrap()[0];
            assert!((Jacobian::at(position).unwrap().rows[0][2] - moved / (2.0 * step)).abs() < 1e-6);
        }
    }

    properties! {
        #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn rows_are_finite_differences(x in -0.04..0.04, y in -0.04..0.04, z in 0.09..0.16) {
            let jacobian = Jacobian::at([x, y, z]).unwrap();
            let step = 1e-5;
            for axis in 0..3 {
                let mut ends = [[x, y, z]; 2];
                ends[0][axis] -= step;
                ends[1][axis] += step;
                let [before, after] = ends.map(|end| inverse(end).unwrap());
                for leg in 0..3 {
                    let slope = (after[leg] - before[leg]) / (2.0 * step);
                    // The third derivative is below 1e6 rad/m³ here: step²·1e6/6 < 2e-5; rows are of 10 rad/m.
                    prop_assert!((jacobian.rows[leg][axis] - slope).abs() < 2e-5, "{} and {slope}", jacobian.rows[leg][axis]);
                }
            }
        }

        #[test]
        fn torques_and_forces_are_inverses(x in -0.04..0.04, y in -0.04..0.04, z in 0.09..0.16, force in [-10.0..10.0, -10.0..10.0, -10.0..10.0]) {
            let jacobian = Jacobian::at([x, y, z]).unwrap();
            let back = jacobian.force(jacobian.torques(force).unwrap());
            for axis in 0..3 {
                prop_assert!((back[axis] - force[axis]).abs() < 1e-10);
            }
        }
    }
}
