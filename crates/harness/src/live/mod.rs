//! Scenes with remote peers: peers in other processes, and peers whose device is in a person's hand.
//!
//! [`LiveScene`] is a state machine without clock and sockets. Its driver passes each input with its instant, lets time pass, and sends the datagrams of the
//! network to other processes. Driven by the wall clock, this is a live session. Driven by recorded [`Inputs`], with [`replay()`], this is the same session in
//! virtual time, with the same fates and the same motion.
//!
//! `docs/live.md` describes the effect of a silent peer on other peers.

mod inputs;
mod recorded;
mod replay;
mod rows;
mod scene;

pub use crate::rows::{Input, InputRow};
pub use crate::world::live::{Datagram, Fade, GateStats, GatedDevice, Presence, SampleError, SeatStats, Transmit, TurnState};
pub use inputs::{Inputs, InputsError};
pub use recorded::{RecordedScene, SceneDifference};
pub use replay::replay;
pub use rows::{ClosingLine, InputLine};
pub use scene::{LiveScene, PeerState};
