//! A headless browser with a single page.

use core::time::Duration;
use std::io::{BufRead as _, BufReader};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::Instant;

use base64::Engine as _;
use serde_json::{Value, json};
use tempfile::TempDir;
use tungstenite::{Message, WebSocket};

/// Time limit of every wait, generous for a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

const ARGUMENTS: [&str; 12] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--remote-debugging-port=0",
    "--window-size=1400,1100",
    "about:blank",
];

/// A browser with a single page, controlled through the Chrome `DevTools` protocol (<https://chromedevtools.github.io/devtools-protocol/>).
pub(crate) struct Browser {
    child: Child,
    _folder: TempDir,
    socket: WebSocket<TcpStream>,
    session: Option<String>,
    asked: u64,
    /// Complaints of the page: exceptions, and violations of its content security policy.
    pub(crate) complaints: Vec<String>,
}

/// Returns the path of a browser; `None` if no browser is installed.
fn program() -> Option<PathBuf> {
    if let Some(given) = std::env::var_os("CHROMIUM") {
        return Some(given.into());
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    std::env::split_paths(&path).flat_map(|folder| names.map(|name| folder.join(name))).find(|file| file.is_file())
}

impl Browser {
    /// Starts a browser, or prints a message and returns `None` if no browser is installed.
    pub(crate) fn start() -> Option<Self> {
        let Some(program) = program() else {
            eprintln!("skipped: no browser; install chromium, or name one in CHROMIUM");
            return None;
        };
        let folder = tempfile::tempdir().unwrap();
        let mut child = Command::new(program)
            .arg(format!("--user-data-dir={}", folder.path().display()))
            .args(ARGUMENTS)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let stderr = child.stderr.take().unwrap();
        let (found, address) = mpsc::channel();
        // Reads to the end, because a browser stops when its error output is full.
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                if let Some((_, address)) = line.split_once("DevTools listening on ") {
                    // The receiver is gone if the test has failed.
                    let _sent = found.send(address.to_owned());
                }
            }
        });
        let mut unborn = Unborn(Some(child));
        let address = address.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("the browser says no address"));
        let host = address.strip_prefix("ws://").unwrap().split('/').next().unwrap();
        let stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, _) = tungstenite::client(address.as_str(), stream).unwrap_or_else(|error| panic!("{error}"));
        let child = unborn.0.take().unwrap();
        let mut browser = Self { child, _folder: folder, socket, session: None, asked: 0, complaints: Vec::new() };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }))["targetId"].clone();
        let session = browser.call("Target.attachToTarget", json!({ "targetId": target, "flatten": true }));
        browser.session = Some(session["sessionId"].as_str().unwrap().to_owned());
        for domain in ["Page", "Runtime", "Log"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        Some(browser)
    }

    /// Calls a method of the protocol and returns its result.
    pub(crate) fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.attempt(method, parameters).unwrap_or_else(|error| panic!("{method}: {error}"))
    }

    /// Calls a method of the protocol and returns its result or its error.
    fn attempt(&mut self, method: &str, parameters: Value) -> Result<Value, Value> {
        self.asked += 1;
        let id = self.asked;
        let mut message = json!({ "id": id, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.socket.send(Message::text(message.to_string())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else { continue };
            let mut answer: Value = serde_json::from_str(&text).unwrap();
            if answer["id"] == json!(id) {
                return if answer["error"].is_null() { Ok(answer["result"].take()) } else { Err(answer["error"].take()) };
            }
            match answer["method"].as_str() {
                Some("Runtime.exceptionThrown") => self.complaints.push(answer["params"]["exceptionDetails"].to_string()),
                Some("Log.entryAdded") if answer["params"]["entry"]["level"] == "error" => {
                    self.complaints.push(answer["params"]["entry"].to_string())
                }
                Some(_) | None => {}
            }
        }
    }

    /// Evaluates an expression on the page and returns its value.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let mut answer = self.call("Runtime.evaluate", json!({ "expression": expression, "returnByValue": true, "awaitPromise": true }));
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {}", answer["exceptionDetails"]);
        answer["result"]["value"].take()
    }

    /// Waits until an expression is true. An exception counts as false, for instance while the page is loading.
    pub(crate) fn wait(&mut self, expression: &str) {
        let question = json!({ "expression": format!("!!({expression})"), "returnByValue": true });
        self.wait_for(expression, |browser| {
            browser.attempt("Runtime.evaluate", question.clone()).is_ok_and(|answer| answer["result"]["value"] == json!(true))
        });
    }

    /// Waits until `holds` returns true; `what` is for the message of a failure.
    pub(crate) fn wait_for(&mut self, what: &str, mut holds: impl FnMut(&mut Self) -> bool) {
        let begin = Instant::now();
        while !holds(self) {
            if begin.elapsed() > PATIENCE {
                let page = self.value("document.body.innerText");
                panic!("{what}: not within {PATIENCE:?}; complaints {:?}; the page: {page}", self.complaints);
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Opens an address and waits until the document is parsed.
    pub(crate) fn open(&mut self, address: &str) {
        self.call("Page.navigate", json!({ "url": address }));
        self.wait("location.href !== 'about:blank' && document.readyState === 'complete'");
    }

    /// Presses and releases a key in the focused element.
    pub(crate) fn press(&mut self, key: &str, code: u32) {
        for kind in ["rawKeyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code }));
            if kind == "rawKeyDown" && key == "Enter" {
                self.call("Input.dispatchKeyEvent", json!({ "type": "char", "key": key, "text": "\r" }));
            }
        }
    }

    /// Clicks in the middle of an element.
    pub(crate) fn click(&mut self, selector: &str) {
        self.value(&format!("document.querySelector({selector:?}).scrollIntoView({{ block: 'center' }})"));
        let middle = format!(
            "(() => {{ const r = document.querySelector({selector:?}).getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; }})()"
        );
        let middle = self.value(&middle);
        for kind in ["mousePressed", "mouseReleased"] {
            self.call("Input.dispatchMouseEvent", json!({ "type": kind, "x": middle[0], "y": middle[1], "button": "left", "clickCount": 1 }));
        }
    }

    /// Presses the mouse button at `from`, moves the mouse by `by` in small steps of 16 ms each, and keeps the button pressed.
    #[allow(dead_code, reason = "some tests drag nothing")]
    pub(crate) fn drag(&mut self, from: [f64; 2], by: [f64; 2], steps: u32) {
        let [x, y] = from;
        self.call("Input.dispatchMouseEvent", json!({ "type": "mousePressed", "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1 }));
        for step in 1..=steps {
            let share = f64::from(step) / f64::from(steps);
            let (x, y) = (x + by[0] * share, y + by[1] * share);
            self.call("Input.dispatchMouseEvent", json!({ "type": "mouseMoved", "x": x, "y": y, "button": "left", "buttons": 1 }));
            std::thread::sleep(Duration::from_millis(16));
        }
    }

    /// Replaces the text of a field.
    pub(crate) fn type_into(&mut self, selector: &str, text: &str) {
        self.click(selector);
        self.value(&format!("document.querySelector({selector:?}).select()"));
        self.call("Input.insertText", json!({ "text": text }));
    }

    /// Saves a screenshot as NAME.png if `COHAPTIC_SCREENSHOTS` names a folder.
    pub(crate) fn picture(&mut self, name: &str) {
        let Some(folder) = std::env::var_os("COHAPTIC_SCREENSHOTS") else { return };
        let size = self.call("Page.getLayoutMetrics", json!({}))["cssContentSize"].clone();
        let clip = json!({ "x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1 });
        let picture = self.call("Page.captureScreenshot", json!({ "format": "png", "clip": clip, "captureBeyondViewport": true }));
        let bytes = base64::engine::general_purpose::STANDARD.decode(picture["data"].as_str().unwrap()).unwrap();
        std::fs::write(PathBuf::from(folder).join(name).with_extension("png"), bytes).unwrap();
    }
}

/// A browser process that ends with the test even before its session begins.
struct Unborn(Option<Child>);

impl Drop for Unborn {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            let _ended = child.kill().and_then(|()| child.wait());
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // First an orderly end, so that the browser stops using its folder, then by force. Nothing here may panic, because a test may be failing.
        self.session = None;
        let close = json!({ "id": self.asked + 1, "method": "Browser.close" }).to_string();
        let _asked = self.socket.send(Message::text(close));
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_secs(10) {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ended = self.child.kill().and_then(|()| self.child.wait());
    }
}
