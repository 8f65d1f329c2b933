//! Sockets. In a test bed all sockets belong to the test bed.

pub use real::net::*;

mod addr;

pub use addr::ToSocketAddrs;

#[cfg(feature = "net")]
mod bed_socket;
#[cfg(feature = "net")]
mod bytes;
#[cfg(feature = "net")]
mod descriptors;
#[cfg(feature = "net")]
mod halves;
#[cfg(feature = "net")]
mod listener;
#[cfg(feature = "net")]
mod lookup;
#[cfg(feature = "net")]
mod ready;
#[cfg(feature = "net")]
mod socket;
#[cfg(feature = "net")]
mod stream;
#[cfg(feature = "net")]
pub mod tcp;
#[cfg(feature = "net")]
mod udp;
#[cfg(all(feature = "net", unix))]
pub mod unix;

#[cfg(all(feature = "net", unix))]
pub use unix::{UnixDatagram, UnixListener, UnixSocket, UnixStream};
#[cfg(feature = "net")]
pub use {listener::TcpListener, lookup::lookup_host, socket::TcpSocket, stream::TcpStream, udp::UdpSocket};

/// Calls a method of the real socket, or of the socket of the test bed.
#[cfg(feature = "net")]
macro_rules! either {
    ($either:expr, |$socket:ident| $real:expr, $bed:expr) => {
        match $either {
            $crate::net::Either::Real($socket) => $real,
            $crate::net::Either::Bed($socket) => $bed,
        }
    };
    ($either:expr, |$socket:ident| $same:expr) => {
        match $either {
            $crate::net::Either::Real($socket) => $same,
            $crate::net::Either::Bed($socket) => $same,
        }
    };
}
#[cfg(feature = "net")]
use either;

/// A real socket, or a socket of a test bed.
#[cfg(feature = "net")]
enum Either<R, B> {
    Real(R),
    Bed(B),
}

#[cfg(feature = "net")]
impl<R: std::fmt::Debug, B: std::fmt::Debug> std::fmt::Debug for Either<R, B> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        either!(self, |socket| socket.fmt(f))
    }
}

/// Returns the error of a socket of a test bed that is to be bound to a device.
#[cfg(all(feature = "net", any(target_os = "android", target_os = "fuchsia", target_os = "linux")))]
fn no_devices() -> std::io::Error {
    std::io::Error::new(std::io::ErrorKind::Unsupported, "a test bed has no network devices; bind to an address of the host")
}

/// Returns the test bed in which the present thread makes a socket, or `None` if the socket is real.
///
/// # Errors
///
/// On a thread that works for a host of a test bed: the sockets of a test bed belong to the thread of the run. Under `Runtime::enter`, if the environment asks
/// for a loopback: the test bed runs within `block_on` only, and the runtime has no real sockets.
#[cfg(feature = "net")]
fn bed() -> std::io::Result<Option<std::sync::Arc<dyn cohaptic_sockets::Bed>>> {
    let bed = cohaptic_sockets::bed();
    if bed.is_some() {
        return Ok(bed);
    }
    let refused = |text| Err(std::io::Error::new(std::io::ErrorKind::Unsupported, text));
    if cohaptic_sockets::host().is_some() {
        return refused(
            "a function of `spawn_blocking` makes a socket: the sockets of a test bed belong to the thread that runs it. Make the socket in a task",
        );
    }
    #[cfg(feature = "rt")]
    if real::runtime::Handle::try_current().is_ok() && loopback::loopback::Loopback::of_environment().is_some() {
        return refused(
            "a socket is made outside of `block_on`: the loopback of COHAPTIC_TEST_LOOPBACK exists within `block_on`. Make the socket there",
        );
    }
    Ok(None)
}
