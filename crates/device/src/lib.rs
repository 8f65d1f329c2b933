//! Contract of haptic devices: reading a position, holding a force, stopping, and the gate that every force passes.
//!
//! Use this crate if you write a driver of a haptic device in Rust, for sessions of `cohaptic-live` or for a program of your own.
//!
//! A driver implements [`Device`]. Forces reach the driver as [`GatedForce`]s, which only a [`Gate`] makes. The first line that applies decides:
//!
//! | force | if |
//! | --- | --- |
//! | zero for good | the device was [stopped](Stopper) |
//! | zero at once | the device is not ready or not armed; the reading, then the setpoint is too old; the loop has paused; a number is not finite |
//! | limited in size and in change, from zero after zero | otherwise |
//!
//! Every loop that sends forces has a gate on its own clock. The loop of a session computes the wanted force, asks its gate, and calls [`Device::hold`]. The
//! thread of a driver, which exchanges packets with the device, asks a second gate for each packet. If the session dies, the thread's gate finds the setpoint
//! too old. If the thread dies, no packet leaves, and the drop of the driver stops the device.
//!
//! The crate knows no scene, no peer, no device and no clock. Read [`Device`] first.
//!
//! ```
//! use std::time::Duration;
//!
//! use cohaptic_device::{Gate, Limits, Moment, Stopper, Verdict, ZeroCause};
//! use cohaptic_units::Instant;
//!
//! let mut gate = Gate::new(Limits { force: 3.0, ..Limits::DEFAULT }, Stopper::default())?;
//! let mut force = |millis, armed| {
//!     let now = Instant::ZERO + Duration::from_millis(millis);
//!     gate.admit([8.0, 0.0, 0.0], &Moment { now, ready: true, armed, reading_at: Some(now), setpoint_at: Some(now) })
//! };
//! // 8 N were asked for: 3 N are allowed, and 1000 N/s on the way there.
//! assert_eq!([0, 1, 2, 3, 4].map(|millis| force(millis, true).force.newtons()[0]), [0.0, 1.0, 2.0, 3.0, 3.0]);
//! // A user who lets go feels no force at once.
//! assert_eq!(force(5, false).verdict, Verdict::Zero(ZeroCause::NotArmed));
//! # Ok::<(), cohaptic_device::LimitsError>(())
//! ```
#![cfg_attr(test, allow(clippy::float_cmp, clippy::unwrap_used, clippy::panic, reason = "tests compare exact values and count samples"))]

mod contract;
mod dice;
mod force;
mod gate;
mod limits;
mod mailbox;
mod stopper;

pub use contract::{Description, Device, Reading};
pub use dice::Dice;
pub use force::GatedForce;
pub use gate::{Admitted, Changes, Gate, Moment, Verdict, ZeroCause};
pub use limits::{Limits, LimitsError};
pub use mailbox::Mailbox;
pub use stopper::Stopper;

#[cfg(test)]
mod tests;

/// Runs the code of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
