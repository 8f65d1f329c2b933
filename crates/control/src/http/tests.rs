//! Routes without a socket: admission, answers, and calls of the editor.

use core::time::Duration;
use std::sync::{Arc, Mutex};

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::{HeaderMap, Request, StatusCode};
use cohaptic_tests_common::properties;
use proptest::prelude::*;
use serde_json::{Value, json};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::Semaphore;
use tower::ServiceExt as _;

use super::{App, Pace, People, Shown, router};
use crate::token::Ticket;
use crate::{
    Board, Body as ObjectBody, Description, Guests, JoinedView, Kind, LinkCounters, LinkEditor, LinkName, MeasureLabel, PeerName, PeerView, Snapshot,
    TurnView,
};

pub(super) const TOKEN: &str = "a-token-of-more-than-22-characters";

/// Links and keys of a call of the editor.
type Call = (Vec<usize>, Vec<(String, String)>);
type Calls = Arc<Mutex<Vec<Call>>>;

/// An editor that records its calls and refuses the key `bad`.
struct Recorder(Calls);

impl LinkEditor for Recorder {
    fn keys(&self, link: usize) -> Vec<(String, String)> {
        vec![("delay".to_owned(), format!("\"{link}ms\"")), ("loss".to_owned(), "{ packets = [3] }".to_owned())]
    }

    fn change(&mut self, links: &[usize], keys: &[(String, String)]) -> Result<(), String> {
        self.0.lock().unwrap().push((links.to_vec(), keys.to_vec()));
        if keys.iter().any(|(key, _)| key == "bad") { Err("bad: unknown key".to_owned()) } else { Ok(()) }
    }
}

pub(super) struct Site {
    ticket: Arc<Ticket>,
    pub(super) router: Router,
    calls: Calls,
    runtime: Runtime,
}

struct Answer {
    status: StatusCode,
    headers: HeaderMap,
    body: Vec<u8>,
}

impl Site {
    pub(super) fn new(links: usize) -> Self {
        let name = |number| LinkName { name: format!("link {number}"), from: "left".to_owned(), to: "right".to_owned() };
        let description = Description {
            kind: Kind::Relay,
            title: "a test".to_owned(),
            links: (0..links).map(name).collect(),
            peers: Vec::new(),
            clocks: Vec::new(),
            measures: vec![
                MeasureLabel { name: "energy_j".to_owned(), unit: "J", about: "Energy" },
                MeasureLabel { name: "travel_s".to_owned(), unit: "s", about: "Travel" },
            ],
            body: None,
        };
        let board = Arc::new(Board::new(description));
        let counters = LinkCounters { offered: 7, dropped: vec![("loss", 2)], ..LinkCounters::default() };
        board.publish(Arc::new(Snapshot { links: vec![counters], measures: vec![Some(0.25)], ..Snapshot::default() })).unwrap();
        let calls = Calls::default();
        let ticket = Arc::new(Ticket::default());
        let app = App {
            board,
            ticket: Arc::clone(&ticket),
            shown: Shown::default(),
            editor: Arc::new(tokio::sync::Mutex::new(Box::new(Recorder(Arc::clone(&calls))))),
            token: TOKEN.parse().unwrap(),
            guests: Guests::default(),
            hosts: vec!["lab.example".to_owned()],
            people: People::Nobody,
            comparing: Semaphore::new(1),
            pace: Pace::default(),
            patience: Duration::from_millis(200),
        };
        Self { ticket, router: router(app), calls, runtime: Builder::new_current_thread().enable_time().build().unwrap() }
    }

    fn send(&self, request: Request<Body>) -> Answer {
        let router = self.router.clone();
        self.runtime.block_on(async move {
            let (parts, body) = router.oneshot(request).await.unwrap().into_parts();
            Answer { status: parts.status, headers: parts.headers, body: to_bytes(body, usize::MAX).await.unwrap().to_vec() }
        })
    }

    /// Returns the answer to a request with the right token.
    fn ask(&self, method: &str, path: &str, body: impl Into<Body>) -> Answer {
        self.send(request(method, path).header("authorization", format!("Bearer {TOKEN}")).body(body.into()).unwrap())
    }

    fn calls(&self) -> Vec<Call> {
        core::mem::take(&mut self.calls.lock().unwrap())
    }
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap()
    }

    fn error(&self) -> String {
        self.json()["error"].as_str().unwrap().to_owned()
    }
}

