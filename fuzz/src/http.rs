//! Live control over HTTP: the bytes of a connection, and bodies that ask for changes of links.

use std::sync::{Arc, Mutex, OnceLock};

use cohaptic_control::fuzzing::Site;
use cohaptic_control::{Board, Description, Hands, Kind, LinkEditor, LinkName, Role, Stage, StageFile};
use serde_json::{Value, json};

use crate::Input;

const TOKEN: &str = "a-token-of-more-than-22-characters";
const LINKS: usize = 2;

/// Checks whatever reaches it.
struct Editor(Arc<Mutex<u64>>);

impl LinkEditor for Editor {
    fn keys(&self, link: usize) -> Vec<(String, String)> {
        assert!(link < LINKS);
        vec![("delay".to_owned(), "\"40ms\"".to_owned())]
    }

    fn change(&mut self, links: &[usize], keys: &[(String, String)]) -> Result<(), String> {
        *self.0.lock().unwrap() += 1;
        assert!(!links.is_empty() && !keys.is_empty() && links.iter().all(|link| *link < LINKS));
        for (key, value) in keys {
            assert!(!key.is_empty() && key.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_'), "{key:?}");
            // The text is a single value, without a second key after it.
            let table: toml::Table = toml::from_str(&format!("{key} = {value}")).unwrap_or_else(|error| panic!("{value:?}: {error}"));
            assert!(table.len() == 1 && table.contains_key(key), "{key} = {value}");
        }
        if keys.len() > 3 { Err("no more than three".to_owned()) } else { Ok(()) }
    }
}

/// A run in which nobody takes part.
struct Nobody;

impl Hands for Nobody {
    fn frame(&self, _: Option<usize>) -> (u64, Arc<str>) {
        (0, "".into())
    }

    fn take_hand(&self, wanted: Option<usize>) -> Result<usize, String> {
        wanted.filter(|hand| *hand < 4).ok_or_else(|| "there are four".to_owned())
    }

    fn move_hand(&self, _: usize, _: Option<[f64; 3]>) -> Result<(), String> {
        Ok(())
    }

    fn leave_hand(&self, _: usize) {}
}

impl Stage for Nobody {
    fn facts(&self, role: Role) -> Value {
        json!({ "host": role == Role::Host })
    }

    fn begin_anew(&self, wish: &Value) -> Result<(), String> {
        if wish.is_object() { Ok(()) } else { Err("expected an object".to_owned()) }
    }

    fn compare(&self) -> Result<Value, String> {
        Err("nothing was recorded".to_owned())
    }

    fn file(&self, _: &str) -> Option<StageFile> {
        None
    }
}

/// The server, and the changes that it has asked for.
fn site() -> &'static (Site, Arc<Mutex<u64>>) {
    static SITE: OnceLock<(Site, Arc<Mutex<u64>>)> = OnceLock::new();
    SITE.get_or_init(|| {
        let link = |number: usize| LinkName { name: format!("link {number}"), from: "left".to_owned(), to: "right".to_owned() };
        let links = (0..LINKS).map(link).collect();
        let description =
            Description { kind: Kind::Relay, title: "a test".to_owned(), links, peers: vec![], clocks: vec![], measures: vec![], body: None };
        let changes = Arc::new(Mutex::new(0));
        let editor = Box::new(Editor(Arc::clone(&changes)));
        (Site::new(TOKEN.parse().unwrap(), Arc::new(Board::new(description)), editor, Arc::new(Nobody)).unwrap(), changes)
    })
}

/// The first byte says whether the rest are all bytes of the connection, or the body of a request that is let in.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let mode = input.byte();
    let rest = input.rest();
    let sent = if mode & 1 == 0 { rest.to_vec() } else { request(mode >> 1, rest) };
    let (site, changes) = site();
    let before = *changes.lock().unwrap();
    let answers = site.answer(&sent);
    assert!(answers.is_empty() || answers.starts_with(b"HTTP/1."), "{}", String::from_utf8_lossy(&answers));
    let is = |status: &[u8]| answers.get(9..12) == Some(status);
    assert!(!is(b"500"), "{}", String::from_utf8_lossy(&answers));
    let shows_token = sent.windows(TOKEN.len()).any(|window| window == TOKEN.as_bytes());
    assert!(shows_token || (*changes.lock().unwrap() == before && !is(b"200")), "let in without the token");
    if mode & 1 == 1 {
        assert!(answers.len() > 20, "no answer");
    }
}

/// A whole request with the token, whose length is right.
fn request(choice: u8, body: &[u8]) -> Vec<u8> {
    let what = match choice & 7 {
        0 | 1 => "PATCH /api/links/0",
        2 | 3 => "PATCH /api/links",
        4 => "POST /api/play",
        5 => "PATCH /api/links/1",
        6 => "GET /api/links/0",
        _ => "GET /api/state",
    };
    let head = format!("{what} HTTP/1.1\r\nhost: localhost\r\nauthorization: Bearer {TOKEN}\r\ncontent-length: {}\r\n\r\n", body.len());
    [head.as_bytes(), body].concat()
}
