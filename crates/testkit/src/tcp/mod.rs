//! TCP: halves of streams, and what connections are made of.
//!
//! [`TcpListener`], [`TcpStream`] and [`TcpSocket`] have the methods of tokio's on a real TCP
//! ([`cohaptic_tcp`]), whose segments are packets on the emulated links. On its link a packet counts with its whole length, headers of IP and TCP included; a datagram
//! of UDP counts with what it carries. The module [`net`](crate::net) has the names of `tokio::net`, so that one changed import makes a program run here.

mod listener;
mod options;
#[cfg(feature = "tokio")]
mod owned;
mod readiness;
mod socket;
#[cfg(feature = "tokio")]
mod split;
mod stream;
#[cfg(feature = "tokio")]
mod traits;

use std::net::SocketAddr;

/// Name of these sockets in messages.
const KIND: &str = "a TCP socket";

pub use cohaptic_tcp::{ConfigError, CongestionControl, EcnFallback, Flags, Info, Keepalive, State, TcpConfig};
#[cfg(feature = "tokio")]
pub use owned::{OwnedReadHalf, OwnedWriteHalf, ReuniteError};
#[cfg(feature = "tokio")]
pub use split::{ReadHalf, WriteHalf};

pub use listener::TcpListener;
pub use socket::TcpSocket;
pub use stream::TcpStream;

/// One end of a connection: see [`Bed::connections`](crate::Bed::connections).
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct ConnectionInfo {
    /// The host.
    pub host: String,
    /// The address of this end.
    pub local: SocketAddr,
    /// The address of the other end.
    pub peer: SocketAddr,
    /// Figures.
    pub info: Info,
}
