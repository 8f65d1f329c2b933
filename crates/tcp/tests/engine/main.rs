//! The engine against figures from other sources: RFCs, closed forms and Linux.
#![allow(
    clippy::unwrap_used,
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "tests fail where they stop, and count samples"
)]

mod buffers;
mod dctcp;
mod dualpi2;
mod flags;
mod flight;
mod fuzz;
mod recovery;
mod rows;
mod smoltcp;
mod timing;
mod traps;
mod world;
