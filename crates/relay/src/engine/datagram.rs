//! Datagrams at the border of the engine: arrivals, releases, and the counters of both.

use core::time::Duration;
use std::net::SocketAddr;

use cohaptic_realtime::udp::Ecn;
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

/// Port of the relay, for arriving and for leaving datagrams.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Port {
    /// Port standing for this program of a mesh.
    Program(NodeId),
    /// Port of a proxy for clients.
    Listen,
    /// Port towards the server of the client in this slot of a proxy.
    Client(u32),
}

/// Datagram arrived at a port of the relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Arrival<'a> {
    /// Instant of the arrival.
    pub at: Instant,
    /// Port of the relay that received the datagram.
    pub port: Port,
    /// Address of the sender.
    pub from: SocketAddr,
    /// Payload. The length of the payload is the datagram's size on the link: headers are not counted, and [`cohaptic_wan::Framing`] can add them.
    pub bytes: &'a [u8],
    /// Congestion bits (ECN) of the IP header; `None` if both bits are zero.
    pub ecn: Option<Ecn>,
}

/// Result of the intake of one datagram.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Intake {
    /// The datagram was admitted, and the link gets the datagram now or later.
    Offered,
    /// The sender is a new client, and the port [`Port::Client`] with this number is needed from now on. The datagram was offered to its link, or dropped and
    /// counted as overload.
    FromNewClient(u32),
    /// The datagram was dropped: too many datagrams or bytes are in flight.
    Overload,
    /// The datagram was dropped: the relay does not know the sender's address, or has no such port.
    Stranger,
    /// The datagram was dropped: a program sent to the port standing for the same program, and no such link exists.
    ToItself,
    /// The datagram was dropped: the proxy has as many clients as allowed.
    NoRoom,
}

/// Datagram leaving the relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Release<'a> {
    /// Instant of the delivery by the link.
    pub at: Instant,
    /// Time from the arrival of the datagram to the offer to the link: see [`IntakeCounts::clamped`].
    pub late: Duration,
    /// Port of the relay through which to send the datagram.
    pub port: Port,
    /// Address of the receiver.
    pub to: SocketAddr,
    /// Payload, with the bit errors of the link if the link has damaged the datagram.
    pub bytes: &'a [u8],
    /// Congestion bits (ECN); [`Ecn::Ce`] if the link has marked the datagram.
    pub ecn: Option<Ecn>,
}

/// Counters of one link, kept by the relay in addition to [`LinkStats`](cohaptic_wan::LinkStats).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LinkCounts {
    /// Datagrams dropped before the link: too many datagrams or bytes were in flight.
    pub overload: u64,
    /// Datagrams delivered by the link and then dropped: the receiver's address is not known yet, or the receiving client has left.
    pub undeliverable: u64,
    /// Payload bytes of all datagrams delivered by the link.
    pub delivered_bytes: u64,
}

/// Counters of arrived datagrams, by result.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct IntakeCounts {
    /// Datagrams offered to a link.
    pub offered: u64,
    /// Datagrams dropped: too many datagrams or bytes were in flight.
    pub overload: u64,
    /// Datagrams dropped: the relay does not know the sender's address, or has no such port.
    pub strangers: u64,
    /// Datagrams dropped: a program sent to the port standing for the same program.
    pub to_itself: u64,
    /// Datagrams dropped: no room for another client.
    pub no_room: u64,
    /// Datagrams offered after the instant of arrival, because logical time had already passed the arrival. Part of `offered`.
    pub clamped: u64,
}
