//! Tests of the test kit.
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used, clippy::cast_possible_truncation, reason = "tests")]

mod artefacts;
mod equivalence;
mod link_files;
mod nodes;
mod sockets;
