//! Routes of a study over real sockets: who may ask for what, and what goes over the WebSocket of a person.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use cohaptic_control::{Guests, Hands, Server, ServerConfig, Study, Token, serve_study};
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use crate::run::{NoLinks, TOKEN, empty_board};

const PATIENCE: Duration = Duration::from_secs(60);
const ORIGIN: &str = "http://evil.example";

/// Study that records the calls of the server.
#[derive(Default)]
struct Recorder {
    told: Mutex<Vec<String>>,
    news: Mutex<(u64, String)>,
    /// Whether no hand can be taken yet.
    is_early: AtomicBool,
}

impl Recorder {
    fn note(&self, words: String) {
        self.told.lock().unwrap().push(words);
    }

    fn wait(&self, words: &str) {
        let begin = std::time::Instant::now();
        while !self.told.lock().unwrap().iter().any(|told| told == words) {
            assert!(begin.elapsed() < PATIENCE, "{words}: {:?}", self.told.lock().unwrap());
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Hands for Recorder {
    fn frame(&self, _: Option<usize>) -> (u64, Arc<str>) {
        (1, r#"{"peers":[]}"#.into())
    }

    fn has_begun(&self) -> bool {
        !self.is_early.load(Ordering::Relaxed)
    }

    fn take_hand(&self, wanted: Option<usize>) -> Result<usize, String> {
        self.note(format!("took {wanted:?}"));
        wanted.ok_or_else(|| "no hand".to_owned())
    }

    fn move_hand(&self, hand: usize, position: Option<[f64; 3]>) -> Result<(), String> {
        self.note(format!("{hand} moved to {position:?}"));
        Ok(())
    }

    fn leave_hand(&self, hand: usize) {
        self.note(format!("left {hand}"));
    }

    fn news(&self, _: usize, shown: u64) -> Option<(u64, String)> {
        Some(self.news.lock().unwrap().clone()).filter(|(number, _)| *number > shown)
    }

    fn hear(&self, hand: usize, word: &str) -> Result<(), String> {
        self.note(format!("{hand} said {word}"));
        if word == "here" { Ok(()) } else { Err("no such word".to_owned()) }
    }

    fn measures_round_trips(&self) -> Option<Duration> {
        Some(Duration::from_millis(10))
    }

    fn round_trip(&self, hand: usize, took: Duration) {
        assert!(took < PATIENCE);
        self.note(format!("trip of {hand}"));
    }
}

impl Study for Recorder {
    fn overview(&self) -> Value {
        json!({ "group": "G01" })
    }

    fn command(&self, wish: &Value) -> Result<(), String> {
        if wish["do"] == "next" { Ok(()) } else { Err("expected next".to_owned()) }
    }

    fn tell(&self, person: usize, said: &Value) -> Result<(), String> {
        if said["do"] == "refuse" {
            return Err("not now".to_owned());
        }
        self.note(format!("{person} told {said}"));
        Ok(())
    }
}

struct Lab {
    server: Server,
    study: Arc<Recorder>,
    guests: Guests,
}

impl Lab {
    fn new() -> Self {
        let (study, guests) = (Arc::new(Recorder::default()), Guests::default());
        guests.set((0..2).map(|_| Token::random().unwrap()).collect());
        let config = ServerConfig { token: Some(TOKEN.parse().unwrap()), ..ServerConfig::new(([127, 0, 0, 1], 0).into()) };
        let server = serve_study(config, empty_board(), Box::new(NoLinks), guests.clone(), Arc::clone(&study) as _).unwrap();
        Self { server, study, guests }
    }

    fn person(&self, number: usize) -> String {
        self.guests.tokens()[number].secret().to_owned()
    }

    /// Returns status and body of an answer.
    fn ask(&self, token: &str, method: &str, path: &str, body: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(self.server.address()).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let length = body.len();
        let head = format!("{method} {path} HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {token}\r\nConnection: close\r\n");
        stream.write_all(format!("{head}Content-Length: {length}\r\n\r\n{body}").as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        (head.split(' ').nth(1).unwrap().parse().unwrap(), body.to_owned())
    }

    fn connect(&self, token: &str, origin: Option<&str>) -> Result<WebSocket<TcpStream>, u16> {
        use tungstenite::client::IntoClientRequest as _;

        let stream = TcpStream::connect(self.server.address()).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut request = format!("ws://{}/api/hand?token={token}", self.server.address()).into_client_request().unwrap();
        if let Some(origin) = origin {
            request.headers_mut().insert("Origin", origin.parse().unwrap());
        }
        match tungstenite::client(request, stream) {
            Ok((socket, _)) => Ok(socket),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => Err(answer.status().as_u16()),
            Err(other) => panic!("{other}"),
        }
    }
}

fn text(socket: &mut WebSocket<TcpStream>) -> Option<String> {
    loop {
        match socket.read() {
            // An empty object says only that the server is there.
            Ok(Message::Text(text)) if text == "{}" => {}
            Ok(Message::Text(text)) => return Some(text.to_string()),
            Ok(Message::Close(_)) | Err(_) => return None,
            Ok(_) => {}
        }
    }
}

#[test]
fn everybody_may_ask_for_the_own_things_alone() {
    let lab = Lab::new();
    let person = lab.person(1);
    let of_host = [("GET", "/details"), ("GET", "/api/study"), ("GET", "/api/state"), ("GET", "/api/links"), ("GET", "/metrics")];
    for (method, path) in of_host {
        assert_eq!(lab.ask(TOKEN, method, path, "").0, 200, "{path}");
        assert_eq!(lab.ask(&person, method, path, "").0, 403, "{path}");
        assert_eq!(lab.ask(&"0".repeat(40), method, path, "").0, 401, "{path}");
    }
    assert_eq!(lab.ask(&person, "POST", "/api/study", r#"{"do": "next"}"#).0, 403);
    assert_eq!(lab.ask(&person, "PATCH", "/api/links", r#"{"delay": "1ms"}"#).0, 403);
    for path in ["/", "/join"] {
        assert!(lab.ask(&person, "GET", path, "").1.contains("<title>cohaptic study</title>"));
    }
    assert!(lab.ask(TOKEN, "GET", "/", "").1.contains("<title>cohaptic study: experimenter</title>"));
    assert_eq!(lab.ask(TOKEN, "POST", "/api/study", r#"{"do": "next"}"#), (200, "{\"group\":\"G01\"}\n".to_owned()));
    let (status, said) = lab.ask(TOKEN, "POST", "/api/study", r#"{"do": "rest"}"#);
    assert!(status == 422 && said.contains("expected next"), "{status} {said}");
    assert_eq!(lab.ask(TOKEN, "POST", "/api/person", "{}").0, 403, "the experimenter is nobody of the group");
    assert_eq!(lab.ask(&person, "POST", "/api/person", r#"{"do":"begin"}"#).0, 200);
    assert_eq!(lab.study.told.lock().unwrap().pop().unwrap(), r#"1 told {"do":"begin"}"#);
    assert_eq!(lab.ask(&person, "POST", "/api/person", r#"{"do":"refuse"}"#).0, 422);
    assert_eq!(lab.ask(&person, "POST", "/api/person", "x").0, 422);
    assert_eq!(lab.ask(&person, "POST", "/api/person", &" ".repeat(20_000)).0, 413);
    let urls = lab.server.join_urls();
    assert!(urls.len() == 2 && urls[1].ends_with(&format!("/join?token={person}")), "{urls:?}");
    // Another group has other tokens.
    lab.guests.set(vec![Token::random().unwrap()]);
    assert_eq!(lab.ask(&person, "GET", "/join", "").0, 401);
    assert_eq!(lab.ask(&lab.person(0), "GET", "/join", "").0, 200);
}

#[test]
fn a_page_that_is_too_early_takes_the_hand_later() {
    let lab = Lab::new();
    lab.study.is_early.store(true, Ordering::Relaxed);
    assert_eq!(lab.connect(&lab.person(1), None).err(), Some(503));
    lab.study.is_early.store(false, Ordering::Relaxed);
    assert_eq!(text(&mut lab.connect(&lab.person(1), None).unwrap()).unwrap(), r#"{"hand":1}"#);
}

#[test]
fn a_person_moves_the_own_hand_hears_news_and_answers_pings() {
    let lab = Lab::new();
    assert_eq!(lab.connect(&lab.person(1), Some(ORIGIN)).err(), Some(403));
    let mut socket = lab.connect(&lab.person(1), None).unwrap();
    assert_eq!(text(&mut socket).unwrap(), r#"{"hand":1}"#);
    *lab.study.news.lock().unwrap() = (1, r#"{"page":"code"}"#.to_owned());
    let mut said = Vec::new();
    while said.len() < 2 {
        said.push(text(&mut socket).unwrap());
    }
    said.sort();
    assert_eq!(said, [r#"{"page":"code"}"#, r#"{"peers":[]}"#]);
    socket.send(Message::text("[0.01,0,0]")).unwrap();
    socket.send(Message::text("here")).unwrap();
    lab.study.wait("1 moved to Some([0.01, 0.0, 0.0])");
    lab.study.wait("1 said here");
    // The client answers pings while it reads, and the news of the next number end the reading.
    *lab.study.news.lock().unwrap() = (2, r#"{"page":"wait"}"#.to_owned());
    assert_eq!(text(&mut socket).unwrap(), r#"{"page":"wait"}"#);
    socket.flush().unwrap();
    lab.study.wait("trip of 1");
    socket.send(Message::text("sesame")).unwrap();
    lab.study.wait("left 1");
    // A program that stays connected does not keep the hand of the next person, and the others stay.
    let mut ends = lab.connect(&lab.person(0), None).unwrap();
    let mut stays = lab.connect(&lab.person(1), None).unwrap();
    assert_eq!([text(&mut ends).unwrap(), text(&mut stays).unwrap()], [r#"{"hand":0}"#, r#"{"hand":1}"#]);
    // A program that reads answers pings, and would stay otherwise.
    std::thread::spawn(move || while ends.read().is_ok() {});
    let mut tokens = lab.guests.tokens();
    tokens[0] = Token::random().unwrap();
    lab.guests.set(tokens);
    lab.study.wait("left 0");
    *lab.study.news.lock().unwrap() = (3, r#"{"page":"ready"}"#.to_owned());
    while text(&mut stays).unwrap() != r#"{"page":"ready"}"# {}
    // The experimenter has no hand.
    let mut host = lab.connect(TOKEN, None).unwrap();
    assert_eq!(text(&mut host).unwrap(), r#"{"hand":null}"#);
}
