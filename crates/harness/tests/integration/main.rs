//! Live sessions under a clock of the test: against runs in virtual time, against replays of their records, and against the rules of the manual. Tasks in
//! whole runs.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail as tests do")]
#![allow(clippy::float_cmp, reason = "what must agree to the bit is compared so")]

mod bands;
mod hands;
mod many_peers;
mod operators;
mod pointers;
mod questions;
mod records;
mod remote;
mod replays;
mod scenes;
mod seats;
mod silence;
mod tasks;
mod travel;
mod turning_energy;
mod turning_laws;
mod virtual_time;

use proptest::prelude::ProptestConfig;

/// Returns [`cohaptic_tests_common::cases`], with a short search for a smaller case: each case is a whole session.
fn cases(count: u32) -> ProptestConfig {
    ProptestConfig { max_shrink_iters: 200, ..cohaptic_tests_common::cases(count) }
}
