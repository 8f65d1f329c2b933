//! Floods of strangers and of guests: the host's page answers during each flood.

use core::net::SocketAddr;
use core::time::Duration;
use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::sync::Arc;
use std::thread;
use std::time::Instant;

use cohaptic_control::{Hands, Role, Server, ServerConfig, Stage, StageFile, serve_stage};
use serde_json::Value;

use crate::run::{NoLinks, TOKEN, empty_board};

/// Longer than an answer takes on a busy machine, and shorter than the 10 s after which the server ends a slow connection.
const SOON: Duration = Duration::from_secs(8);

/// Stage on which hands move nothing, for guests who only watch.
struct Onlookers;

impl Hands for Onlookers {
    fn frame(&self, _: Option<usize>) -> (u64, Arc<str>) {
        (0, Arc::from(""))
    }

    fn take_hand(&self, _: Option<usize>) -> Result<usize, String> {
        Ok(0)
    }

    fn move_hand(&self, _: usize, _: Option<[f64; 3]>) -> Result<(), String> {
        Ok(())
    }

    fn leave_hand(&self, _: usize) {}
}

impl Stage for Onlookers {
    fn facts(&self, _: Role) -> Value {
        Value::Null
    }

    fn begin_anew(&self, _: &Value) -> Result<(), String> {
        Ok(())
    }

    fn compare(&self) -> Result<Value, String> {
        Ok(Value::Null)
    }

    fn file(&self, _: &str) -> Option<StageFile> {
        None
    }
}

struct Flooded(Server);

impl Flooded {
    fn new() -> Self {
        let config = ServerConfig { token: Some(TOKEN.parse().unwrap()), ..ServerConfig::new(([127, 0, 0, 1], 0).into()) };
        Self(serve_stage(config, empty_board(), Box::new(NoLinks), Arc::new(Onlookers)).unwrap())
    }

    fn address(&self) -> SocketAddr {
        self.0.address()
    }

    /// Returns the query with the token of guests.
    fn guest(&self) -> String {
        self.0.join_url().unwrap().split_once('?').unwrap().1.to_owned()
    }

    /// Opens connections, sends `text` on each, and keeps the connections open.
    fn send(&self, count: usize, text: &str) -> Vec<TcpStream> {
        (0..count).map(|_| self.connect(text)).collect()
    }

    fn connect(&self, text: &str) -> TcpStream {
        let mut stream = TcpStream::connect(self.address()).unwrap();
        stream.set_read_timeout(Some(SOON)).unwrap();
        stream.set_write_timeout(Some(Duration::from_millis(50))).unwrap();
        // A connection ended at once cannot be written to, which is fine.
        let _said = stream.write_all(text.as_bytes());
        stream
    }

    /// Asks for the page several times as the host.
    fn assert_answers(&self, flood: &str) {
        for path in ["/", "/api/state", "/"] {
            let begun = Instant::now();
            let mut stream = self.connect(&request(path, &format!("token={TOKEN}")).replace("\r\n\r\n", "\r\nConnection: close\r\n\r\n"));
            let mut answer = String::new();
            let read = stream.read_to_string(&mut answer);
            assert!(read.is_ok() && answer.starts_with("HTTP/1.1 200 "), "{flood}, {path}: {read:?} {answer}");
            assert!(begun.elapsed() < SOON, "{flood}, {path}: {:?}", begun.elapsed());
        }
        let mut hand = self.connect(&upgrade(&format!("token={TOKEN}")));
        let mut answered = [0; 12];
        hand.read_exact(&mut answered).unwrap();
        assert_eq!(&answered, b"HTTP/1.1 101", "{flood}");
    }
}

fn request(path: &str, query: &str) -> String {
    format!("GET {path}?{query} HTTP/1.1\r\nHost: localhost\r\n\r\n")
}

fn upgrade(query: &str) -> String {
    let head = format!("GET /api/hand?hand=none&{query} HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n");
    head + "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
}

#[test]
fn strangers_who_say_nothing_or_half_of_it_keep_nobody_out() {
    let floods = [
        ("idle connections", ""),
        ("half requests", "GET / HTTP/1.1\r\nHost: local"),
        ("bodies that do not come", "POST /api/play HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n{"),
    ];
    // At the same time, because each flood waits: 300 connections overflow the queue of the listener, and the kernel repeats a SYN only after a second.
    thread::scope(|scope| {
        for (flood, text) in floods {
            scope.spawn(move || {
                let server = Flooded::new();
                let _open = server.send(300, text);
                server.assert_answers(flood);
            });
        }
    });
}

#[test]
fn guests_who_stay_or_do_not_read_keep_nobody_out() {
    let server = Flooded::new();
    let guest = server.guest();
    let body = format!("GET /api/state?{guest} HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000\r\n\r\n{{");
    for (flood, text) in [
        ("events", request("/api/events", &guest)),
        ("hands", upgrade(&guest)),
        ("bodies that do not come", body),
        ("answers that nobody reads", request("/", &guest).repeat(100)),
    ] {
        let open = server.send(80, &text);
        server.assert_answers(flood);
        drop(open);
    }
}

#[test]
fn guests_have_as_many_places_as_there_are_and_get_them_back() {
    let server = Flooded::new();
    let events = request("/api/events", &server.guest());
    let mut open = server.send(64, &events);
    let mut answered = [0; 12];
    for stream in &mut open {
        stream.read_exact(&mut answered).unwrap();
        assert_eq!(&answered, b"HTTP/1.1 200");
    }
    let mut answer = String::new();
    server.connect(&events).read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 503 ") && answer.contains("too many connections"), "{answer}");
    drop(open);
    let begun = Instant::now();
    loop {
        server.connect(&events).read_exact(&mut answered).unwrap();
        if &answered == b"HTTP/1.1 200" {
            break;
        }
        assert!(begun.elapsed() < SOON, "the places are never free");
    }
}

/// A recording may be large, and the server keeps an answer until it is read.
#[test]
fn the_record_is_for_the_host_alone() {
    let server = Flooded::new();
    for (query, status) in [(server.guest(), "403"), (format!("token={TOKEN}"), "404")] {
        let mut answered = [0; 12];
        server.connect(&request("/api/files/inputs.csv", &query)).read_exact(&mut answered).unwrap();
        assert_eq!(answered, format!("HTTP/1.1 {status}").as_bytes());
    }
}

/// A message with endless empty parts never ends, so a limit of messages would never end the connection.
#[test]
fn a_message_of_endless_empty_parts_ends_the_connection() {
    let server = Flooded::new();
    let mut hand = server.connect(&upgrade(&server.guest()));
    let mut answered = [0; 12];
    hand.read_exact(&mut answered).unwrap();
    assert_eq!(&answered, b"HTTP/1.1 101");
    hand.set_write_timeout(Some(SOON)).unwrap();
    // The first frame of a text, then empty continuation frames, each with a mask of zeros.
    hand.write_all(&[0x01, 0x80, 0, 0, 0, 0]).unwrap();
    let parts = [0x00, 0x80, 0, 0, 0, 0].repeat(10_000);
    let begun = Instant::now();
    let ended = loop {
        match hand.write_all(&parts) {
            Ok(()) => assert!(begun.elapsed() < SOON, "it is never closed"),
            Err(error) => break error,
        }
    };
    assert!(matches!(ended.kind(), ErrorKind::ConnectionReset | ErrorKind::BrokenPipe), "{ended}");
    server.assert_answers("a message without end");
}
