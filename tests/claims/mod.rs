//! Claims about coordination over links, each stated precisely, asserted where it holds, with counterexamples from outside that region.
//!
//! `docs/claims.md` lists them, derives the bounds that are used here, and links the counterexamples in `scenarios/counterexamples/`. The claims of the paper
//! (Rakhsha & Constantinescu 2015) stand in [`stiffness`], [`regions`], [`felt`] and [`experiments`]; what holds of coordination under every condition of the
//! links in [`energy`], [`healing`], [`jumps`] and [`joining`].
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail as tests do")]
#![allow(clippy::float_cmp, reason = "what must be the same to the bit")]
#![allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "counts, milliseconds and frames, far below 2^53"
)]

mod ages;
mod client_server;
mod counterexamples;
mod energy;
mod experiments;
mod felt;
mod healing;
mod injected;
mod joining;
mod jumps;
mod local_damping;
mod local_lag;
mod paper;
mod passivity_control;
mod proofs;
mod regions;
mod send_when;
mod set_position;
mod settling;
mod stiffness;
mod wave;

use cohaptic_tests_common::same_cases;
use proptest::prelude::ProptestConfig;

/// A tick of all peers here \[s\].
const TICK: f64 = 1e-3;

/// So many cases, the same at every run.
fn cases(count: u32) -> ProptestConfig {
    same_cases(count, 0x00c0_4a97_1c00_0001)
}
