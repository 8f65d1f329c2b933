//! Unmodified QUIC endpoints over emulated links.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "tests: lengths and counts as seconds and bytes, far below what a float holds"
)]

mod determinism;
mod new_reno;
mod transfer;
mod trouble;
