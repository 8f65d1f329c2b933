//! Programs in separate network namespaces, with traffic over emulated links, without root.
//!
//! Use this crate if your own program starts programs in any language on an emulated network. The crate needs Linux.
//!
//! ```text
//!   this program                              │ inside: user, network, mount and process namespaces of one host
//!   session: hosts, signals, statuses ◀───────┼─ channel ──▶ enter, then init (process 1), then the command
//!   emulation: Exchange, clock, devices ◀─────┼─ device ◀──▶ all packets of the command
//!   Gateway: sockets of the real machine      │
//! ```
//!
//! A [`Search`] runs a plan with many seeds, and finds the smallest set of lost packets with which the command fails.
//!
//! [`run`] runs a [`Plan`]: hosts with their commands, links between the hosts, and a [`Gateway`] to the real world. With [`Setup::loopback`], packets of a host
//! to itself pass links too. An [`Exchange`] is the network without a clock. The processes inside are the program itself, which must call [`run_inside`] first
//! of all.
//!
//! The crate prints nothing. Its library of links is `cohaptic-wan`, its devices are those of `cohaptic-router`, and its TCP is `cohaptic-tcp`.
//!
//! ```
//! use cohaptic_exec::{Exchange, Node};
//! use cohaptic_linkfile::link_from_keys;
//! use cohaptic_router::Packet;
//! use cohaptic_units::Instant;
//! use cohaptic_wan::NodeId;
//!
//! let link = link_from_keys(&["delay=24ms".to_owned()])?;
//! let node = |name: &str, address: &str| Node { name: name.to_owned(), addresses: vec![address.parse().expect("an address")] };
//! let mut exchange = Exchange::new(1, &[node("client", "10.0.0.1"), node("server", "10.0.0.2")], None, |_, _| link.clone());
//!
//! let packet = Packet::datagram("10.0.0.1:7".parse()?, "10.0.0.2:8".parse()?, b"hello").expect("one version of IP");
//! exchange.handle_packet(Instant::ZERO, NodeId(0), packet);
//! exchange.handle_timeout(exchange.poll_timeout().expect("the packet is on the way"));
//! let departure = exchange.poll_departure().expect("the packet has arrived");
//! assert_eq!((departure.at.as_nanos(), departure.record.path.to), (24_000_000, NodeId(1)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(not(target_os = "linux"))]
compile_error!("cohaptic-exec needs Linux: its namespaces and devices are those of Linux");

mod channel;
mod emulation;
mod exchange;
mod gateway;
mod host;
mod inside;
mod loopback;
mod lost;
mod name_server;
mod search;
mod session;
mod signals;

pub use exchange::{Counts, Departure, Exchange, Node};
pub use gateway::{DNS, GATEWAY, Gateway, NAMES, PREFIX, host};
pub use host::{Failed, Output};
pub use inside::{Setup, run as run_inside};
pub use lost::{LostPacket, LostPackets};
pub use name_server::name_server;
pub use search::{Case, Count, Found, Search, Step, Trial, Tried};
pub use session::{GatewayPlan, HostPlan, Line, LinkReport, Outcome, Plan, Report, Stream, capture_path, run};
