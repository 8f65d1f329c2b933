//! Driver, force limits, kinematics and simulator for the Novint Falcon, a haptic device with three axes.
//!
//! Use this crate if you drive a Novint Falcon from Rust, or test such a program without the device.
//!
//! ```text
//!                 device            a Falcon as the device of a session
//!                    │
//!        boot     driver            one exchange after the other
//!          │    ┌────┼────────┐
//!          │ safety  │    protocol  kinematics, calibration
//!          └────┬────┘
//!           transport               bytes, control transfers, a clock
//!          ┌────┴────┐
//!         usb    simulator
//! ```
//!
//! [`usb`] opens a real device, and [`simulator`] makes a simulated device with the same bytes. [`boot`] loads the user's firmware into either device.
//! [`driver::Driver`] exchanges packets and tracks homing and the position of the grip. [`device::FalconDevice`] runs a driver in a thread at 1 kHz and is a
//! [`Device`](cohaptic_device::Device) of a session.
//!
//! Only a [`safety::ForceGate`] makes motor counts, of the force that a [`Gate`](cohaptic_device::Gate) admits for each packet. The gate gives zero force before
//! the device is homed and the user has switched forces on, for numbers that are not finite, for old setpoints and old readings, and after a stop. The gate
//! limits size and rate of change of all other forces.
//!
//! No part of this crate was tried on hardware. All knowledge of the device comes from published drivers and captures, and every unknown is a parameter.
//!
//! ```
//! use std::time::Duration;
//!
//! use cohaptic_falcon::driver::{Driver, DriverConfig, Phase, Setpoint};
//! use cohaptic_falcon::simulator::{SimulatedTransport, Simulator, SimulatorConfig, Waypoints};
//!
//! let device = Simulator::new(SimulatorConfig { running: true, ..SimulatorConfig::default() }, Waypoints::homing(Duration::ZERO));
//! let mut driver = Driver::open(SimulatedTransport::in_virtual_time(device), DriverConfig::DEFAULT)?;
//! while driver.status().phase != Phase::Active {
//!     let at = driver.now();
//!     driver.exchange(Some(Setpoint { force: [0.0, 0.0, 0.5], at }))?;
//!     driver.sleep_until(at + Duration::from_millis(1));
//! }
//! // Three encoders were homed by the hand, and it pulled the grip out beyond 170 mm.
//! assert!(driver.status().reading.is_some_and(|reading| reading.position[2] > 0.170 - 0.125));
//! # Ok::<(), cohaptic_falcon::driver::DriverError>(())
//! ```
#![cfg_attr(test, allow(clippy::float_cmp, clippy::cast_precision_loss, reason = "tests compare exact values and count samples"))]

pub mod boot;
pub mod calibration;
mod clock;
pub mod device;
pub mod driver;
pub mod ftdi;
pub mod kinematics;
pub mod protocol;
pub mod safety;
pub mod simulator;
pub mod transport;
pub mod usb;

/// Runs the code of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
