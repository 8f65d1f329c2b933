//! Tests of the test kit.
#![allow(clippy::unwrap_used, clippy::panic, clippy::missing_panics_doc, reason = "tests")]

#[cfg(feature = "strategies")]
mod strategies;