fn request(method: &str, path: &str) -> axum::http::request::Builder {
    Request::builder().method(method).uri(path).header("host", "127.0.0.1:8080")
}

fn pairs(keys: &[(&str, &str)]) -> Vec<(String, String)> {
    keys.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect()
}

#[test]
fn the_state_has_measures_where_the_run_has_some() {
    let site = Site::new(1);
    let measure = |name: &str, value: Value, unit: &str, about: &str| json!({ "name": name, "value": value, "unit": unit, "about": about });
    let expected = [measure("energy_j", 0.25.into(), "J", "Energy"), measure("travel_s", Value::Null, "s", "Travel")];
    assert_eq!(site.ask("GET", "/api/state", "").json()["measures"], json!(expected));
    let description =
        Description { kind: Kind::Router, title: String::new(), links: vec![], peers: vec![], clocks: vec![], measures: vec![], body: None };
    let state = crate::views::state(&Board::new(description.clone()).latest());
    assert!(!state.as_object().unwrap().contains_key("measures"));
}

/// The first peer is turned by a quarter about z and has a device with an orientation. The second peer is unknown yet.
#[test]
fn attitudes_are_in_the_state_of_an_object_that_turns_alone() {
    let names = |name: &str| PeerName { name: name.to_owned(), kind: "simulated".to_owned() };
    let peers = vec![names("left"), names("right")];
    let still = Description { kind: Kind::Live, title: String::new(), links: vec![], peers, clocks: vec![], measures: vec![], body: None };
    let body = ObjectBody { edges: [0.4, 0.3, 0.0], grasps: vec![[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0]] };
    let half = core::f64::consts::FRAC_1_SQRT_2;
    let turn = TurnView { orientation: [half, 0.0, 0.0, half], device: Some([0.0, 0.2, 0.1]), device_orientation: Some([1.0, 0.0, 0.0, 0.0]) };
    let shown = |description: &Description, turn: Option<TurnView>| {
        let board = Board::new(description.clone());
        board.publish(Arc::new(Snapshot { peers: vec![PeerView { turn, ..PeerView::default() }], ..Snapshot::default() })).unwrap();
        crate::views::state(&board.latest())
    };
    let state = shown(&Description { body: Some(body), ..still.clone() }, Some(turn));
    assert_eq!(state["body"], json!({ "edges": [0.4, 0.3, 0.0] }));
    assert_eq!(state["peers"][0]["grasp"], json!([0.2, 0.0, 0.0]));
    assert_eq!(state["peers"][0]["orientation"], json!([half, 0.0, 0.0, half]));
    assert_eq!(state["peers"][0]["device"], json!({ "position": [0.0, 0.2, 0.1], "orientation": [1.0, 0.0, 0.0, 0.0] }));
    assert_eq!(state["peers"][1]["orientation"], Value::Null);
    let state = shown(&still, None).to_string();
    assert!(["body", "grasp", "orientation", "device"].iter().all(|key| !state.contains(key)), "{state}");
}

#[test]
fn a_program_that_joined_is_in_the_state_and_no_other_peer_has_the_entry() {
    let names = |name: &str| PeerName { name: name.to_owned(), kind: "udp".to_owned() };
    let peers = vec![names("left"), names("right")];
    let description = Description { kind: Kind::Live, title: String::new(), links: vec![], peers, clocks: vec![], measures: vec![], body: None };
    let joined = JoinedView { device: "falcon".to_owned(), address: "192.0.2.9".to_owned(), lost: 2, sent: 1000 };
    let board = Board::new(description);
    let peers = vec![PeerView { joined: Some(joined), ..PeerView::default() }, PeerView::default()];
    board.publish(Arc::new(Snapshot { peers, ..Snapshot::default() })).unwrap();
    let state = crate::views::state(&board.latest());
    assert_eq!(state["peers"][0]["joined"], json!({ "device": "falcon", "address": "192.0.2.9", "lost": 2, "sent": 1000 }));
    assert!(state["peers"][1].get("joined").is_none());
}

