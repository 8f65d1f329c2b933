//! Kinematics of the device: from arm angles to the position of the grip, and from forces at the grip to torques of the arms.
//!
//! The frame has z out of the device towards the user, y up, and x to the right as seen by the user. Its origin is the middle of the base. Arm angles are in
//! radians. The equations are those of R. E. Stamper's thesis (1997) for this kind of arm. The end pieces of a shin add the length `d + e` within the leg's
//! plane, so the points that a leg can reach form a torus and not a sphere. Three tori have no intersection in closed form, and [`forward`] solves the
//! constraints numerically.

mod forward;
mod geometry;
mod jacobian;
mod leg;
mod linear;
mod workspace;

pub use forward::{ForwardError, TOLERANCE, forward, forward_from};
pub use geometry::{angle_of_count, count_of_angle};
pub use jacobian::Jacobian;
pub use workspace::{ANGLE_LIMITS, is_usable};

use leg::Leg;

/// Three numbers, indexed by axis or by arm.
pub type Triple = [f64; 3];

/// Returns the angles of the arms \[rad\] with the grip at `position` \[m\]; `None` if the grip cannot be at this position.
///
/// Two angles of each arm reach a point. The result is the angle with the knee outside, as the device is built.
#[must_use]
pub fn inverse(position: Triple) -> Option<Triple> {
    let mut angles = [0.0; 3];
    for (place, angle) in angles.iter_mut().enumerate() {
        *angle = Leg::at(place, position).arm_angle()?;
    }
    Some(angles)
}

/// Returns the angles \[rad\] of encoder counts. The angles have a meaning only for a homed device.
#[must_use]
pub(crate) fn angles_of_counts(counts: [i16; 3]) -> Triple {
    counts.map(|count| angle_of_count(f64::from(count)))
}
