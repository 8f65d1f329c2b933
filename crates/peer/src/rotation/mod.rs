//! Rotating rigid bodies: attitudes, their motion between ticks, and the torques between copies and devices.
//!
//! Body axes are the principal axes of the body, so an inertia is three numbers. A scene without an inertia uses nothing of this module.

mod algebra;
mod alignment;
mod attitude;
mod body;
mod held;
mod law;
mod real;
mod step;

pub use alignment::{aligning_torque, turning_torque};
pub use attitude::Attitude;
pub use body::{DeviceRotation, Rotation, RotationConfig, Torques};
pub(crate) use held::HeldAttitude;
pub use held::HeldAttitudes;
pub use real::Real;
pub use step::{RotationMethod, RotationStep, Spin};

/// Three numbers: a vector, or the principal moments of an inertia.
pub type Triple<N = f64> = [N; 3];
/// A matrix of three rows.
pub type Matrix3<N = f64> = [[N; 3]; 3];
