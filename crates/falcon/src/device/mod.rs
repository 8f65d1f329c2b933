//! A Falcon as the device of a peer.
//!
//! [`FalconDevice`] exchanges packets at 1 kHz in a thread of its own. Peer and thread pass values through memory without waiting for each other.
//! [`SteppedFalcon`] has no thread and is driven by the peer's ticks, which a simulated Falcon in virtual time needs.

mod axes;
mod mailbox;
mod stepped;
mod threaded;
mod turn;

pub use axes::{Axes, AxesError, Axis};
pub use stepped::SteppedFalcon;
pub use threaded::{Ended, FalconDevice, StartError, Stopper};
pub use turn::{DeviceConfig, DeviceConfigError, Hold, LoopStatistics, Snapshot};
