//! Tests of the test kit.
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used, clippy::missing_panics_doc, clippy::cast_possible_truncation, reason = "tests")]

#[cfg(feature = "strategies")]
mod chapter;
mod equivalence;
mod nodes;
mod sockets;
#[cfg(feature = "strategies")]
mod strategies;
