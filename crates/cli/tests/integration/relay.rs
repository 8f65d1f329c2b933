//! `cohaptic relay`: real datagrams of real programs. Delays have lower bounds, which hold on any machine; what links count is exact.

use std::net::{SocketAddr, UdpSocket};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::integration::desk::{Desk, parse};
use crate::integration::running::{Client, PATIENCE, Running, TOKEN, uninterrupted};

fn millis(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

fn socket() -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    socket
}

/// Starts a program that answers every datagram with the same bytes until a datagram says `stop`. The thread returns the number of answered datagrams.
fn echo() -> (SocketAddr, thread::JoinHandle<usize>) {
    let socket = socket();
    let address = socket.local_addr().unwrap();
    let answering = thread::spawn(move || {
        let mut buffer = [0; 2048];
        for answered in 0.. {
            let (length, from) = uninterrupted(|| socket.recv_from(&mut buffer)).unwrap();
            if &buffer[..length] == b"stop" {
                return answered;
            }
            socket.send_to(&buffer[..length], from).unwrap();
        }
        0
    });
    (address, answering)
}

/// Returns the round-trip time of a datagram with this content.
fn round_trip(client: &UdpSocket, to: SocketAddr, content: &[u8]) -> Duration {
    let begin = Instant::now();
    client.send_to(content, to).unwrap();
    let mut buffer = [0; 2048];
    let (length, from) = uninterrupted(|| client.recv_from(&mut buffer)).unwrap();
    assert_eq!((&buffer[..length], from), (content, to), "the answer comes from where the question went to");
    begin.elapsed()
}

/// Waits until `is_so` is true.
fn until(mut is_so: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < PATIENCE, "it never is so");
        thread::sleep(millis(5));
    }
}

/// The keys that every document has, with quantiles in order.
fn assert_contract(document: &Value) {
    let error = &document["release_error_us"];
    let quantiles = ["p50", "p99", "p999", "max"].map(|name| error[name].as_f64().unwrap_or_else(|| panic!("no {name} in {document:#}")));
    assert!(quantiles.is_sorted() && quantiles[0] >= 0.0, "{quantiles:?}");
    assert!(document["packets"].is_u64() && document["dropped"].is_u64(), "{document:#}");
}

#[test]
fn an_echo_through_a_proxy_is_never_too_early_either_way() {
    let (server, answering) = echo();
    let desk = Desk::new();
    let line = format!("relay --listen 127.0.0.1:0 --to {server} --json --no-priority delay 30ms --back delay=20ms");
    let running = Running::begin(desk.command(&line));
    let (port, purpose) = running.port();
    assert_eq!(purpose, server.to_string());
    let (first, second) = (socket(), socket());
    for number in 0..10_u8 {
        for client in [&first, &second] {
            assert!(round_trip(client, port, &[number; 100]) >= millis(50));
        }
    }
    let outcome = running.end_by("-INT");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    let document = parse(&outcome.stdout);
    assert_contract(&document);
    assert_eq!(
        (&document["form"], &document["ending"], &document["packets"], &document["dropped"]),
        (&"proxy".into(), &"interrupted".into(), &40.into(), &0.into())
    );
    let links = document["links"].as_array().unwrap();
    // The delays of links are logical: exactly what was asked.
    for (link, (from, to, delay)) in links.iter().zip([("client", "server", 0.03), ("server", "client", 0.02)]) {
        assert_eq!((&link["from"], &link["to"], &link["offered"], &link["delivered"]), (&from.into(), &to.into(), &20.into(), &20.into()));
        assert_eq!((&link["mean_delay_s"], &link["asked_mean_delay_s"], &link["changes"]), (&delay.into(), &delay.into(), &0.into()));
    }
    assert_eq!(document["release_error_us"]["count"], 40);
    socket().send_to(b"stop", server).unwrap();
    assert_eq!(answering.join().unwrap(), 20);
}

#[test]
fn a_signal_gives_the_report_in_words() {
    let (server, answering) = echo();
    let desk = Desk::new();
    let line = format!("relay --listen 127.0.0.1:0 --to {server} delay 1ms");
    let running = Running::begin(desk.command(&line));
    let (port, _) = running.port();
    assert!(round_trip(&socket(), port, b"hello") >= millis(2));
    let outcome = running.end_by("-TERM");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    for part in [
        format!("{port} -> {server}\n").as_str(),
        "2 datagrams arrived in ",
        ": 2 sent on, 0 dropped, 0 on the way at the end\n",
        "the run is ",
        "release error: p50 ",
        "client -> server: 1 offered, 1 delivered; mean delay 1.000 ms, asked 1.000 ms\n",
        "server -> client: 1 offered, 1 delivered; mean delay 1.000 ms, asked 1.000 ms\n",
        "timer slack",
    ] {
        assert!(outcome.stdout.contains(part), "no {part:?} in:\n{}", outcome.stdout);
    }
    // Nothing but what it listens on: standard error is no terminal.
    assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
    socket().send_to(b"stop", server).unwrap();
    answering.join().unwrap();
}