#[test]
fn every_path_needs_the_token() {
    let site = Site::new(2);
    for path in ["/", "/api/state", "/api/links", "/api/links/0", "/api/histograms", "/api/events", "/metrics", "/nothing"] {
        for wrong in [None, Some("Bearer "), Some("Bearer a-token-of-more-than-22-character"), Some("Basic YTpi"), Some(TOKEN)] {
            let request = wrong.iter().fold(request("GET", path), |request, value| request.header("authorization", *value));
            let answer = site.send(request.body(Body::empty()).unwrap());
            assert_eq!(answer.status, StatusCode::UNAUTHORIZED, "{path} {wrong:?}");
            assert_eq!(answer.headers["www-authenticate"], "Bearer");
            assert!(answer.error().contains("token"));
            assert!(!answer.error().contains(TOKEN));
        }
        let wrong = site.send(request("GET", &format!("{path}?token=x{TOKEN}")).body(Body::empty()).unwrap());
        assert_eq!(wrong.status, StatusCode::UNAUTHORIZED);
    }
}

#[test]
fn the_token_is_taken_from_a_header_or_from_the_address() {
    let site = Site::new(2);
    let in_query = site.send(request("GET", &format!("/api/state?a=b&token={TOKEN}")).body(Body::empty()).unwrap());
    assert_eq!(in_query.status, StatusCode::OK);
    let lower = site.send(request("GET", "/api/state").header("authorization", format!("bearer {TOKEN}")).body(Body::empty()).unwrap());
    assert_eq!(lower.status, StatusCode::OK);
}

/// The address for opening a browser leads to the page once. A second use is refused, and so is another host.
#[test]
fn a_ticket_leads_to_the_page_once() {
    let site = Site::new(1);
    let get = |path: &str| site.send(request("GET", path).body(Body::empty()).unwrap());
    assert_eq!(get("/open?ticket=").status, StatusCode::UNAUTHORIZED);
    let path = format!("/open?ticket={}", site.ticket.issue().unwrap().secret());
    let foreign = Request::builder().uri(&path).header("host", "evil.example").body(Body::empty()).unwrap();
    assert_eq!(site.send(foreign).status, StatusCode::FORBIDDEN);
    assert_eq!(site.send(request("POST", &path).body(Body::empty()).unwrap()).status, StatusCode::UNAUTHORIZED);
    assert_eq!(get(&path.replace("/open", "/api/state")).status, StatusCode::UNAUTHORIZED);
    let answer = get(&path);
    assert_eq!((answer.status, answer.headers["location"].to_str().unwrap()), (StatusCode::SEE_OTHER, format!("/?token={TOKEN}").as_str()));
    assert_eq!(answer.headers["cache-control"], "no-store");
    assert_eq!(get(&path).status, StatusCode::UNAUTHORIZED);
}

#[test]
fn a_browser_without_the_token_is_asked_for_it() {
    let site = Site::new(2);
    let answer = site.send(request("GET", "/").header("accept", "text/html,*/*;q=0.8").body(Body::empty()).unwrap());
    assert_eq!(answer.status, StatusCode::UNAUTHORIZED);
    assert!(String::from_utf8(answer.body).unwrap().contains("<form"));
    let deeper = site.send(request("GET", "/api/state").header("accept", "text/html").body(Body::empty()).unwrap());
    assert_eq!(deeper.headers["content-type"], "application/json");
}

#[test]
fn hosts_are_addresses_localhost_and_names_that_were_given() {
    let site = Site::new(2);
    let by = |host: &str| {
        let request = Request::builder().uri("/api/state").header("host", host).header("authorization", format!("Bearer {TOKEN}"));
        site.send(request.body(Body::empty()).unwrap()).status
    };
    for host in ["localhost", "LOCALHOST:81", "127.0.0.1", "127.0.0.1:8080", "[::1]:8080", "[::1]", "192.0.2.7:1", "lab.example:9", "Lab.Example"] {
        assert_eq!(by(host), StatusCode::OK, "{host}");
    }
    for host in [
        "evil.example",
        "localhost.evil.example",
        "127.0.0.1.evil.example:80",
        "",
        "a b",
        "lab.example.",
        "x@evil.example",
        "[::1].evil.example",
        "[::1",
        "localhost:http",
        "127.1",
        "::1",
    ] {
        assert_eq!(by(host), StatusCode::FORBIDDEN, "{host}");
    }
    let bearer = format!("Bearer {TOKEN}");
    let none = Request::builder().uri("/api/state").header("authorization", &bearer).body(Body::empty()).unwrap();
    assert_eq!(site.send(none).status, StatusCode::FORBIDDEN);
    let two = request("GET", "/api/state").header("host", "localhost").header("authorization", &bearer).body(Body::empty()).unwrap();
    assert_eq!(site.send(two).status, StatusCode::FORBIDDEN);
    let absolute = request("GET", "http://evil.example/api/state").header("authorization", &bearer).body(Body::empty()).unwrap();
    assert_eq!(site.send(absolute).status, StatusCode::FORBIDDEN);
}

