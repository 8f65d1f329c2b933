//! TCP: the configuration and the state of connections.
//!
//! [`TcpListener`], [`TcpStream`] and [`TcpSocket`](crate::TcpSocket) have the methods of tokio's types, on a real TCP ([`cohaptic_tcp`]). The segments are
//! packets on the emulated links. A packet of TCP counts on its link with the whole length, headers of IP and TCP included; a UDP datagram counts with the
//! content only. The module [`net`](crate::net) has the names of `tokio::net`, so that a program runs here after changing one import.

#[cfg(feature = "facade")]
mod facade;
pub(crate) mod listener;
mod options;
#[cfg(feature = "tokio")]
pub(crate) mod owned;
mod readiness;
pub(crate) mod socket;
#[cfg(feature = "tokio")]
pub(crate) mod split;
pub(crate) mod stream;
#[cfg(feature = "tokio")]
mod traits;

use std::net::SocketAddr;

/// Name of these sockets in messages.
const KIND: &str = "a TCP socket";

pub use cohaptic_tcp::{CaState, ConfigError, CongestionControl, EcnFallback, Flags, Info, Keepalive, Segment, State, TcpConfig};
pub(crate) use listener::TcpListener;
pub(crate) use stream::TcpStream;

/// State of one end of a connection: see [`Bed::connections`](crate::Bed::connections).
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct ConnectionInfo {
    /// Name of the host.
    pub host: String,
    /// Address of this end.
    pub local: SocketAddr,
    /// Address of the other end.
    pub peer: SocketAddr,
    /// Figures of the connection, such as round trips and retransmissions.
    pub info: Info,
}
