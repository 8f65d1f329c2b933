//! Programs in real time have one loop.

use std::fs;

use crate::house::{files, name, root};

/// Packages whose own code may wait for a deadline: the one with the loop, and the one that compares ways of waiting.
const MAY_WAIT: [&str; 2] = ["crates/realtime/", "crates/accuracy/"];

/// A second loop would have tricks of its own, which nobody measures: relay, router and sessions are driven by `cohaptic_realtime::drive`.
#[test]
fn programs_in_real_time_wait_in_one_loop() {
    let sources = files(&root().join("crates"), "rs").into_iter().filter(|path| name(path).contains("/src/"));
    let waiting: Vec<String> = sources.filter(|path| fs::read_to_string(path).unwrap().contains("Pacer::new(")).map(|path| name(&path)).collect();
    let (right, wrong): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|file| MAY_WAIT.iter().any(|package| file.starts_with(package)));
    assert!(right.contains(&"crates/realtime/src/drive/mod.rs".to_owned()), "{right:?}");
    assert!(wrong.is_empty(), "these wait by themselves; implement cohaptic_realtime::Driven instead: {wrong:?}");
}
