//! UDP between programs through the emulator, in real time.
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

mod config;
mod engine;
mod run;

pub use config::{Change, ConfigError, Form, Limits, Mesh, Program, Proxy, RelayConfig};
pub use engine::{Arrival, Engine, Intake, IntakeCounts, LinkCounts, Port, Release};
pub use run::{Control, LinkReport, PortReport, Relay, RelayError, Report, RunOptions, View};
