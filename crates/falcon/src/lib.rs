//! The Novint Falcon.
#![cfg_attr(test, allow(clippy::float_cmp, clippy::cast_precision_loss, reason = "tests compare exact values and count samples"))]

pub mod boot;
pub mod calibration;
mod clock;
pub mod device;
pub mod driver;
pub mod ftdi;
pub mod kinematics;
pub mod protocol;
pub mod safety;
pub mod simulator;
pub mod transport;
pub mod usb;
