//! Crates outside of the workspace that depend on the test kit alone, as those of somebody else would: one finds the bug planted in its protocol, the other is the
//! first test of docs/testing.md.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use std::path::{Path, PathBuf};
use std::process::Command;

/// A crate in docs/examples.
fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/examples").join(name)
}

/// Runs its tests. Gives whether all passed, and what came on both outputs.
fn test(name: &str) -> (bool, String) {
    let output = Command::new(env!("CARGO"))
        .args(["test", "--locked", "--color", "never"])
        .current_dir(example(name))
        // They share nothing with this build: neither what is built nor the lock that cargo holds on it.
        .env("CARGO_TARGET_DIR", Path::new(env!("CARGO_TARGET_TMPDIR")).join("outside"))
        // What is drawn is the same every time, and what fails leaves nothing in the folder.
        .envs([("PROPTEST_RNG_SEED", "1"), ("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "1"), ("RUST_BACKTRACE", "0")])
        .env_remove("COHAPTIC_TEST_SEED")
        .output()
        .unwrap();
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).join("\n");
    let hint = "if a dependency of the test kit has changed, `cargo metadata` in that folder brings its Cargo.lock up to date";
    assert!(text.contains("test result: "), "the tests of {name} did not run; {hint}:\n{text}");
    (output.status.success(), text)
}

#[test]
fn they_depend_on_the_test_kit_alone() {
    for name in ["reliable-udp", "first-test"] {
        let manifest = std::fs::read_to_string(example(name).join("Cargo.toml")).unwrap();
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
}

#[test]
fn the_planted_bug_is_found_and_the_first_test_fails_as_the_chapter_says() {
    // One after the other, so that the second finds built what the first has built.
    let (has_passed, text) = test("reliable-udp");
    assert!(has_passed, "{text}");
    for test in [
        "finds::the_bug_is_found_and_shrinks_to_one_link_with_one_impairment",
        "finds::the_same_search_gives_the_same",
        "finds::without_the_bug_all_messages_arrive_over_any_network",
        "only_then::no_impairment_that_keeps_the_order_of_packets_shows_it",
        "only_then::whenever_messages_are_missing_an_acknowledgement_came_behind_a_retransmission",
    ] {
        assert!(text.contains(&format!("test {test} ... ok\n")), "{test} did not run:\n{text}");
    }
    let (has_passed, text) = test("first-test");
    assert!(!has_passed, "the first test of docs/testing.md is to fail:\n{text}");
    let chapter = std::fs::read_to_string(example("../testing.md")).unwrap();
    let shown = chapter.split("```text\n").nth(1).unwrap().split("```").next().unwrap();
    assert!(shown.starts_with("minimal failing input"), "{shown}");
    assert!(text.contains(shown), "docs/testing.md shows\n{shown}\nand this came:\n{text}");
}
