//! Output of a failing test: a test that fails again, printed once, and little else.

mod programs;
// As it was printed.
#[rustfmt::skip]
mod saved;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::Command;
use std::time::Duration;

use cohaptic_testkit::node::{Node, Nodes, Packet, Transmit};
use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::proptest::test_runner::TestRunner;
use cohaptic_testkit::strategies::{ImpairedNetwork, LinkBounds, networks_like};
use cohaptic_testkit::{ARTEFACTS_VARIABLE, Instant, SEED_VARIABLE, Testbed};

use programs::{five_letters, letters_in_order};

/// Variable that names the test that fails in the child process.
const CHILD: &str = "COHAPTIC_TESTKIT_CHILD_AGAIN";

fn is_child(name: &str) -> bool {
    std::env::var(CHILD).is_ok_and(|child| child == name)
}

fn lossy() -> LinkBounds {
    LinkBounds::ideal().loss(0.1..=30.0).delay(Duration::ZERO..=Duration::from_millis(100))
}

proptest! {
    #[test]
    fn every_letter_arrives(network in networks_like(2, lossy())) {
        if is_child("every_letter_arrives") {
            Testbed::new(["client", "server"]).network(&network).run(five_letters);
        }
    }

    #[test]
    fn letters_of_a_closure_arrive(network in networks_like(2, lossy())) {
        if is_child("letters_of_a_closure_arrive") {
            Testbed::new(["client", "server"]).network(&network).on_tokio().run(|bed| async move {
                let (begin, end) = (b"(", ")");
                five_letters(bed).await;
                assert_ne!(begin, end.as_bytes());
            });
        }
    }

    #[test]
    fn letters_keep_their_order(network in networks_like(2, LinkBounds::ideal().jitter(Duration::ZERO..=Duration::from_millis(100)))) {
        if is_child("letters_keep_their_order") {
            Testbed::new(["client", "server"]).network(&network).run(letters_in_order);
        }
    }

    #[test]
    fn as_many_letters_arrive_as_are_sent(network in networks_like(2, lossy())) {
        if is_child("as_many_letters_arrive_as_are_sent") {
            let arrived = Testbed::new(["client", "server"]).network(&network).on_tokio().run(programs::count_letters);
            prop_assert_eq!(arrived, 5);
        }
    }

    #[test]
    fn ports_are_kept(network in networks_like(2, LinkBounds::ideal()).behind_nats([0])) {
        if is_child("ports_are_kept") {
            Testbed::new(["client", "server"]).network(&network).run(|bed| async move {
                let [client, server] = ["client", "server"].map(|name| bed.host(name).bind("0.0.0.0:5000").unwrap());
                client.send_to(b"?", "server:5000").await.unwrap();
                assert_eq!(server.recv_from(&mut [0]).await.unwrap().1.port(), 5000);
            });
        }
    }

    #[test]
    fn nodes_hear_every_beat(network in networks_like(2, lossy())) {
        if is_child("nodes_hear_every_beat") {
            let link = network.links().next().unwrap().2.clone();
            let mut run = Nodes::new().add("client", Beats(0)).add("server", Beats(5)).link("client", "server", link).start();
            run.run_until_idle();
            assert_eq!(run.counts("server").arrived, 5);
        }
    }
}

/// Node that sends five packets at the beginning.
struct Beats(u8);

impl Node for Beats {
    fn handle_packet(&mut self, _now: Instant, _packet: Packet) {}

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        (self.0 < 5).then(|| {
            self.0 += 1;
            Transmit::to(1, [self.0].to_vec())
        })
    }
}

