//! The test kit is a small dependency: which crates a build of it compiles.

use std::collections::BTreeSet;
use std::process::Command;

use crate::house::root;

/// The most crates that the default features may compile, those of this project included.
const MOST: usize = 25;

/// The crates that the default features compile on Linux. `benches/testkit-build` measures what they cost.
const DEFAULT: [&str; 12] = [
    "bytes",
    "cohaptic-capture",
    "cohaptic-files",
    "cohaptic-tcp",
    "cohaptic-testkit",
    "cohaptic-units",
    "cohaptic-wan",
    "libm",
    "pin-project-lite",
    "rand",
    "rand_core",
    "tokio",
];

/// Names of the crates that a build of the test kit compiles on Linux: libraries, their build scripts and macros; without those of its own tests.
fn compiled(features: &[&str]) -> BTreeSet<String> {
    let tree = |mode: &[&str]| {
        let mut command = Command::new(env!("CARGO"));
        command.current_dir(root()).args(["tree", "--package", "cohaptic-testkit", "--edges", "normal,build", "--prefix", "none", "--no-dedupe"]);
        command.args(["--format", "{p}", "--target", "x86_64-unknown-linux-gnu", "--locked"]).args(mode).args(features).output().unwrap()
    };
    let mut output = tree(&["--offline"]);
    if !output.status.success() {
        output = tree(&[]);
    }
    assert!(output.status.success(), "cargo tree {features:?}: {}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

/// A crate more costs every user of the test kit, so that each is named here.
#[test]
fn the_default_features_compile_few_crates() {
    let crates = compiled(&[]);
    assert!(crates.len() <= MOST, "{} crates of at most {MOST}: {crates:?}", crates.len());
    assert_eq!(crates, DEFAULT.map(str::to_owned).into());
}

#[test]
fn a_feature_that_is_off_compiles_nothing() {
    let crates = compiled(&["--no-default-features"]);
    let expected = ["bytes", "cohaptic-files", "cohaptic-testkit", "cohaptic-units", "cohaptic-wan", "libm", "rand", "rand_core"];
    assert_eq!(crates, expected.map(str::to_owned).into());
    let added = |feature: &str| -> Vec<String> {
        let with = compiled(&["--no-default-features", "--features", feature]);
        with.difference(&crates).cloned().collect()
    };
    assert_eq!(added("tcp"), ["cohaptic-tcp"]);
    assert_eq!(added("pcapng"), ["cohaptic-capture"]);
    assert_eq!(added("tokio"), ["pin-project-lite", "tokio"]);
    assert!(added("strategies").contains(&"proptest".to_owned()));
    // The sockets of the system come with the types of tokio's `net`.
    assert!(added("tokio-net").contains(&"mio".to_owned()));
}
