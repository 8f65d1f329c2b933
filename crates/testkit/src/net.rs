//! The names of `tokio::net`. A program runs on a test bed with `use cohaptic_testkit::net` in place of `use tokio::net`.
//!
//! Unix sockets and named pipes are missing.

use std::io;
use std::net::SocketAddr;

use crate::context::Call;

pub use crate::{TcpListener, TcpSocket, TcpStream, ToSocketAddrs, UdpSocket};

#[cfg(feature = "tokio")]
pub mod tcp {
    //! Halves of streams.

    pub use crate::tcp::owned::{OwnedReadHalf, OwnedWriteHalf, ReuniteError};
    pub use crate::tcp::split::{ReadHalf, WriteHalf};
}

/// Returns the addresses of a host.
///
/// # Errors
///
/// As [`ToSocketAddrs::to_socket_addrs`].
///
/// # Panics
///
/// Outside of a running test bed.
#[track_caller]
pub fn lookup_host(host: impl ToSocketAddrs) -> impl Future<Output = io::Result<impl Iterator<Item = SocketAddr>>> {
    let _ = Call::here("lookup_host");
    async move { Ok(host.to_socket_addrs()?.into_iter()) }
}