/// Returns the output of a child process in which the test `test` fails.
fn printed(test: &str, environment: &[(&str, &str)]) -> String {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", &format!("again::{test}"), "--nocapture"])
        .env(CHILD, test)
        .env_remove(SEED_VARIABLE)
        .env_remove(ARTEFACTS_VARIABLE)
        .envs([("PROPTEST_RNG_SEED", "2015"), ("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "1"), ("RUST_BACKTRACE", "0")])
        .envs(environment.iter().copied())
        .output()
        .unwrap();
    assert!(!output.status.success());
    String::from_utf8(output.stderr).unwrap()
}

/// Returns the code of the test in an output.
fn test_in(printed: &str) -> &str {
    let begin = printed.find("#[test]\n").unwrap_or_else(|| panic!("no test in\n{printed}"));
    let end = printed[begin..].find("\n}\n").unwrap() + begin + 3;
    &printed[begin..end]
}

const SAVED: &str = include_str!("saved.rs");

const CHAPTER: &str = include_str!("../../../../../docs/testing.md");

#[test]
fn the_printed_tests_are_saved_in_saved_rs_and_fail_there() {
    for test in ["every_letter_arrives", "letters_of_a_closure_arrive", "letters_keep_their_order"] {
        let text = printed(test, &[]);
        assert!(SAVED.contains(test_in(&text)), "saved.rs does not have\n{}", test_in(&text));
    }
    let text = printed("every_letter_arrives", &[]);
    assert!(
        CHAPTER.contains(test_in(&text)) && CHAPTER.contains("`loss 7.1%`") && text.contains("loss 7.1%"),
        "docs/testing.md does not show\n{text}"
    );
}

/// Returns the test bed after the calls that a printed test makes.
fn with_calls(mut bed: Testbed, test: &str) -> Testbed {
    for line in test.lines().map(str::trim) {
        let Some((method, arguments)) = line.strip_prefix('.').and_then(|line| line.split_once('(')) else { continue };
        let words: Vec<&str> = arguments.split('"').skip(1).step_by(2).collect();
        bed = match (method, &words[..]) {
            ("link", [from, to, words]) => bed.link(from, to, *words),
            ("hit", [from, to, words]) => bed.hit(from, to, words),
            ("seed", []) => bed.seed(arguments.trim_end_matches([')', ';']).parse().unwrap()),
            ("run", []) => bed,
            _ => panic!("a call that nobody expects: {line}"),
        };
    }
    bed
}

/// Returns test beds with further hosts and links, and with the hosts and links in other orders.
fn others() -> Vec<Testbed> {
    let more = |hosts: &[&str]| Testbed::new(hosts.to_vec()).links("delay 3ms 1ms loss 10%");
    let exact = |bed: Testbed| bed.link("client", "server", "").link("server", "client", "");
    vec![
        Testbed::new(["client", "server"]),
        Testbed::new(["server", "client"]),
        exact(more(&["x", "server", "y", "client"])).link("x", "client", "loss 50%"),
        exact(more(&["client", "x", "y", "z", "server"])).link("server", "z", "duplicate 50%"),
    ]
}

fn fails<F: Future<Output = ()> + 'static>(bed: Testbed, program: impl FnOnce(cohaptic_testkit::Bed) -> F) -> bool {
    catch_unwind(AssertUnwindSafe(|| bed.run(program))).is_err()
}

#[test]
fn a_saved_failure_still_fails_when_hosts_links_and_their_order_change() {
    let (lost, mixed) = (printed("every_letter_arrives", &[]), printed("letters_keep_their_order", &[]));
    assert!(test_in(&lost).contains(".hit(\"") && !test_in(&lost).contains(".seed("), "{lost}");
    assert!(test_in(&mixed).contains(".seed("), "{mixed}");
    for bed in others() {
        assert!(!fails(bed.clone(), five_letters) && !fails(bed.clone(), letters_in_order), "nothing is wrong with {bed:?}");
        assert!(fails(with_calls(bed.clone(), test_in(&lost)), five_letters), "{bed:?}");
        assert!(fails(with_calls(bed.clone(), test_in(&mixed)), letters_in_order), "{bed:?}");
    }
}

/// The ports of a NAT follow from the seed.
#[test]
fn a_test_with_random_ports_of_a_nat_prints_its_seed() {
    let text = printed("ports_are_kept", &[]);
    assert!(test_in(&text).contains(".nat(\"nat-client\", \"") && test_in(&text).contains(".seed("), "{text}");
}

#[test]
fn the_smallest_network_alone_passes_with_the_bug_still_there() {
    let text = printed("every_letter_arrives", &[]);
    let network = text.split("ImpairedNetwork::words(\"").nth(1).unwrap().split("\")").next().unwrap();
    assert!(network.contains("loss"), "{network}");
    let bed = Testbed::new(["client", "server"]).network(&ImpairedNetwork::words(network));
    // The network says nothing of which packets are lost: with other seeds none is.
    assert!(!fails(bed.seed(1), five_letters));
}

#[test]
fn a_property_that_fails_prints_one_network_and_one_panic() {
    for (test, most) in [("every_letter_arrives", 30), ("as_many_letters_arrive_as_are_sent", 30), ("nodes_hear_every_beat", 30)] {
        let text = printed(test, &[]);
        assert_eq!(text.matches("panicked at").count(), 1, "{text}");
        assert_eq!(text.matches("ImpairedNetwork::words").count(), 1, "{text}");
        assert_eq!(text.matches("COHAPTIC_TEST_SEED=").count(), 1, "{text}");
        assert_eq!(text.matches("COHAPTIC_TEST_ARTEFACTS=").count(), 1, "{text}");
        assert!(text.lines().count() <= most, "{} lines:\n{text}", text.lines().count());
    }
    let text = printed("every_letter_arrives", &[]);
    assert!(text.contains("the smallest input panics at crates/testkit/tests/integration/again/programs.rs:"), "{text}");
    let text = printed("as_many_letters_arrive_as_are_sent", &[]);
    assert!(test_in(&text).contains("    let outcome = Testbed::new([\"client\", \"server\"])\n"), "{text}");
    assert!(
        test_in(&text).contains("        .on_tokio()\n        .run(programs::count_letters);\n    // Write here what the test expects"),
        "{text}"
    );
    let text = printed("nodes_hear_every_beat", &[]);
    assert!(text.contains("the nodes meet the same fates again with this network:\n    .hit(\"client\", \"server\", \"drop packet"), "{text}");
}

#[test]
fn a_backtrace_is_about_the_program() {
    for test in ["every_letter_arrives", "letters_keep_their_order"] {
        let text = printed(test, &[("RUST_BACKTRACE", "1")]);
        assert!(text.lines().count() <= 100, "{} lines:\n{text}", text.lines().count());
        assert!(text.contains("again::programs::"), "{text}");
    }
    for name in ["own", "tokio"] {
        let text = printed("fails_in_a_child_of_this_process_only", &[("RUST_BACKTRACE", "1"), ("COHAPTIC_TESTKIT_AGAIN_ON", name)]);
        assert!(text.lines().count() <= 80, "{} lines:\n{text}", text.lines().count());
        assert!(text.contains("again::programs::five_letters"), "{text}");
        // Frames of what calls the program are left out.
        assert!(!text.contains("tokio::runtime::") && !text.contains("catch_unwind"), "{text}");
    }
}

#[test]
fn a_panic_beside_a_value_that_may_shrink_is_told_with_its_message() {
    let text = printed("panics_beside_a_value_in_a_child_of_this_process_only", &[]);
    assert!(text.contains("' panicked at crates/testkit/tests/integration/again/mod.rs:") && text.contains(":\nbeside it\n"), "{text}");
}

#[test]
fn panics_beside_a_value_in_a_child_of_this_process_only() {
    if is_child("panics_beside_a_value_in_a_child_of_this_process_only") {
        let _tree = networks_like(2, lossy()).new_tree(&mut TestRunner::deterministic()).unwrap();
        panic!("beside it");
    }
}

#[test]
fn fails_in_a_child_of_this_process_only() {
    if is_child("fails_in_a_child_of_this_process_only") {
        let bed = Testbed::new(["client", "server"]).links("loss 100%");
        let bed = if std::env::var("COHAPTIC_TESTKIT_AGAIN_ON").unwrap() == "tokio" { bed.on_tokio() } else { bed };
        bed.run(five_letters);
    }
}

#[test]
fn the_trace_of_the_smallest_input_is_kept_and_said() {
    for test in ["every_letter_arrives", "as_many_letters_arrive_as_are_sent"] {
        let base = tempfile::tempdir().unwrap();
        let text = printed(test, &[(ARTEFACTS_VARIABLE, base.path().to_str().unwrap())]);
        let said: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("the record of the run is in ")).collect();
        let [folder] = said[..] else { panic!("one folder is expected:\n{text}") };
        let trace = std::fs::read_to_string(std::path::Path::new(folder).join("trace.txt")).unwrap();
        assert_eq!(trace.lines().filter(|line| line.ends_with(" lost: loss")).count(), 1, "{trace}");
    }
}
