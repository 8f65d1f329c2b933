//! Tests of the test kit.
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used, clippy::missing_panics_doc, reason = "tests")]

mod sockets;
#[cfg(feature = "strategies")]
mod strategies;