#[test]
fn every_answer_says_what_it_may_do() {
    let site = Site::new(2);
    for path in ["/", "/api/state", "/metrics", "/nothing"] {
        for answer in [site.ask("GET", path, ""), site.send(request("GET", path).body(Body::empty()).unwrap())] {
            let policy = answer.headers["content-security-policy"].to_str().unwrap();
            assert!(policy.contains("default-src 'none'") && policy.contains("frame-ancestors 'none'") && !policy.contains("unsafe"), "{policy}");
            assert_eq!(answer.headers["x-content-type-options"], "nosniff");
            assert_eq!(answer.headers["referrer-policy"], "no-referrer");
            assert_eq!(answer.headers["cache-control"], "no-store");
            assert!(!answer.headers.contains_key("access-control-allow-origin"));
        }
    }
}

#[test]
fn what_is_not_there_is_404_and_what_is_not_done_is_405() {
    let site = Site::new(2);
    for path in [
        "/nothing",
        "/api",
        "/api/links/",
        "/api/links/2",
        "/api/links/00",
        "/api/links/+1",
        "/api/links/x",
        "/api/links/99999999999999999999",
        "/api/links/%ff",
    ] {
        let answer = site.ask("GET", path, "");
        assert_eq!(answer.status, StatusCode::NOT_FOUND, "{path}");
        assert!(!answer.error().is_empty());
    }
    assert!(site.ask("GET", "/api/links/2", "").error().contains("expected 0 to 1"));
    assert!(site.ask("PATCH", "/api/links/2", "{\"delay\":\"1ms\"}").error().contains("expected 0 to 1"));
    for (method, path) in
        [("POST", "/"), ("PATCH", "/"), ("DELETE", "/api/links/0"), ("PUT", "/api/links/0"), ("POST", "/metrics"), ("OPTIONS", "/api/links/0")]
    {
        let answer = site.ask(method, path, "");
        assert_eq!(answer.status, StatusCode::METHOD_NOT_ALLOWED, "{method} {path}");
        assert!(answer.headers["allow"].to_str().unwrap().contains("GET"));
        assert!(answer.error().contains(method));
    }
    assert!(site.calls().is_empty());
}

#[test]
fn links_are_shown_with_counters_and_keys() {
    let site = Site::new(2);
    let one = site.ask("GET", "/api/links/0", "").json();
    assert_eq!((&one["offered"], &one["dropped"], &one["mean_delay_s"]), (&json!(7), &json!({ "loss": 2 }), &Value::Null));
    assert_eq!(one["keys"], json!({ "delay": "0ms", "loss": "{ packets = [3] }" }));
    let all = site.ask("GET", "/api/links", "").json();
    assert_eq!(all["links"].as_array().unwrap().len(), 2);
    assert_eq!(all["links"][0], one);
    // No counters were published for the second link.
    assert_eq!((&all["links"][1]["offered"], &all["links"][1]["keys"]["delay"]), (&json!(0), &json!("1ms")));
}

#[test]
fn a_change_reaches_the_editor_as_toml() {
    let site = Site::new(3);
    let answer =
        site.ask("PATCH", "/api/links/1", "{\"delay\": \"40ms\", \"loss\": 0.01, \"queue\": {\"limit\": \"30kB\"}, \"order\": \"in-order\"}");
    assert_eq!(answer.status, StatusCode::OK);
    assert_eq!(answer.json()["link"], 1);
    let keys = pairs(&[("delay", "\"40ms\""), ("loss", "0.01"), ("order", "\"in-order\""), ("queue", "{ limit = \"30kB\" }")]);
    assert_eq!(site.calls(), [(vec![1], keys)]);
    let all = site.ask("PATCH", "/api/links", "{\"rate\": \"10Mbit\"}");
    assert_eq!(all.json()["links"].as_array().unwrap().len(), 3);
    assert_eq!(site.calls(), [(vec![0, 1, 2], pairs(&[("rate", "\"10Mbit\"")]))]);
}

