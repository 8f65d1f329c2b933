//! `cohaptic router`, with real packets between hosts in network namespaces that the tests create. On a system that allows no namespaces, the tests are skipped
//! with a message.
#![expect(clippy::print_stdout, reason = "a test that is skipped says why, and a host says what it was asked")]

use std::env;
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::UdpSocket;
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use crate::integration::desk::{Desk, Outcome, parse};
use crate::integration::running::{Client, PATIENCE, Running, TOKEN};

/// Variable that is set in a process in namespaces of its own.
const INSIDE: &str = "COHAPTIC_CLI_TEST_INSIDE";
/// Variable that is set in a process that plays a host.
const HOST: &str = "COHAPTIC_CLI_TEST_HOST";

/// Returns a router file with a link of 10 ms between two devices. `left` and `right` are further keys of the sides, such as their namespaces.
fn file(left: &str, right: &str) -> String {
    format!(
        "[router]\ndefault = \"wan\"\n\
         [left]\ntun = \"left0\"\naddresses = [\"10.1.0.1/24\"]\n{left}\n\
         [right]\ntun = \"right0\"\naddresses = [\"10.1.0.2/24\"]\n{right}\n\
         [links.wan]\ndelay = \"10ms\"\n"
    )
}

/// Runs the test of that name again in a process with a network and a user of its own; says whether this is that process.
pub(crate) fn is_inside(name: &str) -> bool {
    if env::var_os(INSIDE).is_some() {
        return true;
    }
    let can = |arguments: &[&str]| Command::new("unshare").args(arguments).stderr(Stdio::null()).status().is_ok_and(|status| status.success());
    if !can(&["-Urn", "true"]) || !can(&["-Urn", "unshare", "-n", "true"]) {
        println!("skipped: this system allows no network namespaces (`unshare -Urn true` fails)");
        return false;
    }
    if let Err(error) = fs::OpenOptions::new().read(true).write(true).open("/dev/net/tun") {
        println!("skipped: /dev/net/tun cannot be opened: {error}");
        return false;
    }
    let mut command = Command::new("unshare");
    command.args(["-Urn", "--"]).arg(env::current_exe().unwrap()).args([name, "--exact", "--nocapture"]).env(INSIDE, "1");
    // Each of its own waits ends after a minute.
    let outcome = Running::begin(command).end_within(5 * PATIENCE);
    assert_eq!(outcome.status, Some(0), "{}\n{}", outcome.stdout, outcome.stderr);
    // A wrong name would select no test, which succeeds.
    assert!(outcome.stdout.contains("1 passed"), "{name}: {}", outcome.stdout);
    false
}

