//! `cohaptic play` without a browser: hands over WebSockets, successive parts, records, and refused connections.

use std::io::Write as _;
use std::net::TcpStream;
use std::time::Instant;

use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

use super::http::Control;
use super::session::Session;
use super::{PATIENCE, wait_for};
use crate::integration::desk::Desk;

/// Connection of a page that has a hand.
pub(super) struct Page(WebSocket<TcpStream>);

impl Page {
    /// Connects with `query` appended to the address. The error is the HTTP status of a refusal, or 0 if the server is gone.
    pub(super) fn try_open(control: &Control, query: &str, header: Option<(&'static str, &str)>) -> Result<Self, u16> {
        let Ok(stream) = TcpStream::connect(&control.host) else { return Err(0) };
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut request = format!("ws://{}/api/hand?token={}{query}", control.host, control.token).into_client_request().unwrap();
        if let Some((name, value)) = header {
            request.headers_mut().insert(name, value.parse().unwrap());
        }
        match tungstenite::client(request, stream) {
            Ok((socket, _)) => Ok(Self(socket)),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => Err(answer.status().as_u16()),
            Err(tungstenite::HandshakeError::Failure(_)) => Err(0),
            Err(other) => panic!("{other}"),
        }
    }

    fn open(control: &Control, query: &str) -> Self {
        Self::try_open(control, query, None).unwrap()
    }

    /// The next message; `None` once the server has closed.
    pub(super) fn next(&mut self) -> Option<Value> {
        loop {
            match self.0.read() {
                Ok(Message::Text(text)) => return Some(serde_json::from_str(&text).unwrap()),
                Ok(Message::Close(_)) | Err(_) => return None,
                Ok(_) => {}
            }
        }
    }

    pub(super) fn say(&mut self, text: impl Into<String>) -> bool {
        self.0.send(Message::text(text.into())).is_ok()
    }

    /// Holds the hand there until the pictures are such, and gives the picture.
    fn hold_until(&mut self, place: [f64; 3], what: &str, mut holds: impl FnMut(&Value) -> bool) -> Value {
        let begin = Instant::now();
        loop {
            self.say(json!(place).to_string());
            let frame = self.next().unwrap_or_else(|| panic!("{what}: it was closed"));
            if frame["peers"].is_array() && holds(&frame) {
                return frame;
            }
            assert!(begin.elapsed() < PATIENCE, "{what}: {frame}");
        }
    }

    /// Returns whether the server closes within the patience.
    fn is_closed(&mut self) -> bool {
        let begin = Instant::now();
        while begin.elapsed() < PATIENCE {
            if self.next().is_none() {
                return true;
            }
        }
        false
    }
}

fn begin(desk: &Desk, words: &str) -> (Session, Control, Control) {
    let mut session = Session::play(desk, words);
    let host = Control::at(&session.told("open "));
    let join = session.told("for others: ");
    let (address, token) = join.strip_prefix("http://").unwrap().split_once("/join?token=").unwrap();
    let guest = Control { host: address.to_owned(), token: token.to_owned() };
    (session, host, guest)
}

fn end(session: Session) {
    session.interrupt();
    let outcome = session.outcome();
    assert_eq!(outcome.status, Some(130), "{outcome:#?}");
}

fn x(frame: &Value, peer: usize) -> f64 {
    frame["peers"][peer]["at"][0].as_f64().unwrap()
}

/// A hand is moved over a WebSocket; the copies follow; the strategy and the number of peers change meanwhile; each part can be run again, and ends to the bit
/// where the next one begins.
#[test]
fn a_hand_moves_the_cube_and_parts_follow_one_another() {
    let desk = Desk::new();
    let (session, control, _) = begin(&desk, "--out played");
    let mut page = Page::open(&control, "&hand=0");
    assert_eq!(page.next(), Some(json!({ "hand": 0 })));
    page.hold_until([0.04, 0.01, 0.0], "all copies come", |frame| (0..3).all(|peer| x(frame, peer) > 0.01));
    let facts = control.get("/api/play");
    assert_eq!((&facts["part"], &facts["strategy"], &facts["peers"][0]["taken"]), (&json!(1), &json!("average-position"), &json!(true)));
    // Another strategy, then another delay, then more peers: nobody is thrown back.
    let (status, answer) = control.ask("POST", "/api/play", r#"{"strategy": "proportional-derivative"}"#);
    assert_eq!(status, 200, "{answer}");
    let frame = page.hold_until([0.04, 0.01, 0.0], "part 2", |frame| frame["part"] == 2);
    assert!(x(&frame, 0) > 0.01 && frame["peers"][0]["hand"] == "present", "{frame}");
    assert_eq!(control.ask("PATCH", "/api/links", r#"{"delay": "9ms"}"#).0, 200);
    assert_eq!(control.ask("POST", "/api/play", r#"{"peers": 5}"#).0, 200);
    let frame = page.hold_until([0.04, 0.01, 0.0], "part 3", |frame| frame["part"] == 3 && frame["peers"].as_array().unwrap().len() == 5);
    assert!(x(&frame, 4) > 0.01, "{frame}");
    assert_eq!(control.get("/api/links")["links"].as_array().map(Vec::len), Some(20));
    assert_eq!(control.get("/api/links/19")["keys"]["delay"], "9ms");
    assert_eq!(control.get("/api/play")["strategy"], "proportional-derivative");
    for (wish, word) in
        [(r#"{"strategy": "hope"}"#, "strategy"), (r#"{"peers": 11}"#, "2 to 10"), (r#"{"speed": 3}"#, "expected"), ("[]", "object"), ("x", "JSON")]
    {
        let (status, answer) = control.ask("POST", "/api/play", wish);
        assert!(status == 422 && answer.contains(word), "{wish}: {status} {answer}");
    }
    assert_eq!(control.ask("POST", "/api/play", &format!("{{{}}}", " ".repeat(5000))).0, 413);
    end(session);
    for part in [1, 2] {
        continues(&desk, part);
    }
}

/// A part, run again from its record, ends where the scene of the next one begins.
fn continues(desk: &Desk, part: usize) {
    let document = desk.text(&format!("run played/part-{part}/scene.toml --inputs played/part-{part}/inputs.csv --json"));
    // A reader of JSON may round: the digits are read here, to the bit.
    let ended = document.split("\"position_m\"").skip(1).map(|rest| {
        let list = rest.split(['[', ']']).nth(1).unwrap();
        list.split(',').map(|number| number.trim().parse::<f64>().unwrap()).collect::<Vec<_>>()
    });
    let next: toml::Table = toml::from_str(&desk.read(&format!("played/part-{}/scene.toml", part + 1))).unwrap();
    let mut compared = 0;
    for (ended, begins) in ended.zip(next["peers"].as_array().unwrap()) {
        for axis in [0, 1] {
            let begins = begins["position"][axis].as_float().unwrap();
            assert_eq!(ended[axis].to_bits(), begins.to_bits(), "part {part}: {ended:?} and {begins}");
            compared += 1;
        }
    }
    assert_eq!(compared, 6, "three peers on two axes");
}

#[test]
fn a_comparison_runs_the_hand_again_and_its_files_can_be_run_by_anybody() {
    let desk = Desk::new();
    let (session, control, _) = begin(&desk, "");
    let (status, answer) = control.ask("GET", "/api/files/inputs.csv", "");
    assert_eq!(status, 404, "{answer}");
    let mut page = Page::open(&control, "");
    page.hold_until([0.03, 0.0, 0.0], "the second copy comes", |frame| x(frame, 1) > 0.005);
    let (status, answer) = control.ask("POST", "/api/compare", "");
    assert_eq!(status, 200, "{answer}");
    let compared: Value = serde_json::from_str(&answer).unwrap();
    let runs = compared["runs"].as_array().unwrap();
    let names: Vec<&str> = runs.iter().map(|run| run["name"].as_str().unwrap()).collect();
    assert_eq!((names, &compared["hand"]), (vec!["AP", "PD", "without network"], &json!("you")));
    // The last instant counts in both curves.
    let values = |run: &Value, curve: &str| run[curve].as_array().unwrap().len();
    assert!(runs.iter().all(|run| values(run, "discrepancy_m") == values(run, "force_n")), "{compared}");
    let largest = |run: usize| runs[run]["largest_discrepancy_m"].as_f64().unwrap();
    assert!(largest(2) < largest(0) && largest(0) > 1e-3, "{compared}");
    for name in ["scene.toml", "inputs.csv"] {
        let (status, text) = control.ask("GET", &format!("/api/files/{name}"), "");
        assert_eq!(status, 200);
        desk.write(name, text);
    }
    let again = desk.json("run scene.toml --inputs inputs.csv --json");
    assert!(again["peers"][1]["position_m"][0].as_f64().unwrap() > 0.005, "{again}");
    end(session);
}

#[test]
fn who_has_no_token_or_comes_from_another_site_moves_nothing() {
    let desk = Desk::new();
    let (session, control, guest) = begin(&desk, "");
    let stranger = Control { token: "0".repeat(40), ..control.clone() };
    assert_eq!(Page::try_open(&stranger, "", None).err(), Some(401));
    let own = format!("http://{}", control.host);
    for (origin, status) in [("http://evil.example", Some(403)), ("null", Some(403)), ("https://127.0.0.1", Some(403)), (own.as_str(), None)] {
        assert_eq!(Page::try_open(&control, "&hand=none", Some(("Origin", origin))).err(), status, "{origin}");
    }
    // A name that somebody points at this machine is no name of it.
    assert_eq!(Page::try_open(&control, "&hand=none", Some(("Host", "evil.example"))).err(), Some(403));
    // A guest may look on and take a hand that nobody has, and change nothing.
    for (method, path, body) in [("PATCH", "/api/links", r#"{"delay": "1ms"}"#), ("POST", "/api/play", "{}"), ("POST", "/api/compare", "")] {
        assert_eq!(guest.ask(method, path, body).0, 403, "{method} {path}");
        assert_eq!(stranger.ask(method, path, body).0, 401, "{method} {path}");
    }
    assert_eq!((&guest.get("/api/play")["host"], &guest.get("/api/play")["join"]), (&json!(false), &Value::Null));
    assert!(control.get("/api/play")["join"].as_str().unwrap().contains("/join?token="));
    let mut pages: Vec<Page> = (0..3).map(|_| Page::open(&guest, "")).collect();
    let hands: Vec<Value> = pages.iter_mut().map(|page| page.next().unwrap()["hand"].clone()).collect();
    assert_eq!(hands, [json!(0), json!(1), json!(2)]);
    let mut fourth = Page::open(&guest, "");
    let refused = fourth.next().unwrap();
    assert!(refused["hand"].is_null() && refused["refused"].as_str().unwrap().contains("taken"), "{refused}");
    // Whoever goes makes room.
    drop(pages.remove(1));
    wait_for("a free hand", || (Page::open(&guest, "").next().unwrap()["hand"] == json!(1)).then_some(()));
    end(session);
}

#[test]
fn what_is_no_place_ends_the_connection_and_moves_nothing() {
    let desk = Desk::new();
    let (session, control, _) = begin(&desk, "");
    let far = "[99,0,0]".to_owned();
    for wrong in ["", "[1,2]", "[1e999,0,0]", "{\"at\":1}", &far, &"9".repeat(200), &format!("[{},0,0]", "0".repeat(5000))] {
        let mut page = Page::open(&control, "&hand=0");
        page.say(wrong);
        assert!(page.is_closed(), "{wrong}");
        wait_for("the hand is free again", || (control.get("/api/play")["peers"][0]["taken"] == json!(false)).then_some(()));
    }
    let mut page = Page::open(&control, "&hand=0");
    // Far more than any screen shows.
    while page.say("[0,0,0]") {}
    let mut looks = Page::open(&control, "&hand=none");
    let frame = looks.hold_until([9.0, 0.0, 0.0], "a picture", |_| true);
    assert!((0..3).all(|peer| x(&frame, peer).abs() < 1e-6), "who looks on moves nothing: {frame}");
    end(session);
}

/// Bytes of a generator (Lehmer's, with the multiplier of Park & Miller 1988) in place of frames, after a handshake that was in order.
#[test]
fn bytes_that_are_no_frames_end_the_connection_and_nothing_else() {
    let desk = Desk::new();
    let (session, control, _) = begin(&desk, "");
    let mut state = 1_u64;
    let mut next = || {
        state = state * 48_271 % 2_147_483_647;
        state
    };
    for round in 0..60 {
        let mut page = Page::open(&control, "&hand=0");
        let length = 1 + next() % 300;
        let mut bytes: Vec<u8> = (0..length).map(|_| u8::try_from(next() % 256).unwrap()).collect();
        if round % 2 == 0 {
            // The beginning of a text that is masked, as those of browsers are, and of any length.
            bytes.splice(0..0, [0x81, 0x80 | u8::try_from(next() % 128).unwrap()]);
        }
        // The server may be gone before all of it is said.
        let _said = page.0.get_mut().write_all(&bytes);
        drop(page);
        wait_for("the hand is free again", || (control.get("/api/play")["peers"][0]["taken"] == json!(false)).then_some(()));
    }
    let mut page = Page::open(&control, "&hand=0");
    let frame = page.hold_until([0.03, 0.0, 0.0], "the second copy comes", |frame| x(frame, 1) > 0.005);
    assert_eq!(frame["part"], 1, "{frame}");
    end(session);
}

#[test]
fn scenes_that_cannot_be_played_are_refused() {
    let desk = Desk::with("udp.toml", super::peer_elsewhere::SCENE);
    desk.cohaptic("play udp.toml").assert_refused(2, &["kind", "pointer"]);
    desk.cohaptic("play --set topology={kind='ring'}").assert_refused(2, &["topology"]);
    desk.cohaptic("play --control 0.0.0.0:0").assert_refused(2, &["--allow-remote"]);
    desk.cohaptic("play --set peers.you.kind=falcon").assert_refused(2, &["falcon", "--set peers.you.kind=pointer"]);
    let turns = [
        "peers.you.hand.follows.position=[0.03,0,0]",
        "object.inertia=0.01",
        "scene.axes=3",
        "peer.device.inertia=1e-4",
        "peer.coupling.rotational-stiffness=1",
        "peer.kind=simulated",
    ];
    let set: String = turns.iter().map(|key| format!(" --set {key}")).collect();
    desk.cohaptic(&format!("play{set}")).assert_refused(2, &["turns nothing"]);
    let outcome = desk.cohaptic("play --for 300ms --no-priority");
    assert!(outcome.status == Some(0) && outcome.stderr.contains("part 1: average-position"), "{outcome:?}");
}
