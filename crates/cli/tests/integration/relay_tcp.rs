//! `cohaptic relay --tcp`: real connections of real programs. Delays have lower bounds, which hold on any machine; what is counted is exact.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use crate::integration::desk::{Desk, parse};
use crate::integration::running::{Client, PATIENCE, Running, TOKEN};

/// Starts a program that sends everything back, one client after the other.
fn echo() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let mut buffer = [0; 4096];
            while let Ok(count @ 1..) = stream.read(&mut buffer) {
                stream.write_all(&buffer[..count]).unwrap();
            }
        }
    });
    address
}

fn connect(to: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(to).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

/// Sends a text, ends the stream, and returns all that comes back, with the time that it took.
fn ask(to: SocketAddr, text: &str) -> (String, Duration) {
    let begun = Instant::now();
    let mut stream = connect(to);
    stream.write_all(text.as_bytes()).unwrap();
    stream.shutdown(Shutdown::Write).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    (answer, begun.elapsed())
}

#[test]
fn an_echo_is_never_too_early_and_every_byte_is_counted() {
    let server = echo();
    let running = Running::begin(Desk::new().command(&format!("relay --tcp --listen 127.0.0.1:0 --to {server} --json delay 30ms --back delay=20ms")));
    let (port, purpose) = running.port();
    assert_eq!(purpose, server.to_string());
    let (answer, time) = ask(port, "hello");
    assert!(answer == "hello" && time >= Duration::from_millis(50), "{answer:?} {time:?}");
    let outcome = running.end_by("-INT");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    let document = parse(&outcome.stdout);
    assert_eq!((&document["schema"], &document["ending"], &document["open"]), (&"cohaptic/relay-tcp".into(), &"interrupted".into(), &0.into()));
    let proxy = &document["proxies"][0];
    assert_eq!((&proxy["connections"]["opened"], &proxy["connections"]["ended"]), (&1.into(), &1.into()));
    // The delays of lines are logical: exactly what was asked.
    for (line, (from, delay)) in proxy["lines"].as_array().unwrap().iter().zip([("client", 0.03), ("server", 0.02)]) {
        assert_eq!(
            (&line["from"], &line["received_bytes"], &line["sent_bytes"], &line["lost_bytes"]),
            (&from.into(), &5.into(), &5.into(), &0.into())
        );
        assert_eq!((&line["mean_delay_s"], &line["asked_mean_delay_s"], &line["changes"]), (&delay.into(), &delay.into(), &0.into()));
    }
}

#[test]
fn a_file_has_several_proxies_and_the_report_says_how_connections_ended() {
    let server = echo();
    let text = format!(
        "[[proxies]]\nname = \"plain\"\nlisten = \"127.0.0.1:0\"\nto = \"{server}\"\nforth = {{ delay = \"1ms\" }}\n\
         [[proxies]]\nname = \"broken\"\nlisten = \"127.0.0.1:0\"\nto = \"{server}\"\nback = {{ cut-after = \"3B\" }}\n"
    );
    let desk = Desk::with("two.toml", &text);
    let running = Running::begin(desk.command("relay --tcp two.toml"));
    let ((plain, _), (broken, _)) = (running.port(), running.port());
    assert_eq!(ask(plain, "hello").0, "hello");
    assert_eq!(ask(broken, "hello").0, "hel");
    let outcome = running.end_by("-TERM");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    for part in [
        "two\n  2 connections in ",
        &format!("plain ({plain} -> {server}): connections: 1 ended\n"),
        "plain/client -> plain/server: 5B received, 5B sent; mean delay 1.000 ms, asked 1.000 ms\n",
        &format!("broken ({broken} -> {server}): connections: 1 by cut-after\n"),
        "broken/server -> broken/client: 5B received, 3B sent, 2B lost; ",
    ] {
        assert!(outcome.stdout.contains(part), "no {part:?} in:\n{}", outcome.stdout);
    }
}

#[test]
fn live_control_changes_streams_and_their_faults() {
    let server = echo();
    let desk = Desk::with("token", TOKEN);
    desk.set_mode("token", 0o600);
    let running = Running::begin(desk.command(&format!("relay --tcp --listen 127.0.0.1:0 --to {server} --json --token-file token --control")));
    let (port, _) = running.port();
    let control = Client::of(&running);
    assert_eq!(ask(port, "hello").0, "hello");
    let (status, said) = control.ask("PATCH", "/api/links/0", "{\"loss\":\"1%\"}");
    assert!(status == 422 && said.contains("cohaptic exec"), "{status} {said}");
    let (status, said) = control.ask("PATCH", "/api/links/0", "{\"reset-after\":\"0s\"}");
    assert_eq!(status, 200, "{said}");
    let begun = Instant::now();
    // The change is made at the latest at the next look of the relay.
    loop {
        assert!(begun.elapsed() < PATIENCE);
        let mut client = connect(port);
        // A connection from before the change answers.
        let _ = client.write_all(b"x");
        match client.read(&mut [0]) {
            Err(error) if error.kind() == ErrorKind::ConnectionReset => break,
            // The reset came before the write, which has taken its error.
            Ok(0) => break,
            _ => thread::sleep(Duration::from_millis(5)),
        }
    }
    let document = parse(&running.end_by("-INT").stdout);
    assert_eq!(document["proxies"][0]["lines"][0]["changes"], 1);
    assert!(document["proxies"][0]["connections"]["reset_after"].as_u64() >= Some(1), "{document:#}");
}

#[test]
fn bad_arguments_are_refused_with_the_way_out() {
    let desk = Desk::with("udp.toml", "programs = [{ name = \"a\", port = \"127.0.0.1:0\" }, { name = \"b\", port = \"127.0.0.1:0\" }]\n");
    let pair = "relay --tcp --listen 127.0.0.1:0 --to 127.0.0.1:9";
    for (line, parts) in [
        (format!("{pair} delay 20ms loss 1%"), &["loss", "sees no packets", "cohaptic exec or cohaptic router"][..]),
        (format!("{pair} loss=1%"), &["loss=1%", "cohaptic exec or cohaptic router"]),
        (format!("{pair} delay 20ms limit 100"), &["limit", "buffer = \"64kB\""]),
        (format!("{pair} delay 24 parsecs"), &["these words do not describe a link", "^"]),
        (format!("{pair} stall"), &["expected stall AFTER [LENGTH]"]),
        (format!("{pair} stall 2s for 200%"), &["200%"]),
        (format!("{pair} delay 2ms for 10%"), &["expected a fault such as stall before it"]),
        (format!("{pair} --packets 9"), &["--tcp", "--packets"]),
        (format!("{pair} --spin"), &["--tcp", "--spin"]),
        ("relay --tcp udp.toml".to_owned(), &["udp.toml:1:1: programs: unknown key", "relay", "proxies"]),
        ("relay --tcp stall 2s".to_owned(), &["\"stall 2s\" is not a file", "--listen and --to"]),
        ("relay --tcp --listen 127.0.0.1:0 --to 192.0.2.1:9".to_owned(), &["--to 192.0.2.1:9 is not on loopback", "--allow-remote"]),
    ] {
        desk.cohaptic_within(PATIENCE, &line).assert_refused(2, parts);
    }
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    desk.cohaptic(&format!("relay --tcp --listen {address} --to 127.0.0.1:9")).assert_refused(3, &[&format!("cannot listen on {address}"), "in use"]);
}
