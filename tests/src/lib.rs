//! What the tests of whole scenes share: scenes to order, a log of all that happened, and where two runs first differ.
//!
//! A [`Draft`] is a scene as a test thinks of it; it becomes TOML text and is read like any scene file, so the reader is tested too. [`drafts`] draws
//! them at random, [`links`] the links alone. [`Log`] holds every row of a run, [`Records`] every byte that a recorder writes.
//!
//! Nothing here knows what the right answer is: the oracles stand in the tests.
#![allow(clippy::panic, clippy::unwrap_used, clippy::missing_panics_doc, reason = "this crate is nothing but test support")]

/// The programs in the book are compiled and run.
#[cfg(doctest)]
mod book {
    #[doc = include_str!("../../docs/emulator.md")]
    mod emulator {}
    #[doc = include_str!("../../docs/extending.md")]
    mod extending {}
}

pub mod drafts;
pub mod links;
mod log;
mod records;

pub use cohaptic_testkit::strategies::scene::{Draft, DraftHand, DraftLink, DraftPeer, Place, contact_to_toml};
pub use log::{Body, Log, Tick, first_difference, keep, run};
pub use records::{Records, record};

use std::path::{Path, PathBuf};

use proptest::prelude::ProptestConfig;
use proptest::test_runner::RngSeed;

/// The variable of the environment with which a property test draws all of its cases. `.ci/nightly` sets it.
pub const ALL_CASES_VARIABLE: &str = "COHAPTIC_TEST_ALL_CASES";

/// Returns whether all cases are asked for, by [`ALL_CASES_VARIABLE`].
#[must_use]
pub fn are_all() -> bool {
    std::env::var_os(ALL_CASES_VARIABLE).is_some()
}

/// Returns `all` ticks, packets or milliseconds of a test if [`ALL_CASES_VARIABLE`] is set, and a quarter of them otherwise.
#[must_use]
pub fn quarter_by_day(all: u64) -> u64 {
    if are_all() { all } else { all.div_ceil(4) }
}

/// A property test that leaves no files behind. It draws `count` cases if [`ALL_CASES_VARIABLE`] is set, and the first quarter of them otherwise.
#[must_use]
pub fn cases(count: u32) -> ProptestConfig {
    let cases = if are_all() { count } else { count.div_ceil(4) };
    ProptestConfig { cases, failure_persistence: None, max_shrink_iters: 400, ..ProptestConfig::default() }
}

/// [`cases`] that are the same at every run.
#[must_use]
pub fn same_cases(count: u32, seed: u64) -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(seed), ..cases(count) }
}

/// The shipped scenes, in order of their paths.
#[must_use]
pub fn shipped_scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let scenes = cohaptic_scene::scene_files(&folder).unwrap();
    assert!(scenes.len() >= 30, "only {} scenes in {}", scenes.len(), folder.display());
    scenes
}
