//! Client and simulated service over WebSockets of this machine, each in a thread with the wall clock.
//!
//! [`Inverse3`] drives a [`Client`](crate::client::Client), [`ServiceThread`] a [`Service`](crate::service::Service). Addresses other than those of this
//! machine are refused: over a network, a lost segment of TCP delays all later replies by 200 ms and more. A device at another computer joins a session by a
//! program there.

mod device;
mod serving;
mod wire;

use std::io;
use std::net::SocketAddr;

use thiserror::Error;

pub use device::{Facts, Inverse3, Summary};
pub use serving::ServiceThread;

/// Address of Haply's service: port 10001 of this machine.
pub const SERVICE: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 10001);

/// Distance from the port of the service to the port of its events, which are 10001 and 10020 at Haply's service.
const EVENTS: u16 = 19;

/// Returns the address of the events of a service; `None` if no port is left above the port of the service.
#[must_use]
pub fn events_of(service: SocketAddr) -> Option<SocketAddr> {
    Some(SocketAddr::new(service.ip(), service.port().checked_add(EVENTS)?))
}

/// Error of the start of a thread.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StartError {
    /// The address belongs to another machine.
    #[error("{0} is not an address of this machine: a device at another computer joins a session there")]
    Remote(SocketAddr),
    /// A number of the configuration is out of range.
    #[error(transparent)]
    Config(#[from] crate::client::ClientConfigError),
    /// No socket could be opened at this address.
    #[error("no socket at {0}: {1}")]
    Listen(SocketAddr, io::Error),
    /// No thread could be started.
    #[error("no thread for the device: {0}")]
    Thread(io::Error),
}

/// Refuses an address of another machine.
fn local(address: SocketAddr) -> Result<SocketAddr, StartError> {
    if address.ip().is_loopback() { Ok(address) } else { Err(StartError::Remote(address)) }
}

#[cfg(test)]
mod tests;
