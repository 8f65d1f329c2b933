//! Gets the firmware into a device that was just switched on, and finds out whether it is there already.

mod firmware;
mod load;

pub use firmware::{Firmware, FirmwareError};
pub use load::{BootError, BootOptions, Progress, ensure_loaded, is_loaded, load};