#[test]
fn what_is_shown_can_be_sent_back() {
    let site = Site::new(1);
    let keys = site.ask("GET", "/api/links/0", "").json()["keys"].to_string();
    assert_eq!(site.ask("PATCH", "/api/links/0", keys).status, StatusCode::OK);
    assert_eq!(site.calls(), [(vec![0], pairs(&[("delay", "\"0ms\""), ("loss", "{ packets = [3] }")]))]);
}

#[test]
fn a_change_that_cannot_be_is_422_with_the_reason() {
    let site = Site::new(2);
    let refused = site.ask("PATCH", "/api/links/0", "{\"bad\": 1}");
    assert_eq!((refused.status, refused.error().as_str()), (StatusCode::UNPROCESSABLE_ENTITY, "bad: unknown key"));
    assert_eq!(site.calls().len(), 1);
    for (body, word) in [
        ("", "JSON"),
        ("delay=40ms", "JSON"),
        ("[]", "JSON"),
        ("\"delay\"", "JSON"),
        ("{}", "no keys"),
        ("{\"delay\": null}", "delay: null"),
        ("{\"a b\": 1}", "not a name"),
        ("{\"a=1\\nb\": 1}", "not a name"),
        ("{\"\": 1}", "not a name"),
        ("{\"limit\": 18446744073709551615}", "too large"),
    ] {
        let answer = site.ask("PATCH", "/api/links/0", body);
        assert_eq!(answer.status, StatusCode::UNPROCESSABLE_ENTITY, "{body}");
        assert!(answer.error().contains(word), "{body}: {}", answer.error());
    }
    assert!(site.calls().is_empty(), "none of these is a question for the editor");
    assert_eq!(Site::new(0).ask("PATCH", "/api/links", "{\"delay\": 1}").status, StatusCode::UNPROCESSABLE_ENTITY);
}

#[test]
fn large_bodies_are_413() {
    let site = Site::new(1);
    let fits = format!("{{\"delay\":\"{}\"}}", "x".repeat(64 * 1024 - 12));
    assert_eq!(site.ask("PATCH", "/api/links/0", fits.clone()).status, StatusCode::OK);
    let answer = site.ask("PATCH", "/api/links/0", format!("{fits} "));
    assert_eq!(answer.status, StatusCode::PAYLOAD_TOO_LARGE);
    assert!(answer.error().contains("65536"));
}

properties! {
    #[test]
    fn whatever_is_asked_is_answered(method in "[A-Z]{1,7}", path in "/[ -~]{0,40}", body in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assume!(!path.starts_with("/api/events"));
        let built = request(&method, &path).header("authorization", format!("Bearer {TOKEN}")).body(Body::from(body));
        // Some texts are no addresses, and the HTTP library refuses to build the request.
        if let Ok(request) = built {
            prop_assert!(Site::new(2).send(request).status.as_u16() < 500);
        }
    }

    #[test]
    fn whatever_is_to_be_changed_is_answered(path in prop_oneof![Just("/api/links".to_owned()), "/api/links/[0-9a-z%+]{0,4}"], body in any_body()) {
        let answer = Site::new(2).ask("PATCH", &path, body);
        prop_assert!(matches!(answer.status.as_u16(), 200 | 404 | 405 | 422), "{}", answer.status);
        prop_assert!(answer.json().is_object());
    }

    #[test]
    fn whatever_the_headers_say_is_answered(host in prop::collection::vec(any::<u8>(), 0..30), token in prop::collection::vec(any::<u8>(), 0..60)) {
        if let Ok(request) = Request::builder().uri("/api/state").header("host", host).header("authorization", token).body(Body::empty()) {
            prop_assert!(matches!(Site::new(1).send(request).status.as_u16(), 401 | 403));
        }
    }
}

fn any_body() -> impl Strategy<Value = Vec<u8>> {
    let value =
        prop_oneof!["[ -~]{0,20}".prop_map(Value::from), any::<f64>().prop_map(Value::from), any::<u64>().prop_map(Value::from), Just(Value::Null)];
    prop_oneof![
        prop::collection::vec(any::<u8>(), 0..100),
        prop::collection::btree_map("[ -~]{0,8}", value, 0..4).prop_map(|map| serde_json::to_vec(&map).unwrap()),
    ]
}
