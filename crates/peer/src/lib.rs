//! One participant of a networked haptic cooperation: device, copy of the shared object, coordination law, and wire format of samples.
//!
//! Use this crate if you simulate a peer in your own program, add a coordination law, or connect a device. The crate has no sockets and no clock: the caller
//! transports datagrams and passes instants.
//!
//! ```text
//!   hand ──Fh──► device ──FC──► copy of the object ──FT──► coordination ◄── samples of the other peers
//!                (mH, bH)  KC, BC     (mO, bO)      KT, BT
//! ```
//!
//! The model is that of Rakhsha & Constantinescu (2015), equations (7) to (10). A [`Peer`] owns a [`Device`], its copy of the shared virtual object, and a
//! coordination [`Strategy`]. Other crates can implement both traits. The documentation of [`Peer`] lists the steps of a tick in their order.
//!
//! Symbols of the paper appear only in the functions that compute its equations:
//!
//! | symbol | here | unit |
//! | --- | --- | --- |
//! | mH, bH | mass and damping of [`DeviceConfig`] | kg, N·s/m |
//! | KC, BC | stiffness and damping of the coupling [`Gains`] | N/m, N·s/m |
//! | KT, BT | stiffness and damping of the coordination [`Gains`] | N/m, N·s/m |
//! | mOi, bO | mass and damping of [`CopyConfig`] | kg, N·s/m |
//! | Fh, FC, FT | hand, coupling and coordination force | N |
//!
//! Positions, velocities and forces are arrays `[f64; A]` over the A = 1, 2 or 3 translational axes.
//! ```
//! use std::time::Duration;
//!
//! use cohaptic_peer::{
//!     Clock, Command, Contact, Context, CopyConfig, Exchange, Gains, Held, Integrator, ObjectCopy, Peer, PeerConfig, RestingDevice, State, Strategy,
//! };
//! use cohaptic_units::Instant;
//!
//! /// A spring between the own copy and the mean of the others.
//! struct Spring {
//!     stiffness: f64,
//! }
//!
//! impl Strategy<1> for Spring {
//!     fn command(&mut self, context: &Context<'_, 1>) -> Command<1> {
//!         let target = *context.held.mean();
//!         Command { force: [self.stiffness * (context.own.position[0] - target.position[0])], target }
//!     }
//!
//!     fn set_gains(&mut self, gains: Gains) {
//!         self.stiffness = gains.stiffness;
//!     }
//! }
//!
//! let tick = Duration::from_millis(1);
//! let config = PeerConfig {
//!     session: 1,
//!     place: 0,
//!     axes: 1,
//!     contact: Contact::Grasp,
//!     coupling: Gains { stiffness: 3500.0, damping: 5.0 },
//!     tick,
//!     compute_delay: false,
//!     exchange: Exchange::EACH_TICK,
//!     own_damping: 0.0,
//!     enclosure: None,
//! };
//! // A copy at rest at 0, and another peer whose copy is 10 mm away.
//! let object = ObjectCopy::new(CopyConfig { mass: 0.45, damping: 0.0 }, State::REST, Integrator::Exact, &Clock::regular(tick));
//! let other = State { position: [0.01], velocity: [0.0] };
//! let held = Held::new([State::REST, other]);
//! let mut peer = Peer::new(config, RestingDevice { position: [0.0] }, object, Spring { stiffness: 1000.0 }, held);
//! peer.compute(Instant::ZERO);
//! peer.advance(Instant::ZERO, tick);
//! assert!(peer.object().state().position[0] > 0.0, "the copy moves towards the other one");
//! ```
#![cfg_attr(not(test), no_std)]
#![cfg_attr(test, allow(clippy::float_cmp, clippy::cast_precision_loss, reason = "tests compare exact values and count samples"))]

extern crate alloc;

mod age;
mod clock;
mod config;
pub mod coordination;
mod device;
mod enclosure;
mod exact_means;
mod exact_sum;
mod exchange;
mod gains;
mod held;
mod increments;
mod lead;
mod motion;
mod number;
mod object;
pub mod operator;
mod peer;
mod plant;
pub mod rotation;
mod sample_kind;
mod send_when;
mod signal;
mod state;
mod stepper;
pub mod tick;
pub mod wire;

pub use age::{Age, Ages};
pub use clock::{Clock, Drift, DriftError};
pub use config::{ArmConfig, Contact, CopyConfig, DeviceConfig, Direction, Hand};
pub use coordination::registry::Coordination;
pub use coordination::strategy::{Command, Context, Strategy};
pub use device::{Device, HandForce, RestingDevice, SimulatedDevice};
pub use enclosure::Enclosure;
pub use exact_means::ExactMeans;
pub use exchange::{Exchange, Exchanged};
pub use gains::Gains;
pub use held::{EXACT_FROM, Held};
pub use lead::{Lead, Moving};
pub use motion::Motion;
pub use number::Number;
pub use object::ObjectCopy;
pub use peer::{Acting, Forces, Peer, PeerConfig, ReceiveError, Reception};
pub use plant::{Integrator, Plant, StepMap};
pub use send_when::{LastSent, SendWhen};
pub use signal::{Signal, Table, TableError};
pub use state::State;

/// Runs the code of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