/// Host: a process with a network of its own, which sends and answers by orders.
struct Host {
    child: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Host {
    fn new() -> Self {
        let mut command = Command::new("unshare");
        command.args(["-n", "--"]).arg(env::current_exe().unwrap()).args(["integration::router::be_a_host", "--exact", "--nocapture"]).env(HOST, "1");
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (orders, answers) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        let mut host = Self { child, orders, answers };
        // It is where it belongs when it speaks.
        assert_eq!(host.answer(), "ready");
        host
    }

    /// Returns the line of a router file that names the namespace of this host.
    fn namespace(&self) -> String {
        format!("namespace = \"/proc/{}/ns/net\"", self.child.id())
    }

    fn order(&mut self, order: &str) {
        writeln!(self.orders, "{order}").unwrap();
    }

    /// Returns the next answer of the host. Other lines, which the test framework of the process prints, are skipped.
    fn answer(&mut self) -> String {
        loop {
            let mut line = String::new();
            assert_ne!(self.answers.read_line(&mut line).unwrap(), 0, "the host is gone");
            if let Some((_, answer)) = line.trim_end().split_once("host: ") {
                return answer.to_owned();
            }
        }
    }

    /// Returns the round-trip time of a datagram.
    fn round_trip(&mut self) -> Duration {
        self.order("ask");
        Duration::from_nanos(self.answer().parse().unwrap())
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

/// Program of a [`Host`], as a test that does nothing unless its process is a host.
#[test]
fn be_a_host() {
    if env::var_os(HOST).is_none() {
        return;
    }
    println!("host: ready");
    let socket = |address: &str| {
        let socket = UdpSocket::bind(address).unwrap();
        socket.set_read_timeout(Some(PATIENCE)).unwrap();
        socket
    };
    let mut asking = None;
    for order in std::io::stdin().lines().map_while(Result::ok) {
        let mut buffer = [0; 64];
        match order.as_str() {
            "answer" => {
                let socket = socket("10.1.0.2:7000");
                println!("host: answers");
                loop {
                    let (length, from) = socket.recv_from(&mut buffer).unwrap();
                    socket.send_to(&buffer[..length], from).unwrap();
                }
            }
            _ => {
                let socket = asking.get_or_insert_with(|| socket("10.1.0.1:0"));
                let begin = Instant::now();
                socket.send_to(b"question", "10.1.0.2:7000").unwrap();
                assert_eq!(socket.recv_from(&mut buffer).unwrap().0, 8);
                println!("host: {}", begin.elapsed().as_nanos());
            }
        }
    }
}

#[test]
fn packets_cross_the_link_and_one_direction_is_changed_while_it_runs() {
    if !is_inside("integration::router::packets_cross_the_link_and_one_direction_is_changed_while_it_runs") {
        return;
    }
    // Live control is reached over the loopback interface, which is down in a network that is new.
    if !Command::new("ip").args(["link", "set", "lo", "up"]).status().is_ok_and(|status| status.success()) {
        println!("skipped: `ip link set lo up` fails");
        return;
    }
    let (mut left, mut right) = (Host::new(), Host::new());
    let desk = Desk::with("lab.toml", &file(&left.namespace(), &right.namespace()));
    desk.write("token", TOKEN);
    desk.set_mode("token", 0o600);
    let running = Running::begin(desk.command("router lab.toml --json --no-priority --tolerance 10min --token-file token --control"));
    let between = running.said("between ");
    assert!(between.starts_with("left (tun left0 in the namespace /proc/") && between.contains(" and right (tun right0 in "), "{between}");
    let control = Client::of(&running);
    right.order("answer");
    assert_eq!(right.answer(), "answers");
    assert!(left.round_trip() >= Duration::from_millis(20));

    let names = |link: usize| control.json("GET", &format!("/api/links/{link}"), "")["name"].clone();
    assert_eq!([names(0), names(1)], ["wan.left->wan.right", "wan.right->wan.left"]);
    let (status, answer) = control.ask("PATCH", "/api/links/1", r#"{"delais": "1ms"}"#);
    assert!(status == 422 && answer.contains("delais"), "{status} {answer}");
    control.json("PATCH", "/api/links/1", r#"{"delay": "50ms"}"#);
    assert_eq!(control.json("GET", "/api/links/0", "")["keys"], serde_json::json!({ "delay": "10ms" }));
    assert_eq!(control.json("GET", "/api/links/1", "")["keys"], serde_json::json!({ "delay": "50ms" }));
    let begin = Instant::now();
    // As soon as the link itself says that it delays for longer, it does so with all.
    loop {
        left.round_trip();
        if control.json("GET", "/api/links/1", "")["mean_delay_s"].as_f64().is_some_and(|mean| mean > 0.010_001) {
            break;
        }
        assert!(begin.elapsed() < PATIENCE, "the change is not taken up");
    }
    for _ in 0..3 {
        assert!(left.round_trip() >= Duration::from_millis(60));
    }
    let (_, metrics) = control.ask("GET", "/metrics", "");
    assert!(metrics.contains("cohaptic_run_info{kind=\"router\""), "{metrics}");

    let outcome = running.end_by("-INT");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    let document = parse(&outcome.stdout);
    let count =
        |pointer: &str| document.pointer(pointer).and_then(serde_json::Value::as_u64).unwrap_or_else(|| panic!("no {pointer} in {document:#}"));
    let error = ["p50", "p99", "p999", "max"].map(|name| document["release_error_us"][name].as_f64().unwrap());
    assert!(error.is_sorted(), "{error:?}");
    assert_eq!((&document["ending"], &document["valid"], &document["links"][0]["name"]), (&"interrupted".into(), &true.into(), &"wan".into()));
    // Everything takes the link: what came from a side was offered from there. Hosts send packets of their own, too.
    assert_eq!(count("/packets"), count("/links/0/offered") + count("/links/1/offered"));
    assert!(count("/links/0/delivered") >= 5 && count("/links/1/delivered") >= 5, "{document:#}");
    assert_eq!((&document["links"][0]["mean_delay_s"], &document["links"][0]["changes"]), (&0.01.into(), &0.into()));
    assert_eq!((&document["links"][1]["asked_mean_delay_s"], &document["links"][1]["changes"]), (&0.01.into(), &1.into()));
    for (link, side) in [(0, 1), (1, 0)] {
        assert_eq!(count(&format!("/links/{link}/delivered")), count(&format!("/sides/{side}/written/packets")));
    }
}

#[test]
fn it_ends_by_itself_and_says_what_it_did_in_words() {
    if !is_inside("integration::router::it_ends_by_itself_and_says_what_it_did_in_words") {
        return;
    }
    let desk = Desk::with("lab.toml", &file("", ""));
    let outcome = desk.cohaptic("router lab.toml --for 100ms --set links.wan.delay=1ms");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert_eq!(outcome.stderr, "between left (tun left0) and right (tun right0)\n");
    for part in ["lab.toml\n", " packets arrived in ", "the run is ", "  left (tun left0): ", "  wan, left -> right: ", "  wan, right -> left: "] {
        assert!(outcome.stdout.contains(part), "no {part:?} in:\n{}", outcome.stdout);
    }
    // A device that somebody has already is refused.
    let taken = desk.cohaptic("router lab.toml --for 10ms --set right.tun=left0");
    assert!(taken.status == Some(2) || taken.status == Some(3), "{taken:?}");
}

#[test]
fn without_the_right_to_make_devices_it_says_how_to_get_it() {
    let desk = Desk::with("lab.toml", &file("", ""));
    let may = Command::new("unshare").args(["-U", "true"]).stderr(Stdio::null()).status().is_ok_and(|status| status.success());
    if !may || !Path::new("/dev/net/tun").exists() {
        println!("skipped: this system allows no user namespaces, or has no /dev/net/tun");
        return;
    }
    // A user who has no rights over the network that it is in.
    let mut command = Command::new("unshare");
    let cohaptic = desk.command("router lab.toml --for 10ms");
    command.arg("-U").arg(cohaptic.get_program()).args(cohaptic.get_args()).current_dir(desk.path("."));
    let outcome = Outcome::of(command.output().unwrap());
    outcome.assert_refused(3, &["left, device left0: cannot ", "CAP_NET_ADMIN", "unshare --map-root-user --net"]);
}

#[test]
fn bad_arguments_are_refused() {
    let desk = Desk::with("lab.toml", &file("", "").replace("10ms", "10 parsecs"));
    for (line, parts) in [
        ("router", &["<FILE>"][..]),
        ("router lab.toml", &["lab.toml:12:9: links.wan.delay: unknown unit \"parsecs\"", "delay = \"10 parsecs\"", "^"]),
        ("router lab.toml --set links.wan.delay=1ms --set router.default=lan", &["--set router.default=lan", "lan"]),
        ("router lab.toml --set links.wan.delay=1ms --for 0s", &["--for 0s", "a time above zero"]),
        ("router lab.toml --token-file token", &["--control"]),
    ] {
        desk.cohaptic_within(PATIENCE, line).assert_refused(2, parts);
    }
    desk.cohaptic("router nothing.toml").assert_refused(3, &["nothing.toml"]);
}

#[test]
fn help_names_every_option() {
    let text = Desk::new().text("router --help");
    for part in [
        "<FILE>",
        "--set <KEY=VALUE>",
        "--json",
        "--for <TIME>",
        "--spin",
        "--no-priority",
        "--tolerance <TIME>",
        "--control",
        "--token-file <FILE>",
        "Exit status: 0",
    ] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
}
