//! Code that spins or blocks is found by the wall clock. The watch ends the process, so that each test stalls in a child process.

use std::fs;
use std::hint::black_box;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

use cohaptic_testkit::hit::Verdict;
use cohaptic_testkit::node::{Node, Nodes, Packet, Transmit};
use cohaptic_testkit::{ARTEFACTS_VARIABLE, Bed, Instant, STALL_VARIABLE, Testbed, time};

/// Variable that names the way in which the child process stalls.
const CHILD: &str = "COHAPTIC_TESTKIT_CHILD_STALLS";

// Ten processes start at once, on a machine that may be busy. A shorter limit could end before a program reaches the place where it stalls.
const LIMIT: Duration = Duration::from_secs(1);

/// Spins for much longer than the limit, but not for ever, so that the test ends even if nothing finds the stall.
fn spin() {
    for turn in 0..20_000_000_000_u64 {
        black_box(turn);
    }
}

async fn wake_again_and_again() {
    for _ in 0..1_000_000_000_u64 {
        tokio::task::yield_now().await;
    }
}

/// Node that spins when a packet arrives.
struct Loops(Option<Transmit>);

impl Node for Loops {
    fn handle_packet(&mut self, _now: Instant, _packet: Packet) {
        spin();
    }

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        self.0.take()
    }
}

/// Program that stalls after 7 ms in the given way.
async fn stalls(bed: Bed, way: String) {
    time::sleep(Duration::from_millis(7)).await;
    let host = bed.host("b");
    match way.as_str() {
        "loop" => drop(host.spawn(async { spin() })),
        "block" => drop(bed.spawn(async {
            let (_sender, receiver) = mpsc::channel::<()>();
            let _ = receiver.recv_timeout(Duration::from_secs(20));
        })),
        "law" => drop(host.bind("0.0.0.0:1").unwrap().try_send_to(b"", "10.0.0.1:1".parse().unwrap())),
        "spawn" => drop(tokio::spawn(async { spin() })),
        "yield" => drop(tokio::spawn(wake_again_and_again())),
        _ => drop(tokio::task::spawn_local(wake_again_and_again())),
    }
    time::sleep(Duration::from_secs(1)).await;
}

#[test]
fn stalls_in_a_child_of_this_process_only() {
    let Ok(way) = std::env::var(CHILD) else { return };
    let bed = Testbed::new(["a", "b"]).seed(7).stall_limit(LIMIT).on_packet("b", "a", |_| {
        spin();
        Verdict::Pass
    });
    match way.as_str() {
        "node" => {
            let nodes = Nodes::new().add("a", Loops(Some(Transmit::to(1, "x")))).add("b", Loops(None)).links("delay 7ms").seed(7);
            nodes.stall_limit(LIMIT).start().run_until_idle();
        }
        // The test may do what it wants between the steps of nodes.
        "rest" => {
            let mut run = Nodes::new().add("a", Loops(None)).stall_limit(LIMIT).start();
            let (_sender, receiver) = mpsc::channel::<()>();
            let _ = receiver.recv_timeout(4 * LIMIT);
            run.run_until_idle();
        }
        "program" => bed.run(|_| {
            spin();
            async {}
        }),
        "spawn" | "yield" | "local" => bed.on_tokio().run(|bed| stalls(bed, way)),
        "loop on tokio" => bed.on_tokio().run(|bed| stalls(bed, "loop".to_owned())),
        "environment" => bed.stall_limit(Duration::MAX).run(|bed| stalls(bed, "loop".to_owned())),
        _ => bed.run(|bed| stalls(bed, way)),
    }
}

fn child(way: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "stall::stalls_in_a_child_of_this_process_only"]).env(CHILD, way).env_remove(STALL_VARIABLE);
    command.env_remove(ARTEFACTS_VARIABLE).stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

#[test]
fn what_stalls_is_named_and_ends_the_process() {
    let base = tempfile::tempdir().unwrap();
    let artefacts = base.path().join("all");
    let at = "at 0.007 s of the run and has not returned for 1s by the wall clock";
    let spawned = "that was spawned at crates/testkit/tests/integration/stall.rs:";
    let of_tokio = "a task of `tokio::spawn` or `spawn_local`, or the function that makes the program";
    let ways: [(&str, &[&str]); 10] = [
        (
            "loop",
            &[
                "the task of host `b`",
                spawned,
                at,
                "the record of the run is in ",
                "note: b -> a: the law of crates/testkit/tests/integration/stall.rs:",
            ],
        ),
        ("loop on tokio", &["the task of host `b`", spawned, at]),
        ("block", &[": the task that", spawned, at]),
        ("law", &[": the task that", spawned, "within a call of the test bed, such as one of a packet law"]),
        ("program", &["the function that makes the program", "at 0 s of the run"]),
        ("spawn", &[of_tokio, at]),
        ("yield", &[of_tokio, at]),
        ("local", &[of_tokio, at]),
        ("node", &["node `b` has the thread in a step of the run"]),
        ("environment", &["the task of host `b`", "has not returned for 500ms"]),
    ];
    let start = |way: &str| -> Child {
        let mut command = child(way);
        match way {
            "environment" => command.env(STALL_VARIABLE, "500ms"),
            "loop" => command.env(ARTEFACTS_VARIABLE, &artefacts),
            _ => &mut command,
        };
        command.spawn().unwrap()
    };
    let children: Vec<Child> = ways.iter().map(|(way, _)| start(way)).collect();
    for (child, (way, expected)) in children.into_iter().zip(ways) {
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success(), "{way}: {said}");
        for part in expected.iter().chain(&["time stands still", "seed 7; COHAPTIC_TEST_SEED=7 runs it again", "COHAPTIC_TEST_STALL=off"]) {
            assert!(said.contains(part), "{way}: {part} is not in {said}");
        }
    }
    let kept: Vec<_> = fs::read_dir(&artefacts).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(kept.len() == 1 && kept[0].join("trace.txt").exists(), "{kept:?}");
}

#[test]
fn a_test_may_rest_between_the_steps_of_nodes() {
    assert!(child("rest").status().unwrap().success());
}
