//! Crates outside of the workspace that depend on the test kit alone, as those of somebody else would: one finds the bug planted in its protocol, one has tokio's
//! sockets in production (docs/how-to-dev-dependency.md), one is the first test of docs/tutorial-network-test.md, one is its last, and one is an existing program (docs/tutorial-existing-program.md).
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use std::path::{Path, PathBuf};
use std::process::Command;

/// A crate in docs/examples.
fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/examples").join(name)
}

/// What is simulated is optimised as the examples say; with all that it depends on a build takes two thirds as long again.
const OPTIMISED: [&str; 5] = ["cohaptic-testkit", "cohaptic-wan", "cohaptic-tcp", "rand", "chacha20"];

/// Runs its tests. Gives whether all passed, and what came on both outputs.
fn test(name: &str) -> (bool, String) {
    let optimised = OPTIMISED.map(|package| format!("profile.dev.package.{package}.opt-level=1"));
    let profile = ["profile.dev.debug=false", "profile.dev.package.\"*\".opt-level=0"].into_iter().chain(optimised.iter().map(String::as_str));
    let output = Command::new(env!("CARGO"))
        .args(["test", "--locked", "--color", "never"])
        .args(profile.flat_map(|setting| ["--config", setting]))
        .current_dir(example(name))
        // They share nothing with this build: neither what is built nor the lock that cargo holds on it.
        .env("CARGO_TARGET_DIR", Path::new(env!("CARGO_TARGET_TMPDIR")).join("outside"))
        // The seed is that of `.cargo/config.toml`, so that a reader sees what the page shows; a failure leaves nothing in the folder.
        .envs([("PROPTEST_RNG_SEED", "2015"), ("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "1"), ("RUST_BACKTRACE", "0")])
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
    let at_random = r#"cohaptic-testkit = { path = "../../../crates/testkit", features = ["strategies"] }"#;
    let with_quic = r#"cohaptic-testkit = { path = "../../../crates/testkit", features = ["files", "quinn", "strategies"] }"#;
    for (name, dependency) in [("reliable-udp", at_random), ("first-test", at_random), ("network-test", with_quic)] {
        let manifest = std::fs::read_to_string(example(name).join("Cargo.toml")).unwrap();
        let dependencies: Vec<&str> = manifest
            .lines()
            .skip_while(|line| *line != "[dependencies]")
            .skip(1)
            .take_while(|line| !line.starts_with('['))
            .filter(|line| line.contains('='))
            .collect();
        assert_eq!(dependencies, [dependency]);
        assert!(!manifest.contains("dependencies.") && !manifest.contains("dev-dependencies"), "other dependencies in\n{manifest}");
        assert!(manifest.contains("\n[workspace]\n"), "it is to be a workspace of its own");
    }
}

#[test]
fn the_planted_bug_is_found_and_the_others_fail_as_their_pages_say() {
    // One after the other, so that each finds built what those before have built.
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
    let (has_passed, text) = test("beside-tokio");
    assert!(has_passed, "{text}");
    for test in ["tests::a_phone_gets_the_time", "tests::two_lost_questions_are_asked_again"] {
        assert!(text.contains(&format!("test {test} ... ok\n")), "{test} did not run:\n{text}");
    }
    let (has_passed, text) = test("first-test");
    assert!(!has_passed, "the first test of docs/tutorial-network-test.md is to fail:\n{text}");
    assert_shown("tutorial-network-test.md", 1, &text);
    assert_shown("tutorial-network-test.md", 2, &text);

    let (has_passed, text) = test("network-test");
    assert!(!has_passed, "the test of datagrams is to fail:\n{text}");
    for test in [
        "tests::each_question_has_its_own_answer ... ok",
        "tests::each_question_has_its_own_answer_again ... ok",
        "a_dish_in_europe_asks_a_server_in_america ... ok",
        "a_phone_in_any_car_is_answered ... ok",
        "positions_never_go_back ... FAILED",
    ] {
        assert!(text.contains(&format!("test {test}\n")), "expected {test}:\n{text}");
    }
    assert_shown("tutorial-network-test.md", 3, &text);
}

/// The program of docs/tutorial-existing-program.md is built from the real tokio, and its tests from the package that `cohaptic tokio` writes.
#[test]
fn an_existing_program_runs_unchanged() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.toml");
    let output = Command::new(env!("CARGO"))
        .args(["run", "--quiet", "--package", "cohaptic-cli", "--manifest-path"])
        .arg(manifest)
        .args(["--", "tokio"])
        .current_dir(example("existing-program"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (has_passed, text) = test("existing-program/sim");
    assert!(!has_passed, "the test of one order is to fail:\n{text}");
    for test in ["an_order_is_cooked_over_a_lossy_link ... ok", "an_order_is_cooked_once ... FAILED"] {
        assert!(text.contains(&format!("test {test}\n")), "expected {test}:\n{text}");
    }
    assert_shown("tutorial-existing-program.md", 1, &text);
}

/// Fails unless the n-th block of text on a page, which begins with the minimal input or the test that fails again, is among what a test has printed.
fn assert_shown(page: &str, n: usize, text: &str) {
    let content = std::fs::read_to_string(example("..").join(page)).unwrap();
    let shown = content.split("```text\n").nth(n).unwrap().split("```").next().unwrap();
    assert!(shown.starts_with("minimal failing input") || shown.starts_with("#[test]\n"), "{shown}");
    assert!(text.contains(shown), "docs/{page} shows\n{shown}\nand this came:\n{text}");
}