/// The report is the answer, and standard error is for errors alone.
#[test]
fn a_quiet_relay_says_nothing_but_its_report() {
    let desk = Desk::new();
    for words in ["", "--tcp "] {
        let outcome = desk.cohaptic(&format!("relay -q {words}--listen 127.0.0.1:0 --to 127.0.0.1:9 --for 10ms"));
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""), "{words}");
        assert!(outcome.stdout.contains(" -> 127.0.0.1:9\n"), "{}", outcome.stdout);
    }
}

#[test]
fn two_programs_of_a_file_speak_through_their_link_and_strangers_do_not() {
    let (left, right) = (socket(), socket());
    let left_at = left.local_addr().unwrap();
    let desk = Desk::with(
        "lab.toml",
        &format!(
            "relay = {{ title = \"two programs\", tolerance = \"10min\" }}\n\
             programs = [\n  {{ name = \"left\", port = \"127.0.0.1:0\", address = \"{left_at}\" }},\n  {{ name = \"right\", port = \"127.0.0.1:0\" }},\n]\n\
             link = {{ delay = \"5ms\" }}\nlinks = [{{ from = \"right\", to = \"left\", delay = \"1ms\" }}]\n"
        ),
    );
    desk.write("token", TOKEN);
    desk.set_mode("token", 0o600);
    let running = Running::begin(desk.command("relay lab.toml --set link.delay=40ms --json --no-priority --token-file token --control"));
    let (port_of_left, purpose) = running.port();
    assert_eq!(purpose, format!("left, which is at {left_at}"));
    let (port_of_right, purpose) = running.port();
    assert_eq!(purpose, "right, which is at wherever it first sends from");
    // It is known from now on.
    right.send_to(b"here", port_of_left).unwrap();
    let mut buffer = [0; 64];
    assert_eq!(uninterrupted(|| left.recv_from(&mut buffer)).unwrap(), (4, port_of_right));
    let begin = Instant::now();
    left.send_to(b"question", port_of_right).unwrap();
    assert_eq!(uninterrupted(|| right.recv_from(&mut buffer)).unwrap(), (8, port_of_left));
    assert!(begin.elapsed() >= millis(40));
    // A stranger is turned away.
    socket().send_to(b"?", port_of_right).unwrap();
    let control = Client::of(&running);
    until(|| control.json("GET", "/api/state", "")["refused"]["stranger"] == 1);
    let outcome = running.end_by("-INT");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    let document = parse(&outcome.stdout);
    assert_contract(&document);
    assert_eq!(
        (&document["title"], &document["form"], &document["ending"], &document["valid"]),
        (&"two programs".into(), &"mesh".into(), &"interrupted".into(), &true.into())
    );
    let [there, back] = [0, 1].map(|link: usize| &document["links"][link]);
    assert_eq!((&there["from"], &there["offered"], &there["mean_delay_s"]), (&"left".into(), &1.into(), &0.04.into()));
    assert_eq!((&back["from"], &back["offered"], &back["mean_delay_s"]), (&"right".into(), &1.into(), &0.001.into()));
    assert_eq!((&document["packets"], &document["dropped"], &document["refused"]["stranger"]), (&3.into(), &1.into(), &1.into()));
}

