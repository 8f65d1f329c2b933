//! A Falcon as the device of a peer.
//!
//! [`FalconDevice`] has a thread that exchanges packets at 1 kHz; the peer and the thread hand each other numbers through memory that neither waits for.
//! [`SteppedFalcon`] has none: the peer's own ticks drive it, which is what a simulated Falcon in virtual time needs.

mod axes;
mod mailbox;
mod stepped;
mod threaded;
mod turn;

pub use axes::{Axes, AxesError, Axis};
pub use stepped::SteppedFalcon;
pub use threaded::{Ended, FalconDevice, StartError, Stopper};
pub use turn::{DeviceConfig, DeviceConfigError, Hold, LoopStatistics, Snapshot};
