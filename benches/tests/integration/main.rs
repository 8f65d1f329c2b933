//! The pages of measured figures: every command on them runs, every program that writes one has its command on one.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

mod commands;
mod manifests;
mod script;

use std::fs;
use std::path::{Path, PathBuf};

/// The folder of the project.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The pages whose every command is looked at.
const PAGES: [&str; 17] = [
    "measured.md",
    "measured-speed.md",
    "measured-cluster.md",
    "measured-link.md",
    "measured-samplers.md",
    "measured-stability.md",
    "measured-testkit.md",
    "measured-peers.md",
    "measured-relay.md",
    "measured-live.md",
    "measured-devices.md",
    "measured-floods.md",
    "measured-tcp.md",
    "measured-soak.md",
    "measured-build.md",
    "measured-first.md",
    "measured-fuzz.md",
];

/// Name and text of each.
fn pages() -> Vec<(&'static str, String)> {
    let read = |name: &'static str| (name, fs::read_to_string(root().join("docs").join(name)).unwrap_or_else(|error| panic!("{name}: {error}")));
    PAGES.into_iter().map(read).collect()
}
