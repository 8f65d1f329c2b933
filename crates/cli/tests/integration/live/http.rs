//! Live control from outside of a browser.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;

use serde_json::{Value, json};

use super::{PATIENCE, wait_for};

/// The live control of a session.
#[derive(Clone)]
pub(super) struct Control {
    pub(super) host: String,
    pub(super) token: String,
}

impl Control {
    /// The one at an address as it is printed: `http://HOST/?token=TOKEN`.
    pub(super) fn at(url: &str) -> Self {
        let (host, token) = url.strip_prefix("http://").and_then(|rest| rest.split_once("/?token=")).unwrap_or_else(|| panic!("{url}"));
        Self { host: host.to_owned(), token: token.to_owned() }
    }

    /// Asks, and gives the status and the body of the answer.
    pub(super) fn ask(&self, method: &str, path: &str, body: &str) -> (u16, String) {
        self.try_ask(method, path, body).unwrap()
    }

    /// Like [`Control::ask`], for a server that may be gone.
    pub(super) fn try_ask(&self, method: &str, path: &str, body: &str) -> std::io::Result<(u16, String)> {
        let mut stream = TcpStream::connect(&self.host)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        let (host, token, length) = (&self.host, &self.token, body.len());
        let head = format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\nAuthorization: Bearer {token}\r\nConnection: close\r\n");
        stream.write_all(format!("{head}Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}").as_bytes())?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        let Some((head, body)) = answer.split_once("\r\n\r\n") else { return Err(std::io::ErrorKind::UnexpectedEof.into()) };
        assert!(!head.to_lowercase().contains("transfer-encoding"), "{head}");
        Ok((head.split(' ').nth(1).unwrap().parse().unwrap(), body.to_owned()))
    }

    pub(super) fn get(&self, path: &str) -> Value {
        let (status, body) = self.ask("GET", path, "");
        assert_eq!(status, 200, "{body}");
        serde_json::from_str(&body).unwrap()
    }

    pub(super) fn state(&self) -> Value {
        self.get("/api/state")
    }

    /// Waits until `holds` is true for the state, and returns the state. `what` names the state in messages.
    pub(super) fn wait(&self, what: &str, mut holds: impl FnMut(&Value) -> bool) -> Value {
        wait_for(what, || Some(self.state()).filter(|state| holds(state)))
    }

    /// Waits until a peer has a status.
    pub(super) fn wait_status(&self, peer: usize, status: &str) -> Value {
        self.wait(&format!("peer {peer} is {status}"), |state| state["peers"][peer]["status"] == json!(status))
    }

    /// Returns the number of packets that a link has delivered.
    pub(super) fn delivered(&self, link: usize) -> u64 {
        self.state()["links"][link]["delivered"].as_u64().unwrap()
    }
}
