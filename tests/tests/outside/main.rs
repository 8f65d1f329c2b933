//! A crate outside of the workspace that depends on the test kit alone, as that of somebody else would: it finds the bug planted in its protocol.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use std::path::{Path, PathBuf};
use std::process::Command;

/// The example of docs/testing.md.
fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/examples/reliable-udp")
}

#[test]
fn it_depends_on_the_test_kit_alone() {
    let manifest = std::fs::read_to_string(example().join("Cargo.toml")).unwrap();
    let dependencies: Vec<&str> = manifest
        .lines()
        .skip_while(|line| *line != "[dependencies]")
        .skip(1)
        .take_while(|line| !line.starts_with('['))
        .filter(|line| line.contains('='))
        .collect();
    assert_eq!(dependencies, [r#"cohaptic-testkit = { path = "../../../crates/testkit" }"#]);
    assert!(!manifest.contains("dependencies.") && !manifest.contains("dev-dependencies"), "other dependencies in\n{manifest}");
    assert!(manifest.contains("\n[workspace]\n"), "it is to be a workspace of its own");
}

#[test]
fn its_tests_find_the_planted_bug_and_pass() {
    let output = Command::new(env!("CARGO"))
        .args(["test", "--locked", "--color", "never"])
        .current_dir(example())
        // It shares nothing with this build: neither what is built nor the lock that cargo holds on it.
        .env("CARGO_TARGET_DIR", Path::new(env!("CARGO_TARGET_TMPDIR")).join("reliable-udp"))
        .output()
        .unwrap();
    let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(
        output.status.success(),
        "{stdout}\n{stderr}\nIf a dependency of the test kit has changed, `cargo metadata` in docs/examples/reliable-udp brings its Cargo.lock up to date."
    );
    for test in [
        "finds::the_bug_is_found_and_shrinks_to_one_link_with_one_impairment",
        "finds::the_same_search_gives_the_same",
        "finds::without_the_bug_all_messages_arrive_over_any_network",
        "only_then::no_impairment_that_keeps_the_order_of_packets_shows_it",
        "only_then::whenever_messages_are_missing_an_acknowledgement_came_behind_a_retransmission",
    ] {
        assert!(stdout.contains(&format!("test {test} ... ok\n")), "{test} did not run:\n{stdout}");
    }
}
