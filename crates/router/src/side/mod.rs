//! The two ends of the router: devices that give packets and take them.

mod interface;
mod namespace;
mod netlink;
mod tun;

use std::io;
use std::os::fd::BorrowedFd;
use std::sync::Arc;

use cohaptic_linkfile::router::{Attachment, Side};

use crate::packet::Packet;
pub use interface::Interface;
pub use tun::Tun;

/// A device that gives packets and takes them, and never makes its caller wait.
pub trait Device {
    /// What becomes readable when there is a packet.
    fn readable(&self) -> BorrowedFd<'_>;

    /// Reads once, and appends the packet that came, or the packets of the segment that came; says whether anything did.
    ///
    /// # Errors
    ///
    /// What the system says: the device gives no more packets.
    fn receive(&mut self, packets: &mut Vec<Packet>) -> io::Result<bool>;

    /// Hands over the first of these packets, with as many of the following ones as go with it. Says how many, at least one, and what became of them.
    fn send(&mut self, packets: &[Arc<Packet>]) -> (usize, Sent);
}

/// No packet of IP is longer; and what stands before it.
const LONGEST: usize = (1 << 16) + 64;

/// What became of a packet that was handed to a device.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Sent {
    /// The device has it.
    Sent,
    /// The device had no room.
    Full,
    /// It is longer than the device takes.
    TooLong,
    /// The device refused it for another reason, such as being down.
    Refused,
}

impl Sent {
    /// What the system said of a write.
    fn of(written: io::Result<usize>) -> Self {
        // Linux's names for numbers that `ErrorKind` does not tell apart.
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

/// Either kind of device.
#[derive(Debug)]
pub enum AnyDevice {
    /// A TUN device.
    Tun(Tun),
    /// An interface that was there.
    Interface(Interface),
}

impl AnyDevice {
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
    /// [`OpenError`] with what was tried and what the system says, and if both sides are one device, whatever its namespace is called: each packet would
    /// come back again and again.
    pub(crate) fn open_both(left: &Attachment, right: &Attachment) -> Result<[Self; 2], OpenError> {
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

/// A side could not be opened.
#[derive(Debug, thiserror::Error)]
#[error("{}, device {device}: {failed}", side.name())]
pub struct OpenError {
    /// Which.
    pub side: Side,
    /// Its device.
    pub device: String,
    /// Why.
    #[source]
    pub failed: Failed,
}

impl OpenError {
    fn of(side: Side, attachment: &Attachment, failed: Failed) -> Self {
        Self { side, device: attachment.device().to_owned(), failed }
    }
}

/// Why a device could not be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Failed {
    /// Both sides name it.
    #[error("it is the device of the other side, in the same network namespace: expected two devices")]
    SameDevice,
    /// The system refused something.
    #[error("cannot {what}: {source}{}", way_out(source))]
    System {
        /// What was tried.
        what: String,
        /// What the system says.
        source: io::Error,
    },
    /// A device that should be there is not.
    #[error("there is no such device in {namespace}: expected one that is there; without `existing = true` a tun is made")]
    NoDevice {
        /// Where it was looked for.
        namespace: String,
    },
    /// An interface that does not carry Ethernet.
    #[error("it does not carry Ethernet (type {kind}): expected an Ethernet or a veth interface, or a tun")]
    NotEthernet {
        /// The type as Linux numbers it, `ARPHRD_…`.
        kind: u16,
    },
}

impl Failed {
    fn system(what: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        |source| Self::System { what: what.into(), source }
    }
}

/// What most refusals need.
fn way_out(error: &io::Error) -> &'static str {
    if error.kind() == io::ErrorKind::PermissionDenied {
        ": it takes root, CAP_NET_ADMIN (and CAP_NET_RAW for an interface), or namespaces of your own: `unshare --map-root-user --net`"
    } else {
        ""
    }
}
