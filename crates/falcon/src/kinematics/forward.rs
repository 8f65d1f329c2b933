//! Forward kinematics: from the angles of the arms to the position of the grip.

use thiserror::Error;

use super::leg::Leg;
use super::linear::{norm, solve};
use super::{Triple, inverse};

/// Greatest length of the last step of the search \[m\].
pub const TOLERANCE: f64 = 1e-12;

/// Greatest number of Newton steps from one start. From a good start three to six steps are enough.
const STEPS: usize = 20;
/// Greatest length of a step of the search \[m\]. From far away an unlimited first step would lead to a point behind the device.
const LONGEST_STEP: f64 = 0.02;
/// Greatest difference \[rad\] between the given angles and the inverse kinematics of the found position. The limit separates the branches of solutions, and
/// is no measure of precision.
const SAME_BRANCH: f64 = 1e-6;
/// Number of pieces of the way from the angles of [`START`] to the given angles.
const PIECES: u32 = 24;
/// Start of the search without a better position \[m\].
const START: Triple = [0.0, 0.0, 0.11];

/// Error of angles without a position. The angles do not belong to an intact device, or lie at the edge of its workspace.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
#[error("no position of the grip has the arms at {angles:?} rad: are the encoders homed?")]
pub struct ForwardError {
    /// The given angles \[rad\].
    pub angles: Triple,
}

/// Returns the position \[m\] of the grip with the arms at `angles` \[rad\].
///
/// # Errors
///
/// [`ForwardError`] if the angles have no position.
pub fn forward(angles: Triple) -> Result<Triple, ForwardError> {
    forward_from(angles, START)
}

/// Like [`forward`], but starts the search at `last`, the last known position \[m\]. A close start shortens the search, and the result is the same within
/// [`TOLERANCE`].
///
/// The search is Newton's method on the three constraints. If it fails from `last`, it starts again at the middle, and follows the angles in small pieces.
///
/// # Errors
///
/// [`ForwardError`] if the angles have no position. The function never returns an older position instead.
pub fn forward_from(angles: Triple, last: Triple) -> Result<Triple, ForwardError> {
    newton(angles, last).or_else(|| along_the_way(angles)).ok_or(ForwardError { angles })
}

/// Solves the three constraints by Newton's method; `None` without convergence or on a wrong branch.
fn newton(angles: Triple, start: Triple) -> Option<Triple> {
    let mut position = start;
    for _ in 0..STEPS {
        let mut values = [0.0; 3];
        let mut slopes = [[0.0; 3]; 3];
        for (place, angle) in angles.into_iter().enumerate() {
            (values[place], slopes[place]) = Leg::at(place, position).constraint(angle);
        }
        let mut step = solve(&slopes, values);
        let length = norm(step);
        // A singular matrix gives a step that is not finite.
        if !length.is_finite() {
            return None;
        }
        if length > LONGEST_STEP {
            // Shortened, the step keeps its direction.
            step = step.map(|part| part * (LONGEST_STEP / length));
        }
        position = core::array::from_fn(|axis| position[axis] - step[axis]);
        // The convergence is checked before the branch, because the branch has a meaning only at a solution.
        if length < TOLERANCE {
            return is_branch(position, angles).then_some(position);
        }
    }
    None
}

/// Returns whether a solution is the branch of the device: other solutions lie behind the device or have a knee inside.
fn is_branch(position: Triple, angles: Triple) -> bool {
    inverse(position).is_some_and(|there| there.iter().zip(angles).all(|(there, angle)| (there - angle).abs() < SAME_BRANCH))
}

