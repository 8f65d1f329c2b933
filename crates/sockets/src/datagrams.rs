//! UDP sockets.

use std::fmt;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::task::{Context, Poll};

use crate::{Configured, Version};

/// Option of a UDP socket. Flags are 0 or 1.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DatagramOption {
    /// `SO_BROADCAST`, a flag.
    Broadcast,
    /// Time to live.
    Ttl,
    /// Type of service of IPv4.
    TypeOfService,
    /// Traffic class of IPv6.
    TrafficClass,
    /// Time to live of multicast over IPv4.
    MulticastTtl,
    /// Reception of the socket's own multicast over IPv4, a flag.
    MulticastLoop4,
    /// Reception of the socket's own multicast over IPv6, a flag.
    MulticastLoop6,
    /// Limit of hops of multicast over IPv6.
    MulticastHops,
    /// Interface for multicast over IPv4, as the 32 bits of its address; 0 if the host chooses.
    MulticastInterface4,
    /// Number of the interface for multicast over IPv6; 0 if the host chooses.
    MulticastInterface6,
}

/// Interface of a host, as programs name interfaces.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Interface {
    /// Address of IPv4; the unspecified address for any.
    Address(Ipv4Addr),
    /// Number of the interface; 0 for any.
    Number(u32),
}

/// Change of the membership in a multicast group.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Membership {
    /// Joins a multicast group.
    Join {
        /// Address of the group.
        group: IpAddr,
        /// Interface by which the group is joined.
        interface: Interface,
    },
    /// Leaves a multicast group.
    Leave {
        /// Address of the group.
        group: IpAddr,
        /// Interface by which the group was joined.
        interface: Interface,
    },
}

/// A received datagram.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Received<'a> {
    /// Content.
    pub bytes: &'a [u8],
    /// Address of the sender.
    pub from: SocketAddr,
    /// Address to which the datagram was sent.
    pub to: IpAddr,
    /// ECN codepoint on arrival, from 0 to 3 (RFC 3168, section 5).
    pub ecn: u8,
}

/// Properties of one sent datagram, beside its content.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct Sending {
    /// Address of the receiver; `None` for the peer of a connected socket.
    pub to: Option<SocketAddr>,
    /// Address of the sender, which must be an address of the host; `None` if the host chooses.
    pub from: Option<IpAddr>,
    /// ECN codepoint, from 0 to 3; 0 if the type of service of the socket decides.
    pub ecn: u8,
}

/// UDP socket.
///
/// [`Datagrams::poll_receive`] and [`Datagrams::poll_readable`] register the waker of the context with [`Poll::Pending`]; `try_receive` returns
/// [`io::ErrorKind::WouldBlock`] instead. Sending never waits. All methods fail after the host of the socket has crashed, after the run of the test bed, and on
/// every thread but the thread of the run.
#[expect(clippy::missing_errors_doc, reason = "the documentation of the trait names the errors of all methods")]
pub trait Datagrams: Configured + fmt::Debug + Send + Sync {
    /// Calls `take` with the next datagram. The datagram stays in the buffer if `peek` is set.
    fn poll_receive(&self, cx: &mut Context<'_>, peek: bool, take: &mut dyn FnMut(Received<'_>)) -> Poll<io::Result<()>>;
    /// Like [`Datagrams::poll_receive`], but does not wait.
    fn try_receive(&self, peek: bool, take: &mut dyn FnMut(Received<'_>)) -> io::Result<()>;
    /// Waits until a datagram or an error can be received.
    fn poll_readable(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>>;
    /// Returns whether a datagram or an error can be received.
    fn is_readable(&self) -> io::Result<bool>;
    /// Sends a datagram. Returns the number of bytes. Fails with `EINVAL` if the address of the sender is no address of the host.
    fn send_as(&self, bytes: &[u8], sending: Sending) -> io::Result<usize>;
    /// Sends a datagram to `to`, or to the peer if the socket is connected. Returns the number of bytes.
    fn send(&self, bytes: &[u8], to: Option<SocketAddr>) -> io::Result<usize> {
        self.send_as(bytes, Sending { to, ..Sending::default() })
    }
    /// Connects the socket to a peer.
    fn connect(&self, to: SocketAddr) -> io::Result<()>;
    /// Returns the socket's local address.
    fn local_addr(&self) -> io::Result<SocketAddr>;
    /// Returns the peer of a connected socket.
    fn peer_addr(&self) -> io::Result<SocketAddr>;
    /// Takes the pending error, with which the next call would fail.
    fn take_error(&self) -> io::Result<Option<io::Error>>;
    /// Returns the value of an option.
    fn option(&self, option: DatagramOption) -> io::Result<u32>;
    /// Sets the value of an option.
    fn set_option(&self, option: DatagramOption, value: u32) -> io::Result<()>;
    /// Selects the interface for multicast over a version of IP.
    fn select_interface(&self, version: Version, interface: Interface) -> io::Result<()>;
    /// Joins or leaves a multicast group.
    fn change_membership(&self, membership: Membership) -> io::Result<()>;
}
