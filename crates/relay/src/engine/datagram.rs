//! Arrivals, departures, and the counters of both.

use core::time::Duration;
use std::net::SocketAddr;

use cohaptic_realtime::udp::Ecn;
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

/// Where a datagram comes in or goes out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Port {
    /// The port that stands for this program of a mesh.
    Program(NodeId),
    /// Where clients of a proxy send to.
    Listen,
    /// The port of its own that the client in this place has on the far side.
    Client(u32),
}

/// A datagram that came in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Arrival<'a> {
    /// When.
    pub at: Instant,
    /// Where.
    pub port: Port,
    /// The sender.
    pub from: SocketAddr,
    /// What it carries. Its length is its size on the link: headers are not counted, and [`cohaptic_wan::Framing`] can add them.
    pub bytes: &'a [u8],
    /// Its congestion bits.
    pub ecn: Option<Ecn>,
}

/// What happened to a datagram that came in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Intake {
    /// It was offered to its link.
    Offered,
    /// The same, and its sender is a new client: the port [`Port::Client`] with this number is needed from now on.
    FromNewClient(u32),
    /// Too much is on its way: it was dropped.
    Overload,
    /// Nobody knows the sender: it was dropped.
    Stranger,
    /// A program spoke to itself, and there is no such link: it was dropped.
    ToItself,
    /// There are as many clients as there may be: it was dropped.
    NoRoom,
}

/// A datagram that leaves.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Release<'a> {
    /// When, by the link.
    pub at: Instant,
    /// By how much it was offered to the link later than it came: see [`IntakeCounts::clamped`].
    pub late: Duration,
    /// From where.
    pub port: Port,
    /// The receiver.
    pub to: SocketAddr,
    /// What it carries, damaged if the link has damaged it.
    pub bytes: &'a [u8],
    /// Its congestion bits: with a mark if the link has marked it.
    pub ecn: Option<Ecn>,
}

/// What a relay counts of a link besides what the link counts itself.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LinkCounts {
    /// Dropped before they were offered: too much was on its way.
    pub overload: u64,
    /// Came out of the link and were dropped: where their receiver is is not known yet, or it has left.
    pub undeliverable: u64,
    /// The bytes of all that came out of the link.
    pub delivered_bytes: u64,
}

/// What came in.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct IntakeCounts {
    /// Offered to a link.
    pub offered: u64,
    /// Dropped: too much was on its way.
    pub overload: u64,
    /// Dropped: nobody knows the sender.
    pub strangers: u64,
    /// Dropped: a program spoke to itself.
    pub to_itself: u64,
    /// Dropped: no room for another client.
    pub no_room: u64,
    /// Offered, but at a later instant than the one at which they came, because time had been let pass beyond that.
    pub clamped: u64,
}
