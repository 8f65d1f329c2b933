//! Relay of UDP datagrams between real programs, through emulated links, in real time.
//!
//! Use this crate if your own program puts emulated links between programs that speak UDP. The relay needs Linux.
//!
//! A program does not send to another program directly, but to the port of the relay standing for the other program. The datagram passes the directed link
//! between the two programs in the emulator of [`cohaptic_wan`], and leaves the relay when the link delivers the datagram.
//!
//! ```text
//!   mesh    a ──▶ port of b ══ link a->b ══▶ b, from the port of a        (N programs, N ports)
//!           a ◀── port of b ◀══ link b->a ══ b, to the port of a
//!
//!   proxy   client ──▶ listen ══ forth ══▶ a port of the client's own ──▶ to
//!           client ◀── listen ◀══ back ════ the same port            ◀── to
//! ```
//!
//! [`Engine`] is the relay without sockets and without a clock: datagrams go in at instants and come out at instants, and the fates of datagrams equal the
//! fates in virtual time. [`Relay`] adds sockets and a clock. Time is *logical*: a datagram arrives when the kernel sees the datagram, and leaves at the
//! instant given by the link. The time from that instant until the program sends the datagram is the *release error*, which is recorded and does not
//! accumulate.
//!
//! Memory is bounded. When too many datagrams or bytes are in flight, arriving datagrams are dropped and counted as overload. Datagrams of unknown senders are
//! dropped and counted.
//!
//! Read [`RelayConfig`] first, then [`Relay::bind`].
//!
//! ```
//! use std::net::SocketAddr;
//! use std::sync::Arc;
//!
//! use cohaptic_linkfile::{LinkTable, link_from_keys};
//! use cohaptic_relay::{Arrival, Engine, Form, Limits, Mesh, Port, Program, RelayConfig};
//! use cohaptic_units::Instant;
//! use cohaptic_wan::NodeId;
//!
//! // Two programs, each with a port of the relay, and 24 ms both ways.
//! let address = |port: u16| SocketAddr::from(([127, 0, 0, 1], port));
//! let program = |name: &str, n: u16| Program { name: name.to_owned(), port: address(7000 + n), address: Some(address(9000 + n)) };
//! let link = Arc::new(link_from_keys(&["delay=24ms".to_owned()])?);
//! let mesh = Mesh { programs: vec![program("left", 0), program("right", 1)], links: LinkTable::new(2, link, []) };
//! let mut engine = Engine::new(RelayConfig { seed: 1, form: Form::Mesh(mesh), limits: Limits::default(), changes: vec![] })?;
//!
//! // A datagram from the left program to the port that stands for the right program.
//! engine.handle_datagram(Arrival { at: Instant::ZERO, port: Port::Program(NodeId(1)), from: address(9000), bytes: b"a sample", ecn: None });
//! let due = engine.poll_timeout().expect("it is in flight");
//! engine.handle_timeout(due);
//! let release = engine.poll_release().expect("it leaves");
//! assert_eq!((release.at.as_nanos(), release.to, &release.bytes[..]), (24_000_000, address(9001), &b"a sample"[..]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod config;
mod engine;
mod run;

pub use config::{Change, ConfigError, Form, Limits, Mesh, Program, Proxy, RelayConfig};
pub use engine::{Arrival, Engine, Intake, IntakeCounts, LinkCounts, Port, Release};
pub use run::{Control, LinkReport, PortReport, Relay, RelayError, Report, RunOptions, View};
