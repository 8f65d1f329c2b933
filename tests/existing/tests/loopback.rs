//! `COHAPTIC_TEST_LOOPBACK`: the tests of `foreign.rs` in a process of their own, whose loopback is a link.

use std::collections::BTreeMap;
use std::process::{Command, Output};

fn run(filter: &str, variables: &[(&str, &str)]) -> Output {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args([filter, "--nocapture", "--test-threads=1"]).env_remove("COHAPTIC_TEST_SEED").envs(variables.iter().copied());
    command.output().unwrap()
}

/// Runs the foreign tests. Returns what each has printed.
fn took(words: &str, seed: Option<&str>, standard: &str) -> BTreeMap<String, u64> {
    let seed = seed.map(|seed| ("COHAPTIC_TEST_SEED", seed));
    let variables: Vec<_> = [("COHAPTIC_TEST_LOOPBACK", words), ("COHAPTIC_TEST_STD", standard)].into_iter().chain(seed).collect();
    let output = run("foreign::", &variables);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    // The harness prints the name of a test before what the test prints, on the same line.
    let said = text.lines().filter_map(|line| line.rsplit(" ... ").next()?.strip_suffix(" ns")?.split_once(" took "));
    said.map(|(name, took)| (name.to_owned(), took.parse().unwrap())).collect()
}

/// The handshake takes a round trip over the loopback, and so does each message.
#[test]
fn each_way_to_run_a_program_is_on_the_loopback() {
    let took = took("delay 20ms", None, "");
    for name in ["address", "name", "runtime", "set", "main"] {
        assert_eq!(took[name], 2 * 40_000_000, "{name}: {took:?}");
    }
    assert_eq!((took["many"], took["work"]), (31 * 40_000_000, 0));
}

#[test]
fn the_same_happens_twice_and_something_else_with_another_seed() {
    let [first, second, other] = [None, None, Some("7")].map(|seed| took("delay 20ms loss 5%", seed, ""));
    assert_eq!(first, second);
    assert!(first["many"] > 31 * 40_000_000, "{first:?}");
    for name in ["many", "chances"] {
        assert_ne!(first[name], other[name], "{name}");
    }
}

/// Tokio itself reads clocks of the standard library, also where tokio drops a task that is woken. Packets arrive at whole milliseconds here, to which tokio
/// jumps.
#[test]
fn clocks_of_the_standard_library_wake_nothing() {
    assert_eq!(took("delay 20ms", None, "clocks random"), took("delay 20ms", None, ""));
}

/// The suite asks for virtual clocks of the standard library.
#[test]
fn clocks_of_the_standard_library_follow_where_the_environment_says_so() {
    for (words, is_virtual) in [("clocks random", true), ("", false)] {
        let output = run("foreign::by_the_clock", &[("COHAPTIC_TEST_LOOPBACK", "delay 20ms"), ("COHAPTIC_TEST_STD", words)]);
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && text.contains("the clock says "), "{text}");
        assert_eq!(text.contains("the clock says 100000000 ns"), is_virtual, "{text}");
    }
    let output = run("foreign::by_the_clock", &[("COHAPTIC_TEST_LOOPBACK", "delay 20ms"), ("COHAPTIC_TEST_STD", "clock")]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("COHAPTIC_TEST_STD says `clock`: expected `clocks`, `random`"));
}

/// A test bed in the same process keeps its own network and seed.
#[test]
fn a_test_bed_is_not_on_the_loopback() {
    let output = run("beds::select_repeats_with_the_seed", &[("COHAPTIC_TEST_LOOPBACK", "delay 20ms loss 5%")]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains("1 passed"), "{text}");
}

/// The variable may be set and empty.
#[test]
fn without_words_sockets_are_real() {
    let output = run("beds::sockets_are_real", &[("COHAPTIC_TEST_LOOPBACK", "")]);
    assert!(output.status.success() && String::from_utf8_lossy(&output.stdout).contains("1 passed"), "{output:?}");
}

#[test]
fn a_wrong_value_fails_with_the_variable_the_place_and_the_way_out() {
    let output = run("foreign::over_an_address", &[("COHAPTIC_TEST_LOOPBACK", "delay 20ms loss 1")]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    for part in [
        "COHAPTIC_TEST_LOOPBACK cannot be the loopback of the runtime of tokio at tests/foreign.rs:",
        "delay 20ms loss 1\n",
        "expected words of tc-netem such as `delay 20ms loss 1%`, or no variable for real sockets",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

/// The report of a failure says how to see it again.
#[test]
fn a_failure_names_its_seed() {
    let output = run("loopback::fails", &[("COHAPTIC_TEST_LOOPBACK", "delay 20ms loss 5%"), ("COHAPTIC_TEST_RUNS", "1")]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    assert!(text.contains("COHAPTIC_TEST_SEED=") && !text.contains("Testbed::new"), "{text}");
}

/// Fails when [`a_failure_names_its_seed`] runs it.
#[tokio::test]
async fn fails() {
    assert!(std::env::var_os("COHAPTIC_TEST_RUNS").is_none());
}

#[test]
fn a_suite_may_take_longer_than_an_hour_of_virtual_time() {
    let output = |limit| run("loopback::for_two_hours", &[("COHAPTIC_TEST_LOOPBACK", "delay 20ms"), ("COHAPTIC_TEST_LIMIT", limit)]);
    for (limit, expected) in
        [("3h", None), ("off", None), ("1h", Some("beyond its time limit of 3600s")), ("3", Some("COHAPTIC_TEST_LIMIT: no unit in"))]
    {
        let output = output(limit);
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() == expected.is_none() && text.contains(expected.unwrap_or_default()), "{limit}: {text}");
    }
}

/// Takes two hours of virtual time.
#[test]
fn for_two_hours() {
    if std::env::var_os("COHAPTIC_TEST_LIMIT").is_some() {
        tokio::runtime::Runtime::new().unwrap().block_on(async {
            tokio::time::sleep(std::time::Duration::from_secs(7200)).await;
        });
    }
}

#[test]
fn a_socket_before_block_on_is_refused() {
    let output = run("loopback::before_block_on", &[("COHAPTIC_TEST_LOOPBACK", "delay 20ms")]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && text.contains("a socket is made outside of `block_on`"), "{text}");
}

/// Fails when [`a_socket_before_block_on_is_refused`] runs it. On the real loopback the socket is made.
#[test]
fn before_block_on() {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let _entered = runtime.enter();
    let socket = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_nonblocking(true).unwrap();
    if let Err(error) = tokio::net::UdpSocket::from_std(socket) {
        panic!("{error}");
    }
}
