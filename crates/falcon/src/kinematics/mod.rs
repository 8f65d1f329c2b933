//! Where the grip is when the arms stand so, and what torque makes a force there.
//!
//! The frame has z out of the device towards the user, y up and x to the right as the user sees it; its origin is the middle of the base. Arm angles are in radians.
//! The equations are those of R. E. Stamper's thesis (1997) for this kind of arm. Its ends of the shins lie `d + e` away from each other, so the points that a
//! leg can reach form a torus and not a sphere: three spheres cannot be intersected in closed form, and [`forward`] solves the constraint itself.

mod forward;
mod geometry;
mod jacobian;
mod leg;
mod linear;
mod workspace;

pub use forward::{ForwardError, TOLERANCE, forward, forward_from};
pub use geometry::{AZIMUTHS, COUNTS_PER_TURN, DEGREES_PER_COUNT, HOME_ANGLE, angle_of_count, count_of_angle};
pub use jacobian::Jacobian;
pub use workspace::{ANGLE_LIMITS, is_usable};

use leg::Leg;

/// Three numbers, one for each axis or each arm.
pub type Triple = [f64; 3];

/// The angles of the arms \[rad\] with the grip at `position` \[m\]; `None` if it cannot be there.
///
/// Two angles of each arm reach a point. This is the one with the knee outside, which is how the device is built.
#[must_use]
pub fn inverse(position: Triple) -> Option<Triple> {
    let mut angles = [0.0; 3];
    for (place, angle) in angles.iter_mut().enumerate() {
        *angle = Leg::at(place, position).arm_angle()?;
    }
    Some(angles)
}

/// The angles \[rad\] that encoder counts stand for. They have a meaning only for a device that is homed.
#[must_use]
pub fn angles_of_counts(counts: [i16; 3]) -> Triple {
    counts.map(|count| angle_of_count(f64::from(count)))
}
