//! Relay of TCP between real programs: connections with a delay, a rate and faults, in real time, on Linux, macOS and Windows.
//!
//! Use this crate if your own program puts delays and faults between programs that speak TCP, on a system or in a place where packets cannot be had.
//!
//! The relay ends TCP on both sides: a client connects to the relay, and the relay to the program. So the relay sees bytes and no packets. The bytes pass a
//! line of [`cohaptic_wan`] with delay, jitter and rate, in order, in pieces of [`PIECE`] bytes. Nothing is lost, unless a fault such as `cut-after` says so. A
//! connection holds at most [`window`](cohaptic_linkfile::stream::StreamConfig::window) bytes in each direction; beyond that the relay does not read, and the
//! sender waits.
//!
//! [`Engine`] is the relay without sockets and without a clock. [`Streams`] adds both, on one thread.
//!
//! Read [`StreamsConfig`] first, then [`Streams::bind`].
//!
//! ```
//! use std::path::Path;
//!
//! use cohaptic_linkfile::TcpRelayFile;
//! use cohaptic_streams::{Engine, Event, Side};
//! use cohaptic_units::Instant;
//!
//! let text = r#"proxies = [{ name = "echo", listen = "127.0.0.1:7000", to = "127.0.0.1:9000", forth = { delay = "24ms" } }]"#;
//! let mut engine = Engine::new(TcpRelayFile::parse(text, Path::new("echo.toml"), &[])?.into());
//!
//! // A client connects and sends five bytes, which leave for the program after 24 ms.
//! let connection = engine.open(Instant::ZERO, 0);
//! engine.handle_bytes(Instant::ZERO, connection, Side::Client, b"hello");
//! let due = engine.poll_timeout().expect("bytes are on their way");
//! engine.handle_timeout(due);
//! assert_eq!((due.as_nanos(), engine.poll_event()), (24_000_000, Some(Event::Ready(connection, Side::Server))));
//! assert_eq!(engine.writable(connection, Side::Server), Some(&b"hello"[..]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod config;
mod engine;
mod run;

pub use config::{Proxy, StreamsConfig};
pub use engine::{Close, ConnectionId, Counts, Engine, Event, LineCounts, NoLine, PIECE, Side};
pub use run::{Control, LineReport, ProxyReport, Report, RunOptions, Streams, StreamsError, View};
