//! A Falcon as the [`Device`](cohaptic_device::Device) of a session or of a loop.
//!
//! [`FalconDevice`] exchanges packets at 1 kHz in a thread of its own. Session and thread pass values through memory without waiting for each other.
//! [`SteppedFalcon`] has no thread and is driven by the session's ticks, which a simulated Falcon in virtual time needs.

mod axes;
mod stepped;
mod threaded;
mod turn;

pub use axes::{Axes, AxesError, Axis};
pub use stepped::SteppedFalcon;
pub use threaded::{Ended, FalconDevice, StartError};
pub use turn::{DeviceConfig, DeviceConfigError, Hold, LoopStatistics, Snapshot};
