//! Proofs about whole scenes.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail as tests do")]

#[path = "../../../stability/tests/integration/cases.rs"]
#[expect(dead_code, reason = "the tests of `cohaptic-stability` read the rest")]
mod cases;
#[path = "../../../stability/tests/integration/ends.rs"]
mod ends;
mod people;
mod slow_devices;
mod worst_case;
