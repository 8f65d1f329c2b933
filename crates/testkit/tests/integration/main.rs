//! Tests of the test kit.
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used, reason = "tests")]

#[cfg(feature = "quinn")]
mod quic;
mod sockets;
