//! Tests of networked programs over emulated bad links, in virtual time, the same way every time.
//!
//! A [`Testbed`] is hosts and the [links](cohaptic_wan) between them. A program that is run on it has [UDP sockets](UdpSocket) with the methods of tokio's,
//! [timers](time), and hosts that crash, come back, and lose sight of each other. Nothing waits in real time: the clock jumps to the next event.
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "tests"))]

mod address;
mod artefacts;
mod bed;
mod context;
mod core;
mod file;
mod host;
mod link;
pub mod node;
#[cfg(feature = "quinn")]
pub mod quinn;
mod record;
mod runtime;
#[cfg(feature = "scenes")]
mod scenes;
mod seed;
mod socket;
#[cfg(feature = "strategies")]
pub mod strategies;
mod task;
pub mod time;
mod trace;
mod words;

pub use address::{AddressPlan, Addresses, ToSocketAddrs};
pub use artefacts::{ARTEFACTS_VARIABLE, WriteError};
pub use bed::{Bed, Testbed};
pub use cohaptic_units as units;
pub use cohaptic_units::Instant;
pub use cohaptic_wan as wan;
pub use file::{LinkFile, LinkFileError};
pub use host::Host;
pub use link::ToLink;
#[cfg(feature = "strategies")]
pub use proptest;
pub use record::Record;
#[cfg(feature = "scenes")]
pub use scenes::{check_scene, check_scenes};
pub use seed::SEED_VARIABLE;
pub use socket::UdpSocket;
pub use task::{JoinHandle, TaskStopped};
pub use trace::{Difference, Happening, Lost, PacketName, Trace, TraceEvent};
pub use words::WordsError;
