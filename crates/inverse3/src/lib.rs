//! Client of Haply's Inverse Service for the Inverse3, a haptic device with three axes, and a simulated service.
//!
//! Use this crate if you drive an Inverse3 from Rust, or test a program that speaks to Haply's Inverse Service without device and service.
//!
//! ```text
//!      socket       stepped           a device by the wall clock │ a device in virtual time
//!         └────┬──────┘ │
//!           client    service         one device of a service │ a simulated service with faults
//!              └────┬────┘
//!                protocol             messages as text
//! ```
//!
//! [`client::Client`] and [`service::Service`] are state machines: texts and instants go in, texts come out. The module `socket` (Linux) drives both over
//! WebSockets of this machine, each in a thread of its own. [`stepped::SteppedInverse3`] joins both in virtual time. Both are a
//! [`Device`](cohaptic_device::Device) of a session.
//!
//! Forces pass a [`Gate`](cohaptic_device::Gate) in the client, which gives zero before the user has held the cursor at the origin, and whenever device, axes
//! or replies are in doubt. `docs/inverse3.md` has the rules.
//!
//! No part of this crate was tried on hardware. Messages follow Haply's documentation 3.5 and the crate `haply` 1.3.1; every unknown is a parameter.
//!
//! ```
//! use std::time::Duration;
//!
//! use cohaptic_device::{Device as _, Gate, Limits, Moment};
//! use cohaptic_inverse3::client::{ClientConfig, Phase};
//! use cohaptic_inverse3::service::{Service, ServiceConfig, SwayingHand};
//! use cohaptic_inverse3::stepped::SteppedInverse3;
//! use cohaptic_units::Instant;
//!
//! // The hand holds the cursor at the origin for a second, and then sways along x.
//! let hand = SwayingHand { amplitude: [0.03, 0.0, 0.0], frequency: 0.5 };
//! let mut device = SteppedInverse3::new(Service::new(ServiceConfig::default(), hand), ClientConfig::DEFAULT)?;
//! let mut gate = Gate::new(Limits::DEFAULT, device.stopper())?;
//! let tick = Duration::from_millis(1);
//! for count in 0..1500 {
//!     let now = Instant::ZERO + tick * count;
//!     // A spring of 50 N/m to the origin. There is no reading before the device is armed.
//!     let reading = device.read(now);
//!     let force = reading.map_or([0.0; 3], |reading| reading.position.map(|part| -50.0 * part));
//!     let at = reading.map(|_| now);
//!     let admitted = gate.admit(force, &Moment { now, ready: at.is_some(), armed: at.is_some(), reading_at: at, setpoint_at: at });
//!     device.hold(now, tick, admitted.force);
//! }
//! assert_eq!(device.snapshot().phase, Phase::Active);
//! assert!(device.snapshot().force[0] < -0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact values"))]

mod axes;
pub mod client;
pub mod protocol;
pub mod service;
#[cfg(target_os = "linux")]
pub mod socket;
pub mod stepped;

pub use axes::{Triple, to_haply, to_scene};

/// Runs the code of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
