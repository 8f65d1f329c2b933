//! The driver against the simulated device: functions, faults, and promises of safety.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests fail that way")]
#![allow(clippy::float_cmp, clippy::cast_precision_loss, reason = "exact values are compared, and samples are counted")]

mod allocation;
mod boot;
mod common;
mod device;
mod driver;
mod faults;
mod old_defects;
mod safety;
mod simulator;
