//! Rigid bodies that turn: attitudes, how they move between ticks, and the torques that tie them to devices and to other copies.
//!
//! Body axes are the principal axes of the body, so an inertia is three numbers. A scene without an inertia has none of this.

mod algebra;
mod alignment;
mod attitude;
mod body;
mod held;
mod law;
mod real;
mod step;

pub use alignment::{aligning_torque, in_body_axes, lever, reaction, turning_torque};
pub use attitude::{Attitude, NORM_TOLERANCE, point_of};
pub use body::{DeviceRotation, Rotation, RotationConfig, Torques};
pub(crate) use held::HeldAttitude;
pub use held::HeldAttitudes;
pub use real::{Real, half_turns};
pub use step::{RotationMethod, RotationStep, Spin};

/// Three numbers: a vector, or the principal moments of an inertia.
pub type Triple<N = f64> = [N; 3];
/// A matrix of three rows.
pub type Matrix3<N = f64> = [[N; 3]; 3];
