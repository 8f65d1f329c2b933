//! Peer of a session at another computer, with a device at that computer: the remote side of a peer of kind `udp`.
//!
//! [`JoinedPeer`] is the peer as a state machine without sockets and clocks. [`Join`] drives the state machine by the wall clock over a socket,
//! with a report at the end.

mod device;
mod drift;
mod driver;
mod engine;
mod fitness;
mod heard;
mod others;
mod recording;
mod seat;

pub use drift::{ClockDrift, DRIFT_WINDOW};
pub use driver::{Join, JoinConfig, JoinError, JoinReport};
pub use engine::{JoinedConfig, JoinedPeer, JoinedStatus, Outgoing};
pub use fitness::{Mismatch, Unfit};
pub use heard::HeardSender;
pub use seat::SeatTaken;
