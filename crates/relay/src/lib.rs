//! UDP between programs through the emulator, in real time.
//!
//! Use this crate if your own program puts emulated links between programs that speak UDP. It needs Linux.
//!
//! Programs that know nothing of each other's place send to a port of the relay, which stands for the program that they speak to. What they send passes the
//! directed link between the two, in the emulator of [`cohaptic_wan`], and leaves when the link lets it go.
//!
//! ```text
//!   mesh    a ──▶ port of b ══ link a->b ══▶ b, from the port of a        (N programs, N ports)
//!           a ◀── port of b ◀══ link b->a ══ b, to the port of a
//!
//!   proxy   client ──▶ listen ══ forth ══▶ a port of the client's own ──▶ to
//!           client ◀── listen ◀══ back ════ the same port            ◀── to
//! ```
//!
//! [`Engine`] is the relay without sockets and without a clock: datagrams in at instants, datagrams out at instants, so that its fates are those of virtual
//! time. [`Relay`] gives it both. Time is *logical*: a datagram came in when the kernel saw it, and leaves when the link says; how much later than that the
//! program got round to sending it is the *release error*, which is recorded and does not add up.
//!
//! Memory is bounded: beyond a number of datagrams or bytes on their way, arrivals are dropped and counted as overload; strangers are dropped and counted.
//!
//! Read [`RelayConfig`] first, then [`Relay::bind`].
//! ```
//! use std::net::SocketAddr;
//! use std::sync::Arc;
//!
//! use cohaptic_linkfile::{LinkTable, link_from_keys};
//! use cohaptic_relay::{Arrival, Engine, Form, Limits, Mesh, Port, Program, RelayConfig};
//! use cohaptic_units::Instant;
//! use cohaptic_wan::NodeId;
//!
//! // Two programs, each with a port that stands for it, and 24 ms both ways.
//! let address = |port: u16| SocketAddr::from(([127, 0, 0, 1], port));
//! let program = |name: &str, n: u16| Program { name: name.to_owned(), port: address(7000 + n), address: Some(address(9000 + n)) };
//! let link = Arc::new(link_from_keys(&["delay=24ms".to_owned()])?);
//! let mesh = Mesh { programs: vec![program("left", 0), program("right", 1)], links: LinkTable::new(2, link, []) };
//! let mut engine = Engine::new(RelayConfig { seed: 1, form: Form::Mesh(mesh), limits: Limits::default(), changes: vec![] })?;
//!
//! // A datagram from the left program to the port that stands for the right one.
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