#[test]
fn a_link_is_changed_while_it_runs_and_what_makes_no_sense_changes_nothing() {
    let (server, answering) = echo();
    let desk = Desk::with("token", &format!("{TOKEN}\n"));
    desk.set_mode("token", 0o600);
    let line = format!("relay --listen 127.0.0.1:0 --to {server} --json --no-priority --token-file token delay=1ms --control");
    let running = Running::begin(desk.command(&line));
    let (port, _) = running.port();
    let control = Client::of(&running);
    let client = socket();
    assert!(round_trip(&client, port, b"before") >= millis(2));

    let (status, answer) = control.ask("PATCH", "/api/links/0", r#"{"los": "1%"}"#);
    assert!(status == 422 && answer.contains("los"), "{status} {answer}");
    let (status, answer) = control.ask("PATCH", "/api/links/0", r#"{"delay": "40 parsecs"}"#);
    assert!(status == 422 && answer.contains("parsecs"), "{status} {answer}");
    assert_eq!(control.ask_as("", "PATCH", "/api/links/0", r#"{"delay": "40ms"}"#).0, 401);
    assert_eq!(control.json("GET", "/api/links/0", "")["keys"], serde_json::json!({ "delay": "1ms" }));

    let changed = control.json("PATCH", "/api/links/0", r#"{"delay": "40ms"}"#);
    assert_eq!(changed["keys"], serde_json::json!({ "delay": "40ms" }));
    // It is taken up between two datagrams: from the first that the link itself says it delayed for longer than before, all are.
    let mut sent = 1;
    until(|| {
        round_trip(&client, port, b"meanwhile");
        sent += 1;
        control.json("GET", "/api/links/0", "")["mean_delay_s"].as_f64().is_some_and(|mean| mean > 0.001_001)
    });
    for _ in 0..5 {
        assert!(round_trip(&client, port, b"after") >= millis(41));
        sent += 1;
    }
    // Once a snapshot has all: the latest delays and the bytes are those of the link, too.
    until(|| control.json("GET", "/api/links/0", "")["delivered"] == sent);
    let link = control.json("GET", "/api/links/0", "");
    let recent = &link["recent_delay"];
    assert_eq!((&recent["count"], &recent["max_s"]), (&sent.min(128).into(), &0.04.into()), "{link:#}");
    // The lengths of "before", "meanwhile" and "after".
    assert_eq!(link["delivered_bytes"], 6 + 9 * (sent - 6) + 5 * 5);
    let (status, metrics) = control.ask("GET", "/metrics", "");
    assert_eq!(status, 200);
    assert!(metrics.contains("cohaptic_run_info{kind=\"relay\"") && metrics.contains("cohaptic_link_offered_packets_total{"), "{metrics}");
    assert!(metrics.contains("from=\"client\",to=\"server\""), "{metrics}");

    let outcome = running.end_by("-INT");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    let document = parse(&outcome.stdout);
    let [there, back] = [0, 1].map(|link: usize| &document["links"][link]);
    assert_eq!((&there["offered"], &there["changes"], &there["asked_mean_delay_s"]), (&sent.into(), &1.into(), &0.001.into()));
    assert_eq!((&back["offered"], &back["changes"], &back["mean_delay_s"]), (&sent.into(), &0.into(), &0.001.into()));
    socket().send_to(b"stop", server).unwrap();
    answering.join().unwrap();
}

#[test]
fn what_a_seeded_link_loses_is_dropped_and_counted() {
    let server = socket();
    let desk = Desk::with("token", TOKEN);
    desk.set_mode("token", 0o600);
    let to = server.local_addr().unwrap();
    let line = format!("relay --listen 127.0.0.1:0 --to {to} --json --no-priority --seed 3 loss 50% --token-file token --control");
    let run = || {
        let running = Running::begin(desk.command(&line));
        let (port, _) = running.port();
        let (control, client) = (Client::of(&running), socket());
        (0..100_u8).for_each(|number| assert_eq!(client.send_to(&[number], port).unwrap(), 1));
        until(|| control.json("GET", "/api/links/0", "")["offered"] == 100);
        let document = parse(&running.end_by("-INT").stdout);
        let link = &document["links"][0];
        assert_eq!((&document["packets"], &link["offered"]), (&100.into(), &100.into()), "{document:#}");
        assert_eq!(link["delivered"].as_u64().unwrap() + link["dropped"]["loss"].as_u64().unwrap(), 100);
        assert_eq!(document["dropped"], link["dropped"]["loss"]);
        let mut buffer = [0; 8];
        let delivered = (0..link["delivered"].as_u64().unwrap()).map(|_| {
            uninterrupted(|| server.recv_from(&mut buffer)).unwrap();
            buffer[0]
        });
        delivered.collect::<Vec<u8>>()
    };
    let first = run();
    assert!((20..80).contains(&first.len()), "{first:?}");
    assert_eq!(first, run(), "the same seed loses the same datagrams");
}

#[test]
fn bad_arguments_are_refused() {
    let desk = Desk::with(
        "lab.toml",
        "programs = [\n  { name = \"a\", port = \"127.0.0.1:0\" },\n  { name = \"b\", port = \"127.0.0.1:0\" },\n]\nlink = { delay = \"24 parsecs\" }\n",
    );
    let proxy = "relay --listen 127.0.0.1:0 --to 127.0.0.1:9";
    for (line, parts) in [
        ("relay", &["<FILE | SPEC>"][..]),
        ("relay delay 24ms", &["\"delay 24ms\" is not a file", "--listen and --to"]),
        ("relay --listen 127.0.0.1:0", &["--to <ADDRESS>"]),
        ("relay lab.toml --to 127.0.0.1:9", &["--listen <ADDRESS>"]),
        ("relay lab.toml --back delay=1ms", &["--listen <ADDRESS>"]),
        ("relay lab.toml", &["lab.toml:5:18: link.delay: unknown unit \"parsecs\"", "link = { delay = \"24 parsecs\" }", "^"]),
        ("relay lab.toml --set link.delay=1ms --set los=1", &["--set los=1", "unknown key"]),
        ("relay lab.toml --set link.delay=1ms --for 0s", &["--for 0s", "a time above zero"]),
        ("relay lab.toml --packets 0", &["--packets"]),
        ("relay lab.toml --bytes 10B", &["--bytes", "65535B"]),
        (&format!("{proxy} delay 24 parsecs"), &["these words do not describe a link", "^"]),
        (&format!("{proxy} los=1%"), &["los=1%", "unknown key"]),
        (&format!("{proxy} delay=1ms --back delay=1"), &["delay=1", "expected"]),
        (&format!("{proxy} starlink"), &["starlink differs by direction", "starlink/down, towards the user, or starlink/up"]),
        (&format!("{proxy} starlink/down --back starlnk/up"), &["did you mean starlink, a link of the library"]),
        (&format!("{proxy} --set link.delay=1ms"), &["--set", "cannot be used with"]),
        (&format!("{proxy} --token-file token"), &["--control"]),
        ("relay --listen 0.0.0.0:0 --to 127.0.0.1:9", &["--listen 0.0.0.0:0 is not on loopback", "--allow-remote"]),
        ("relay --listen 127.0.0.1:0 --to 192.0.2.1:9", &["--to 192.0.2.1:9 is not on loopback", "--allow-remote"]),
        ("relay --listen 127.0.0.1:0 --to 127.0.0.1:0", &["--to 127.0.0.1:0", "not 0"]),
        ("relay lab.toml --set link.delay=1ms --set programs.a.port=0.0.0.0:0", &["allow-remote"]),
        ("relay --listen 127.0.0.1:7000 --to localhost:7000", &["127.0.0.1:7000 is a port of the relay itself", "expected the address of a program"]),
        ("relay --listen [::]:7000 --to [::1]:7000 --allow-remote", &["[::1]:7000 is a port of the relay itself, [::]:7000"]),
    ] {
        desk.cohaptic_within(PATIENCE, line).assert_refused(2, parts);
    }
    desk.cohaptic("relay nothing.toml").assert_refused(3, &["nothing.toml"]);
}

#[test]
fn a_port_that_is_taken_is_an_error_of_the_system() {
    let taken = socket();
    let address = taken.local_addr().unwrap();
    let outcome = Desk::new().cohaptic(&format!("relay --listen {address} --to 127.0.0.1:9"));
    outcome.assert_refused(3, &[&format!("cannot listen on {address}"), "in use", "expected a free UDP port"]);
}

#[test]
fn other_machines_are_let_in_only_if_that_is_said() {
    let desk = Desk::with("lab.toml", "programs = [{ name = \"a\", port = \"0.0.0.0:0\" }, { name = \"b\", port = \"127.0.0.1:0\" }]\n");
    for line in ["relay --listen 0.0.0.0:0 --to 127.0.0.1:9", "relay lab.toml"] {
        let outcome = desk.cohaptic(&format!("{line} --allow-remote --no-priority --for 10ms --json --control 0.0.0.0:0"));
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        assert!(outcome.stderr.starts_with("listening on 0.0.0.0:"), "{}", outcome.stderr);
        // The address that others use, on a machine that has a network.
        let has_network = UdpSocket::bind("0.0.0.0:0").and_then(|socket| socket.connect("192.0.2.1:9")).is_ok();
        for said in ["programs on other machines send to ", "live control, from other machines: http://"] {
            let address = outcome.stderr.lines().find_map(|line| line.strip_prefix(said));
            assert_eq!(address.is_some(), has_network, "{}", outcome.stderr);
            assert!(address.is_none_or(|address| !address.starts_with("0.0.0.0") && !address.starts_with("127.")), "{}", outcome.stderr);
        }
        let document = parse(&outcome.stdout);
        assert_contract(&document);
        assert_eq!((&document["ending"], &document["packets"]), (&"complete".into(), &0.into()));
        assert!(document["duration_s"].as_f64().unwrap() >= 0.01);
    }
}

#[test]
fn help_names_every_option() {
    let text = Desk::new().text("relay --help");
    let words: Vec<&str> = text.split_whitespace().collect();
    let text = words.join(" ");
    for part in [
        "relay [OPTIONS] <FILE>",
        "--listen <ADDRESS> --to <ADDRESS> [SPEC]... [--back <SPEC>...]",
        "--set <KEY=VALUE>",
        "--json",
        "--for <TIME>",
        "--seed <N>",
        "--packets <N>",
        "--bytes <SIZE>",
        "--spin",
        "--no-priority",
        "--tolerance <TIME>",
        "--control [<ADDRESS>]",
        "--token-file <FILE>",
        "--allow-remote",
        "Exit status: 0 done",
    ] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
}
