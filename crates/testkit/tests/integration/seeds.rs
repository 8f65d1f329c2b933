//! Seed of a test bed: it follows from the function in which the test bed is run, and does not depend on threads.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::Command;

use cohaptic_testkit::{SEED_VARIABLE, Testbed, node};

/// Variable whose presence makes the test in the child process fail.
const CHILD: &str = "COHAPTIC_TESTKIT_CHILD_SEEDS";

#[test]
fn fails_in_a_child_of_this_process_only() {
    if std::env::var_os(CHILD).is_some() {
        let bed = Testbed::new(["a"]);
        let fails = |bed: Testbed| drop(catch_unwind(AssertUnwindSafe(|| bed.run(|_| async { panic!("it fails") }))));
        fails(bed.clone());
        fails(bed.on_tokio());
        elsewhere();
        let _fails = node::Nodes::new().add("a", Silent).start();
        panic!("it fails");
    }
}

fn elsewhere() {
    drop(catch_unwind(|| Testbed::new(["a"]).run(|_| async { panic!("it fails") })));
}

struct Silent;

impl node::Node for Silent {
    fn handle_packet(&mut self, _now: cohaptic_testkit::Instant, _packet: node::Packet) {}

    fn poll_transmit(&mut self, _now: cohaptic_testkit::Instant) -> Option<node::Transmit> {
        None
    }
}

/// Returns the seeds and the names of tests that a child process prints.
fn printed(threads: &str) -> Vec<(String, String)> {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "seeds::fails_in_a_child_of_this_process_only", "--nocapture", "--test-threads", threads])
        .env(CHILD, "1")
        .env_remove(SEED_VARIABLE)
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    let lines = said.lines().filter_map(|line| line.strip_prefix("test bed of `")?.split_once("`: seed "));
    lines.map(|(name, rest)| (name.to_owned(), rest.split(';').next().unwrap().to_owned())).collect()
}

#[test]
fn seeds_are_the_same_with_one_thread_and_with_many() {
    let (one, many) = (printed("1"), printed("4"));
    let seeds = |all: &[(String, String)]| all.iter().map(|(_, seed)| seed.clone()).collect::<Vec<_>>();
    assert_eq!(seeds(&one), seeds(&many));
    let all = seeds(&one);
    // Both beds of one function have one seed, wherever they run.
    assert_eq!((all.len(), &all[0]), (4, &all[1]));
    assert!(all[1] != all[2] && all[2] != all[3] && all[1] != all[3], "{all:?}");
    assert!(one.iter().all(|(name, _)| name != "main"), "{one:?}");
}
