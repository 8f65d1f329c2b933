//! The two sides of the router: devices from which packets are read and to which packets are written.

mod interface;
mod namespace;
mod netlink;
mod routes;
mod tun;

use std::io;
use std::os::fd::BorrowedFd;
use std::sync::Arc;

use cohaptic_linkfile::router::{Attachment, Side};

use crate::packet::Packet;
pub use interface::Interface;
pub use routes::{lead_all, lead_own};
pub use tun::Tun;

/// Device that gives and takes packets without ever blocking.
pub trait Device {
    /// Returns a file descriptor, readable when a packet waits.
    fn readable(&self) -> BorrowedFd<'_>;

    /// Reads once, and appends the packet, or the packets of a segment, to `packets`. Returns whether anything was read.
    ///
    /// # Errors
    ///
    /// The error of the system. The device gives no more packets.
    fn receive(&mut self, packets: &mut Vec<Packet>) -> io::Result<bool>;

    /// Hands over the first packet, together with as many following packets as go in the same call. Returns the number of packets handed over (at least 1) and
    /// the common fate.
    fn send(&mut self, packets: &[Arc<Packet>]) -> (usize, Sent);
}

/// Bytes of one reading, at most: the longest IP packet, and the headers before the packet.
const LONGEST: usize = (1 << 16) + 64;

/// Fate of a packet handed to a device.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Sent {
    /// The device took the packet.
    Sent,
    /// The device had no room.
    Full,
    /// The packet is longer than the device takes.
    TooLong,
    /// The device refused the packet for another reason, such as being down.
    Refused,
}

impl Sent {
    /// Returns the fate in the result of a write.
    fn of(written: io::Result<usize>) -> Self {
        // Error numbers of Linux that `ErrorKind` does not tell apart.
        const NO_BUFFER_SPACE: i32 = nix::errno::Errno::ENOBUFS as i32;
        const MESSAGE_TOO_LONG: i32 = nix::errno::Errno::EMSGSIZE as i32;
        match written {
            Ok(_) => Self::Sent,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Self::Full,
            Err(error) => match error.raw_os_error() {
                Some(NO_BUFFER_SPACE) => Self::Full,
                Some(MESSAGE_TOO_LONG) => Self::TooLong,
                _ => Self::Refused,
            },
        }
    }
}

/// Device of either kind.
#[derive(Debug)]
pub enum AnyDevice {
    /// TUN device.
    Tun(Tun),
    /// Existing interface.
    Interface(Interface),
}

impl AnyDevice {
    /// Opens the device of a side, inside the network namespace of the device.
    fn open(side: Side, attachment: &Attachment) -> Result<Self, OpenError> {
        let opened = namespace::within(attachment.namespace(), || match attachment {
            Attachment::Tun(tun) => Tun::open(tun).map(Self::Tun),
            Attachment::Interface(interface) => Interface::open(interface).map(Self::Interface),
        });
        opened.map_err(|failed| OpenError::of(side, attachment, failed))
    }

    /// Opens the devices of both sides, left and right.
    ///
    /// # Errors
    ///
    /// [`OpenError`] with the failed step and the error of the system, or if both sides are one device, even under different names of one namespace. Each
    /// packet would then come back again and again.
    pub(crate) fn open_both(left: &Attachment, right: &Attachment) -> Result<[Self; 2], OpenError> {
        // Namespaces are compared only if the device names are equal, because comparing opens files.
        if left.device() == right.device() {
            let failed = match namespace::are_one(left.namespace(), right.namespace()) {
                Ok(true) => Some(Failed::SameDevice),
                Ok(false) => None,
                Err(failed) => Some(failed),
            };
            failed.map_or(Ok(()), |failed| Err(OpenError::of(Side::Right, right, failed)))?;
        }
        Ok([Self::open(Side::Left, left)?, Self::open(Side::Right, right)?])
    }
}

impl Device for AnyDevice {
    fn readable(&self) -> BorrowedFd<'_> {
        match self {
            Self::Tun(tun) => tun.readable(),
            Self::Interface(interface) => interface.readable(),
        }
    }

    fn receive(&mut self, packets: &mut Vec<Packet>) -> io::Result<bool> {
        match self {
            Self::Tun(tun) => tun.receive(packets),
            Self::Interface(interface) => interface.receive(packets),
        }
    }

    fn send(&mut self, packets: &[Arc<Packet>]) -> (usize, Sent) {
        match self {
            Self::Tun(tun) => tun.send(packets),
            Self::Interface(interface) => interface.send(packets),
        }
    }
}

/// Failure to open the device of a side.
#[derive(Debug, thiserror::Error)]
#[error("{}, device {device}: {failed}", side.name())]
pub struct OpenError {
    /// Side of the device.
    pub side: Side,
    /// Name of the device.
    pub device: String,
    /// Reason of the failure.
    #[source]
    pub failed: Failed,
}

impl OpenError {
    fn of(side: Side, attachment: &Attachment, failed: Failed) -> Self {
        Self { side, device: attachment.device().to_owned(), failed }
    }
}

/// Reason why a device could not be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Failed {
    /// Both sides name the same device.
    #[error("it is the device of the other side, in the same network namespace: expected two devices")]
    SameDevice,
    /// The system refused a step.
    #[error("cannot {what}: {source}{}", way_out(source))]
    System {
        /// Failed step.
        what: String,
        /// Error of the system.
        source: io::Error,
    },
    /// A device that should exist does not exist.
    #[error("there is no such device in {namespace}: expected one that is there; without `existing = true` a tun is made")]
    NoDevice {
        /// Namespace in which the device was looked for.
        namespace: String,
    },
    /// The interface does not carry Ethernet.
    #[error("it does not carry Ethernet (type {kind}): expected an Ethernet or a veth interface, or a tun")]
    NotEthernet {
        /// Type of the interface as numbered by Linux, `ARPHRD_…`.
        kind: u16,
    },
}

impl Failed {
    /// Returns a function that turns an error of the system into the failure of the step `what`.
    fn system(what: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        |source| Self::System { what: what.into(), source }
    }
}

/// Returns the permission that most refused steps need, for the message.
fn way_out(error: &io::Error) -> &'static str {
    if error.kind() == io::ErrorKind::PermissionDenied {
        ": this needs root, CAP_NET_ADMIN (and CAP_NET_RAW for an interface), or namespaces of your own: `unshare --map-root-user --net`"
    } else {
        ""
    }
}