/// Solves from the middle in small pieces of the angles, each from the position of the piece before.
fn along_the_way(angles: Triple) -> Option<Triple> {
    // Each piece starts close to its solution, where Newton's method converges on the same branch.
    let from = inverse(START)?;
    let mut position = START;
    for piece in 1..=PIECES {
        let part = f64::from(piece) / f64::from(PIECES);
        position = newton(core::array::from_fn(|arm| from[arm] + part * (angles[arm] - from[arm])), position)?;
    }
    Some(position)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::{angle_of_count, count_of_angle, is_usable};
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    fn distance(a: Triple, b: Triple) -> f64 {
        norm(core::array::from_fn(|axis| a[axis] - b[axis]))
    }

    #[test]
    fn positions_of_the_design_page() {
        let cases = [
            ([0.0, 0.0, 0.110], [0.282_533_201_336; 3], [-516.322_657_066; 3]),
            ([0.02, 0.0, 0.110], [0.387_430_715_449, 0.066_383_488_366, 0.477_562_506_984], [-351.364_757_362, -856.231_595_566, -209.626_879_644]),
            ([0.03, -0.03, 0.130], [1.022_202_082_248, 0.283_681_202_315, 0.688_753_206_241], [646.852_906_280, -514.517_353_748, 122.483_699_726]),
        ];
        for (position, angles, counts) in cases {
            let found = inverse(position).unwrap();
            for arm in 0..3 {
                assert!((found[arm] - angles[arm]).abs() < 0.51e-12, "{} and {}", found[arm], angles[arm]);
                // Nine digits are printed. The angle has twelve digits, and a radian is 1573 counts.
                assert!((count_of_angle(found[arm]) - counts[arm]).abs() < 0.51e-9 + 1e-11, "{} and {}", count_of_angle(found[arm]), counts[arm]);
            }
            assert!(distance(forward(found).unwrap(), position) < 1e-12);
        }
    }

    #[test]
    fn counts_on_the_axis() {
        for (z, count) in [(0.080, -1284.5), (0.100, -740.8), (0.125, -200.1), (0.150, 336.0), (0.170, 871.6), (0.180, 1308.7)] {
            for angle in inverse([0.0, 0.0, z]).unwrap() {
                assert!((count_of_angle(angle) - count).abs() < 0.0501, "{z}: {}", count_of_angle(angle));
            }
        }
        // All encoders at zero.
        assert!(distance(forward([angle_of_count(0.0); 3]).unwrap(), [0.0, 0.0, 0.134_602]) < 0.51e-6);
    }

    #[test]
    fn every_place_of_the_workspace_is_found_again() {
        let mut places = 0;
        for i in -23..=23 {
            for j in -23..=23 {
                for k in 0..=24 {
                    let place = [f64::from(i) * 0.004, f64::from(j) * 0.004, 0.085 + f64::from(k) * 0.004];
                    if is_usable(place) {
                        places += 1;
                        let found = forward(inverse(place).unwrap()).unwrap_or_else(|error| panic!("{place:?}: {error}"));
                        assert!(distance(found, place) < 1e-9, "{place:?}: {found:?}");
                    }
                }
            }
        }
        // The workspace is about 1.3 dm³, and a cell of the grid 0.064 cm³.
        assert!(places > 10_000, "{places}");
    }

    #[test]
    fn what_cannot_be_is_an_error() {
        for angles in [[f64::NAN; 3], [f64::INFINITY, 0.0, 0.0], [3.0, -3.0, 3.0]] {
            let error = forward_from(angles, [0.0, 0.0, 0.12]).unwrap_err();
            assert_eq!(error.angles.map(f64::to_bits), angles.map(f64::to_bits));
        }
    }

    properties! {
        #![proptest_config(ProptestConfig { cases: 3000, max_global_rejects: 30_000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn the_way_back_is_exact_from_any_start(
            place in [-0.09..0.09, -0.09..0.09, 0.085..0.18],
            start in [-0.09..0.09, -0.09..0.09, 0.085..0.18],
        ) {
            prop_assume!(is_usable(place));
            let found = forward_from(inverse(place).unwrap(), start).unwrap();
            prop_assert!(distance(found, place) < 1e-9, "{place:?} from {start:?}: {found:?}");
        }

        #[test]
        fn any_counts_give_a_position_or_an_error(counts in any::<[i16; 3]>()) {
            let angles = crate::kinematics::angles_of_counts(counts);
            if let Ok(position) = forward(angles) {
                prop_assert!(is_branch(position, angles));
            }
        }
    }
}
