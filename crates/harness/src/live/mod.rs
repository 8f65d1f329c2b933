//! A scene some of whose peers are remote: in other processes, or with their device in somebody's hand.
//!
//! [`LiveScene`] is a state machine. Its driver hands in what comes from outside with the instant at which it came, lets time pass, and sends on what
//! the network has delivered. It reads no clock and touches no socket: driven by the clock of the wall it is a live session, driven by the recorded
//! [`Inputs`] of one, with [`replay`], it is the same session in virtual time, with the same fates and the same motion.
//!
//! What a peer's silence does to the others is written in `docs/live.md`.

mod device;
mod fade;
mod inputs;
mod presence;
mod pulled;
mod recorded;
mod replay;
mod rows;
mod scene;
mod seat;

pub(crate) use device::{HandDevice, UnsimulatedDevice};
pub(crate) use presence::RemotePeers;
pub(crate) use pulled::PulledDevice;
pub(crate) use seat::Seat;

pub use device::LiveDevice;
pub use inputs::{HEADER, Input, InputRow, Inputs, InputsError};
pub use presence::{Datagram, Transmit};
pub use recorded::{RecordedScene, SceneDifference};
pub use replay::replay;
pub use rows::{ClosingLine, InputLine};
pub use scene::{LiveScene, PeerState, TurnState};
pub use seat::{Presence, SampleError, SeatStats};
