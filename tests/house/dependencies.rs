//! The crates that a build of the test kit and of the program compiles: each is a decision, because every user waits for it.

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

/// The crates that the program compiles on Linux, one name a line.
const PROGRAM: &str = include_str!("crates-of-the-program.txt");

/// Names of the crates that a build of a package compiles on Linux: libraries, their build scripts and macros; without those of its own tests.
fn compiled(package: &str, features: &[&str]) -> BTreeSet<String> {
    let tree = |mode: &[&str]| {
        let mut command = Command::new(env!("CARGO"));
        command.current_dir(root()).args(["tree", "--package", package, "--edges", "normal,build", "--prefix", "none", "--no-dedupe"]);
        command.args(["--format", "{p}", "--target", "x86_64-unknown-linux-gnu", "--locked"]).args(mode).args(features).output().unwrap()
    };
    let mut output = tree(&["--offline"]);
    if !output.status.success() {
        output = tree(&[]);
    }
    assert!(output.status.success(), "cargo tree {package} {features:?}: {}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

/// A crate more costs every user of the test kit, so that each is named here.
#[test]
fn the_default_features_compile_few_crates() {
    let crates = compiled("cohaptic-testkit", &[]);
    assert!(crates.len() <= MOST, "{} crates of at most {MOST}: {crates:?}", crates.len());
    assert_eq!(crates, DEFAULT.map(str::to_owned).into());
}

/// A crate that comes or goes is added to or removed from `tests/house/crates-of-the-program.txt`, and the commit says why.
#[test]
fn the_program_compiles_the_crates_of_its_list() {
    let listed: BTreeSet<String> = PROGRAM.lines().map(str::to_owned).collect();
    let crates = compiled("cohaptic-cli", &[]);
    let (new, gone): (Vec<_>, Vec<_>) = (crates.difference(&listed).collect(), listed.difference(&crates).collect());
    assert!(new.is_empty() && gone.is_empty(), "not in tests/house/crates-of-the-program.txt: {new:?}; no longer compiled: {gone:?}");
}

#[test]
fn a_feature_that_is_off_compiles_nothing() {
    let crates = compiled("cohaptic-testkit", &["--no-default-features"]);
    let expected = ["bytes", "cohaptic-files", "cohaptic-testkit", "cohaptic-units", "cohaptic-wan", "libm", "rand", "rand_core"];
    assert_eq!(crates, expected.map(str::to_owned).into());
    let added = |feature: &str| -> Vec<String> {
        let with = compiled("cohaptic-testkit", &["--no-default-features", "--features", feature]);
        with.difference(&crates).cloned().collect()
    };
    assert_eq!(added("tcp"), ["cohaptic-tcp"]);
    assert_eq!(added("pcapng"), ["cohaptic-capture"]);
    assert_eq!(added("tokio"), ["pin-project-lite", "tokio"]);
    // The package `tokio` that stands in for tokio depends on `cohaptic-sockets` too, so that a dependency of that crate would be one of every program under test.
    assert_eq!(added("facade"), ["cohaptic-sockets", "cohaptic-tcp", "pin-project-lite", "tokio"]);
    assert!(added("strategies").contains(&"proptest".to_owned()));
    // The sockets of the system come with the types of tokio's `net`.
    assert!(added("tokio-net").contains(&"mio".to_owned()));
}

/// A build for tests of networks compiles no driver of a device.
#[test]
fn the_program_without_drivers_compiles_none() {
    let (all, without) = (compiled("cohaptic-cli", &[]), compiled("cohaptic-cli", &["--no-default-features"]));
    let left_out: Vec<&String> = all.difference(&without).collect();
    assert!(["cohaptic-falcon", "nusb"].iter().all(|driver| left_out.iter().any(|name| name == driver)), "{left_out:?}");
    assert!(without.contains("cohaptic-live") && without.is_subset(&all));
}

/// Optimisation at link time has the level of the crate that is linked. With that of the command line in `release` the program of wheels took 1.8 times as long.
#[test]
fn programs_that_are_given_away_are_linked_with_full_optimisation() {
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let says = |profile: &str, line: &str| {
        manifest.split("\n\n").flat_map(|part| part.split("\n[")).any(|part| part.contains(profile) && part.contains(line))
    };
    assert!(says("profile.dist]", "lto = \"thin\""));
    assert!(!says("profile.release.package.cohaptic-cli]", "opt-level") || says("profile.dist.package.cohaptic-cli]", "opt-level = 3"));
}
