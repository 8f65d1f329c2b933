//! Tests of the rows: what they promise, and what must be in them.
#![allow(clippy::unwrap_used, clippy::panic, clippy::float_cmp, reason = "tests")]

mod analysis;
mod least;
mod network;
mod real_time;
mod rows;
