//! Property tests share one compiled runner.

use std::fs;

use crate::house::{files, name, root};

/// Tests that declare properties as users of the test kit do, and workspaces of their own.
const AS_USERS_DO: [&str; 6] = ["crates/testkit/", "tests/testkit/", "tests/common/", "tests/programs/", "tests/existing/", "tests/outside/"];

/// `proptest!` compiles a runner for each property, and `properties!` one for all.
#[test]
fn properties_have_one_runner() {
    let sources = ["crates", "benches", "tests"].into_iter().flat_map(|folder| files(&root().join(folder), "rs"));
    let of_their_own = sources.filter(|path| fs::read_to_string(path).unwrap().lines().any(|line| line.trim_start().starts_with("proptest! {")));
    let (as_users, wrong): (Vec<_>, Vec<_>) =
        of_their_own.map(|path| name(&path)).partition(|file| AS_USERS_DO.iter().any(|folder| file.starts_with(folder)));
    assert!(as_users.iter().any(|file| file.starts_with("crates/testkit/")), "{as_users:?}");
    assert!(wrong.is_empty(), "these compile runners of their own; declare them with cohaptic_tests_common::properties! instead: {wrong:?}");
}
