//! The names of `tokio::net`: `use cohaptic_testkit::net` in place of `use tokio::net` makes a program run here.
//!
//! There are no Unix sockets and no named pipes.

use std::io;
use std::net::SocketAddr;

pub use crate::{TcpListener, TcpSocket, TcpStream, ToSocketAddrs, UdpSocket};

#[cfg(feature = "tokio")]
pub mod tcp {
    //! Halves of streams.

    pub use crate::tcp::{OwnedReadHalf, OwnedWriteHalf, ReadHalf, ReuniteError, WriteHalf};
}

/// Looks up the address of a host.
///
/// # Errors
///
/// As [`ToSocketAddrs::to_socket_addr`].
#[expect(clippy::unused_async, reason = "as tokio's")]
pub async fn lookup_host(host: impl ToSocketAddrs) -> io::Result<impl Iterator<Item = SocketAddr>> {
    Ok(std::iter::once(host.to_socket_addr()?))
}
