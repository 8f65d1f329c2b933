//! The Novint Falcon, a haptic device with three axes: how to talk to it, where its grip is, how to push without hurting anybody, and one that is not there.
//!
//! You need it if you drive a Novint Falcon from Rust, or test such a program without the device.
//!
//! ```text
//!                 device            a Falcon as the device of a peer
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
//! [`usb`] opens a real device, [`simulator`] makes one that speaks the same bytes; [`boot`] gets the user's firmware into either. [`driver::Driver`] exchanges
//! packets and knows whether the device is homed and where its grip is; [`device::FalconDevice`] does so in a thread at 1 kHz and is a
//! [`Device`](cohaptic_peer::Device) of a peer.
//!
//! Safe by construction: only a [`safety::ForceGate`] makes motor counts. It lets nothing through before the device is homed and the user has switched forces
//! on, nothing that is no number, nothing old, nothing too large or too sudden, and nothing after a stop.
//!
//! Nothing here was ever tried on hardware. All knowledge of the device comes from published drivers and captures; every unknown is a parameter.
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
