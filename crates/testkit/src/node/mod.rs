//! Programs without input and output of their own: state machines that are told the time, on emulated links.
//!
//! Many protocols are written so that they read no clock and open no socket: they are handed packets and instants, and asked what they want to send and when to be
//! woken (`quinn-proto`, `str0m`, `smoltcp`, many implementations of consensus). [`Nodes`] wires such state machines through a
//! [`cohaptic_wan::Network`], in virtual time, without tasks and without sockets. A packet costs some tens of nanoseconds more than its link.
//!
//! ```
//! use cohaptic_testkit::Instant;
//! use cohaptic_testkit::node::{Node, Nodes, Packet, Transmit};
//!
//! /// Sends one packet, and keeps when the answer came.
//! #[derive(Default)]
//! struct Ping { sent: bool, answered: Option<Instant> }
//!
//! impl Node for Ping {
//!     fn handle_packet(&mut self, now: Instant, _packet: Packet) {
//!         self.answered = Some(now);
//!     }
//!     fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
//!         (!std::mem::replace(&mut self.sent, true)).then(|| Transmit::to(1, "ping"))
//!     }
//! }
//!
//! /// Sends back what it gets.
//! #[derive(Default)]
//! struct Echo(Vec<Transmit>);
//!
//! impl Node for Echo {
//!     fn handle_packet(&mut self, _now: Instant, packet: Packet) {
//!         self.0.push(packet.answer(packet.bytes.clone()));
//!     }
//!     fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
//!         self.0.pop()
//!     }
//! }
//!
//! let mut run = Nodes::new().add("client", Ping::default()).add("server", Echo::default()).links("delay 24ms").start();
//! run.run_until_idle();
//! assert_eq!(run.node::<Ping>("client").answered, Some(Instant::from_nanos(48_000_000)));
//! ```

mod address;
mod builder;
mod deadlines;
mod faults;
mod hitting;
mod passing;
mod run;

use std::any::Any;
use std::net::SocketAddr;
use std::time::Instant as StdInstant;

use bytes::Bytes;
use cohaptic_units::Instant;

pub use address::{address, place_of};
pub use builder::Nodes;
pub use run::{NodeCounts, NodeRun};

/// A program as a state machine: it is handed packets and the time, and asked what it wants.
///
/// After every call of `handle_packet` and `handle_timeout`, and after the test has touched the node, [`Node::poll_transmit`] is asked until it has nothing more,
/// and then [`Node::poll_timeout`] once. Time never goes back.
pub trait Node: Any {
    /// A packet has arrived.
    fn handle_packet(&mut self, now: Instant, packet: Packet);

    /// The instant that [`Node::poll_timeout`] named has come. Afterwards it must name a later one, or none.
    fn handle_timeout(&mut self, _now: Instant) {}

    /// When the node wants to be woken; `None`, or the last instant there is: when a packet arrives. An instant that has passed is now.
    fn poll_timeout(&mut self) -> Option<Instant> {
        None
    }

    /// The next packet that the node wants to send now; `None` if there is none.
    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit>;
}

/// A packet as it arrives.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Packet {
    /// The sender: the address of a node, with the port that [`Transmit::from_port`] said.
    pub from: SocketAddr,
    /// The receiver: an address of the node that gets it.
    pub to: SocketAddr,
    /// What it carries. If the link damages packets, the damage is in it.
    pub bytes: Bytes,
    /// Whether an active queue marked it: congestion experienced (RFC 3168).
    pub marked: bool,
}

impl Packet {
    /// A packet back to the sender, from the port at which this one arrived.
    #[must_use]
    pub fn answer(&self, bytes: impl Into<Bytes>) -> Transmit {
        Transmit { to: self.from, from_port: self.to.port(), bytes: bytes.into(), ecn_capable: false }
    }

    /// The place of the node that sent it, from 0.
    #[must_use]
    pub fn from_place(&self) -> usize {
        // A packet that is handed to a node comes from one.
        place_of(self.from.ip()).unwrap_or(usize::MAX)
    }
}

/// A packet that a node sends.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Transmit {
    /// The receiver: see [`address()`]. A packet to an address that no node has is [counted](NodeCounts::unroutable), and lost.
    pub to: SocketAddr,
    /// The port from which it is sent. The receiver sees it; otherwise it means nothing.
    pub from_port: u16,
    /// What it carries.
    pub bytes: Bytes,
    /// Whether both ends understand explicit congestion notification: then an active queue marks it where it would drop another.
    pub ecn_capable: bool,
}

impl Transmit {
    /// A packet to the node at that place, from 0, between ports 0.
    #[must_use]
    pub fn to(place: usize, bytes: impl Into<Bytes>) -> Self {
        Self { to: address(place, 0), from_port: 0, bytes: bytes.into(), ecn_capable: false }
    }
}

/// The time of a run for libraries that want [`std::time::Instant`]: the instant that stands for the run's beginning. Which one it is does not matter, as long as
/// all nodes take the same.
///
/// ```
/// use cohaptic_testkit::{Instant, node::Epoch};
///
/// let epoch = Epoch(std::time::Instant::now());
/// let deadline = epoch.to_std(Instant::from_nanos(1_500_000_000));
/// assert_eq!(epoch.from_std(deadline), Instant::from_nanos(1_500_000_000));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Epoch(pub StdInstant);

impl Epoch {
    /// The instant in the clock of the system.
    ///
    /// # Panics
    ///
    /// If the system's clock does not reach so far.
    #[must_use]
    pub fn to_std(self, at: Instant) -> StdInstant {
        self.0 + at.saturating_duration_since(Instant::ZERO)
    }

    /// The instant in the time of the run; its beginning if it was before.
    #[must_use]
    pub fn from_std(self, at: StdInstant) -> Instant {
        Instant::ZERO.saturating_add(at.saturating_duration_since(self.0))
    }
}
