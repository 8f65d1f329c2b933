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

/// The shipped scenes, in order of their paths.
#[must_use]
pub fn shipped_scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let scenes = cohaptic_scene::scene_files(&folder).unwrap();
    assert!(scenes.len() >= 30, "only {} scenes in {}", scenes.len(), folder.display());
    scenes
}
