//! Firmware of a device: the loading into a device that was just switched on, and the detection of running firmware.

mod firmware;
mod load;

pub use firmware::{Firmware, FirmwareError};
pub use load::{BootError, BootOptions, Progress, ensure_loaded, is_loaded, load};
