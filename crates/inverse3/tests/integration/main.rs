//! Tests of client and simulated service together.
#![allow(clippy::unwrap_used, clippy::panic, clippy::float_cmp, reason = "tests fail that way, and exact values are compared")]

mod faults;
