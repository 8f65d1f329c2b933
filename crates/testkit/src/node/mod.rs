//! State machines without input and output of their own, on emulated links in virtual time.
//!
//! Many protocols are written so that they read no clock and open no socket: the caller hands packets and instants in, and asks for packets to send and for the
//! next deadline (`quinn-proto`, `str0m`, `smoltcp`, many implementations of consensus). [`Nodes`] connects such state machines through a
//! [`cohaptic_wan::Network`], in virtual time, without tasks and without sockets.
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
use cohaptic_units::{Ecn, Instant};

pub use address::{address, place_of};
pub use builder::Nodes;
pub use run::{NodeCounts, NodeRun};

/// Program as a state machine, which is handed packets and the time, and asked for packets to send and for its next deadline.
///
/// After every call of `handle_packet` and `handle_timeout`, and after the test has touched the node, [`Node::poll_transmit`] is called until it returns
/// `None`, and then [`Node::poll_timeout`] once. Time never goes back.
pub trait Node: Any {
    /// Handles a packet that has arrived.
    fn handle_packet(&mut self, now: Instant, packet: Packet);

    /// Handles the instant that [`Node::poll_timeout`] has named. Afterwards `poll_timeout` must name a later instant, or none.
    fn handle_timeout(&mut self, _now: Instant) {}

    /// Returns the instant at which the node wants to be woken. `None`, like [`Instant::MAX`], stands for "when a packet arrives". An instant that has passed
    /// counts as the present instant.
    fn poll_timeout(&mut self) -> Option<Instant> {
        None
    }

    /// Returns the next packet to send now, or `None` if the node has nothing to send.
    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit>;
}

/// Packet that has arrived at a node.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Packet {
    /// Sender: the address of a node, with the port given by [`Transmit::from_port`].
    pub from: SocketAddr,
    /// Receiver: an address of the node that gets the packet.
    pub to: SocketAddr,
    /// Content of the packet, with the damage done by the link, if any.
    pub bytes: Bytes,
    /// `true` if an active queue has marked the packet: congestion experienced (RFC 3168).
    pub marked: bool,
}

impl Packet {
    /// Returns a packet back to the sender, from the port at which this packet arrived.
    #[must_use]
    pub fn answer(&self, bytes: impl Into<Bytes>) -> Transmit {
        Transmit { to: self.from, from_port: self.to.port(), bytes: bytes.into(), ecn: Ecn::NotCapable }
    }

    /// Returns the index of the sending node, from 0.
    #[must_use]
    pub fn from_place(&self) -> usize {
        // Every packet that is handed to a node comes from a node.
        place_of(self.from.ip()).unwrap_or(usize::MAX)
    }
}

/// Packet that a node sends.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Transmit {
    /// Receiver: see [`address()`]. A packet to an address that no node has is [counted](NodeCounts::unroutable), and lost.
    pub to: SocketAddr,
    /// Port from which the packet is sent. The receiver sees the port; the port has no further effect.
    pub from_port: u16,
    /// Content of the packet.
    pub bytes: Bytes,
    /// ECN codepoint of the packet. An active queue marks a capable packet in place of dropping it.
    pub ecn: Ecn,
}

impl Transmit {
    /// Returns a packet to the node with the index `place`, from 0. Both ports are 0.
    #[must_use]
    pub fn to(place: usize, bytes: impl Into<Bytes>) -> Self {
        Self { to: address(place, 0), from_port: 0, bytes: bytes.into(), ecn: Ecn::NotCapable }
    }
}

/// Conversion between the time of a run and [`std::time::Instant`], for libraries that need the latter. The field is the instant that stands for the beginning
/// of the run. Any instant will do, as long as all nodes use the same one.
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
    /// Converts an instant of the run to the clock of the system.
    ///
    /// # Panics
    ///
    /// If the clock of the system does not reach that far.
    #[must_use]
    pub fn to_std(self, at: Instant) -> StdInstant {
        self.0 + at.saturating_duration_since(Instant::ZERO)
    }

    /// Converts an instant of the system's clock to the time of the run. An instant before the beginning of the run becomes the beginning.
    #[must_use]
    pub fn from_std(self, at: StdInstant) -> Instant {
        Instant::ZERO.saturating_add(at.saturating_duration_since(self.0))
    }
}
