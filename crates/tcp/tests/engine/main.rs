//! The engine against figures that do not come from it: RFCs, closed forms, Linux.
#![allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "tests count samples")]

mod fuzz;
mod recovery;
mod timing;
mod traps;
mod world;
