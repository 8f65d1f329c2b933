//! Which packages build on systems other than Linux.

use std::collections::BTreeSet;
use std::process::Command;

use crate::house::metadata::{Tree, metadata};
use crate::house::{files, name, root};

/// Packages that use nothing of Linux.
const PORTABLE: [&str; 19] = [
    "sockets",
    "units",
    "device",
    "files",
    "wan",
    "capture",
    "peer",
    "linkfile",
    "scene",
    "harness",
    "stability",
    "proofs",
    "answers",
    "measure",
    "campaign",
    "picture",
    "testkit",
    "paper",
    "streams",
];

/// Packages of this project that need Linux, and that the program takes there.
const LINUX: [&str; 4] = ["relay", "router", "exec", "live"];

/// Speed against error, which has a program of its own and needs Linux too.
const ACCURACY: &str = "accuracy";

/// Packages of others that only build on Linux, or that give access to calls that other systems may lack.
const SYSTEM: [&str; 9] = ["rustix", "linux-raw-sys", "nix", "tun-rs", "thread-priority", "quinn-udp", "netlink-sys", "rtnetlink", "inotify"];

/// Uses that are right: the package of this project that brings in the package of the other, that package, and the systems. `flock` of rustix locks files and
/// folders that are written on macOS as on Linux. The terminal of clap asks rustix for its width, and `ctrlc` has its signals from nix.
const RIGHT: [(&str, &str, &str); 3] = [("files", "rustix", "apple"), ("cli", "rustix", "apple"), ("cli", "nix", "apple")];

/// Features of the test kit that are for programs of others. No package of the workspace needs them, and they build on each system all the same.
const OPTIONS: &str = "cohaptic-testkit/axum,cohaptic-testkit/facade,cohaptic-testkit/hyper,cohaptic-testkit/quinn,cohaptic-testkit/tonic";

const TARGETS: [&str; 3] = ["x86_64-apple-darwin", "aarch64-apple-darwin", "x86_64-pc-windows-msvc"];

fn ours(short: &str) -> String {
    format!("cohaptic-{short}")
}

#[test]
fn portable_packages_and_the_program_take_nothing_of_linux_elsewhere() {
    let mut wrong = Vec::new();
    for target in TARGETS {
        let tree = Tree::new(&metadata(&["--filter-platform", target, "--features", OPTIONS]));
        for package in PORTABLE.into_iter().chain(["cli"]) {
            let built = tree.of(&ours(package));
            let of_linux: Vec<String> = LINUX.into_iter().chain([ACCURACY]).map(ours).collect();
            let taken = of_linux.iter().map(String::as_str).chain(SYSTEM).filter(|name| built.contains(name));
            let is_right = |name: &str| RIGHT.iter().any(|(by, of, on)| built.contains(ours(by).as_str()) && *of == name && target.contains(on));
            wrong.extend(taken.filter(|name| !is_right(name)).map(|name| format!("{target}: cohaptic-{package} takes {name}")));
        }
    }
    // The test bed has QUIC by quinn as an option, and that has sockets of its own, which are those of every system.
    wrong.retain(|line| !line.ends_with("cohaptic-testkit takes quinn-udp"));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Returns the packages that a build of one package takes, one a line: the name, `with`, and its features. Unlike `cargo metadata`, `cargo tree` leaves out what
/// the features of other packages add.
fn built(package: &str) -> Vec<String> {
    let arguments = ["tree", "--locked", "--offline", "--edges", "normal", "--prefix", "none", "--format", "{p} with {f}", "--package", package];
    let output = Command::new(env!("CARGO")).current_dir(root()).args(arguments).output().unwrap();
    assert!(output.status.success(), "cargo tree: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect()
}

/// Speed against error computes its references with pairs of doubles, the feature `qd` of `cohaptic-peer`, which the program has no use for.
#[test]
fn the_program_takes_nothing_of_the_measurement_of_speed_against_error() {
    let takes = |tree: &[String], name: &str| tree.iter().any(|line| line.split(' ').next() == Some(name));
    let has_pairs = |tree: &[String]| {
        let features: Vec<&str> = tree
            .iter()
            .filter(|line| line.starts_with("cohaptic-peer "))
            .filter_map(|line| line.split_once(" with "))
            .map(|(_, features)| features)
            .collect();
        assert!(!features.is_empty(), "no cohaptic-peer in {tree:?}");
        features.iter().any(|features| features.contains("qd"))
    };
    let (program, measurement) = (built("cohaptic-cli"), built(&ours(ACCURACY)));
    assert!(takes(&program, "cohaptic-harness") && !takes(&program, &ours(ACCURACY)));
    assert!(!has_pairs(&program));
    // What is looked for above is found where it is.
    assert!(takes(&measurement, &ours(ACCURACY)) && has_pairs(&measurement));
}

/// So that the test above looks at trees in which these packages could be.
#[test]
fn on_linux_the_program_takes_them() {
    let tree = Tree::new(&metadata(&["--filter-platform", "x86_64-unknown-linux-gnu"]));
    let built = tree.of("cohaptic-cli");
    let missing: BTreeSet<String> = LINUX.into_iter().map(ours).filter(|name| !built.contains(name.as_str())).collect();
    assert!(missing.is_empty() && built.contains("tun-rs") && built.contains("thread-priority"), "{missing:?}");
}

/// What only one system has is behind a `cfg` in the one file that needs it.
#[test]
fn portable_sources_name_no_system() {
    let mut found = Vec::new();
    for package in PORTABLE {
        for path in files(&root().join("crates").join(package).join("src"), "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            let own = text.split("#[cfg(test)]").next().unwrap();
            let systems = own.lines().filter(|line| line.contains("std::os::"));
            found.extend(systems.map(|line| format!("{}: {}", name(&path), line.trim())));
        }
    }
    // Files that are written: their locks on Unix, exclusive opening on Windows, sockets and standard streams. Files with a secret: their permissions on Unix.
    let is_file =
        |line: &String| ["lock", "secret", "standard_output", "target"].iter().any(|file| line.starts_with(&format!("crates/files/src/{file}.rs:")));
    let (files, others): (Vec<_>, Vec<_>) = found.into_iter().partition(is_file);
    assert!(files.len() == 8 && others.is_empty(), "{files:?}, {others:?}");
}
