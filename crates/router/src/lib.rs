//! Router of any IP traffic through emulated links, in real time.
//!
//! Use this crate if your own program puts emulated links between hosts or interfaces. The router needs Linux.
//!
//! A [`Router`] stands between two devices. Either the devices are TUN devices, each an end of the network for its host, or both are Ethernet interfaces, which
//! the router joins like a cable. A packet from one device passes the link of the first matching rule and leaves at the other device, at the instant given by
//! the link. This instant is the packet's *logical* departure, so that lateness never accumulates. With the same seed, packets and instants, a link behaves as
//! in virtual time.
//!
//! ```text
//!   device ── Packet ──▶ Engine ── Departure ──▶ device        Engine: rules, links, counters; knows no clock
//!                          ▲                                   Router: the devices, the clock, lateness
//!                        instant
//! ```
//!
//! The router does not answer, fragment or route packets, and does not count hops: hosts see a wire. Frames without IP, such as ARP, cross at once. The crate
//! prints nothing.
//!
//! Read [`Engine`] first, then [`Router`]. The format of the configuration file is [`cohaptic_linkfile::router::RouterFile`].
//!
//! ```
//! use std::path::Path;
//!
//! use cohaptic_router::{Engine, Framing, Packet};
//! use cohaptic_linkfile::router::{RouterFile, Side};
//! use cohaptic_units::Instant;
//!
//! let text = r#"
//!     router = { default = "wan" }
//!     left   = { tun = "left0" }
//!     right  = { tun = "right0" }
//!     links  = { wan = { delay = "24ms" } }
//! "#;
//! let mut engine = Engine::new(&RouterFile::parse(text, Path::new("router.toml"), &[])?);
//!
//! // A packet of UDP from 10.0.0.1 to 10.0.0.2 that carries nothing.
//! let bytes = [[0x45, 0, 0, 28], [0, 0, 0, 0], [64, 17, 0x66, 0xcf], [10, 0, 0, 1], [10, 0, 0, 2], [0, 7, 0, 8], [0, 8, 0, 0]].concat();
//! engine.handle_packet(Instant::ZERO, Side::Left, Packet::new(bytes.clone(), Framing::Ip));
//!
//! let due = engine.poll_timeout().expect("the packet is on the way");
//! engine.handle_timeout(due);
//! let departure = engine.poll_departure().expect("it has arrived");
//! assert_eq!((departure.at.as_nanos(), departure.to), (24_000_000, Side::Right));
//! assert_eq!(departure.packet.bytes(), bytes);
//! # Ok::<(), cohaptic_linkfile::FileError>(())
//! ```

mod engine;
#[cfg(fuzzing)]
pub mod fuzzing;
mod packet;
mod rules;
mod run;
mod side;

pub use engine::{Count, Counters, Departure, Engine, LaneSnapshot, NoSuchLink, Received};
pub use packet::{Content, Ecn, Fragment, Framing, Headers, Join, Malformed, Packet, Unreachable};
pub use rules::{Decided, Rules};
pub use run::{Report, Router, RunError, Written};
pub use side::{AnyDevice, Device, Failed, Interface, OpenError, Sent, Tun, lead_all, lead_own};
