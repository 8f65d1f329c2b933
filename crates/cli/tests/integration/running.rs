//! Commands that run until they are stopped, their messages, and their live control.

use std::io::{self, BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::integration::desk::Outcome;

/// Time limit of every wait. An awaited event takes milliseconds, but the machine may be busy.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// Calls again as long as a signal interrupts the call. A read with a time limit ends with `EINTR` when a handler runs (`signal(7)`), and the process of the tests
/// handles signals of commands that other tests run in the same process.
pub(crate) fn uninterrupted<T>(mut call: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    loop {
        match call() {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            result => return result,
        }
    }
}

/// Command in the background, which is ended at the end of the test, also of a failing one.
pub(crate) struct Running {
    child: Option<Child>,
    lines: Receiver<String>,
    reading: Option<JoinHandle<String>>,
}

impl Running {
    pub(crate) fn begin(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (line, lines) = channel();
        let stderr: ChildStderr = child.stderr.take().unwrap();
        let reading = thread::spawn(move || {
            let mut all = String::new();
            for said in BufReader::new(stderr).lines().map_while(Result::ok) {
                all.push_str(&said);
                all.push('\n');
                // When nobody waits for it any more.
                let _ = line.send(said);
            }
            all
        });
        Self { child: Some(child), lines, reading: Some(reading) }
    }

    /// Waits for the next line on standard error that begins with `beginning`, and returns the rest of the line.
    pub(crate) fn said(&self, beginning: &str) -> String {
        let begin = Instant::now();
        loop {
            let left = PATIENCE.saturating_sub(begin.elapsed());
            let line = self.lines.recv_timeout(left).unwrap_or_else(|error| panic!("nothing that begins with {beginning:?} was said: {error}"));
            if let Some(rest) = line.strip_prefix(beginning) {
                return rest.to_owned();
            }
        }
    }

    /// Waits for the message about the next port, and returns its address and its purpose.
    pub(crate) fn port(&self) -> (SocketAddr, String) {
        let said = self.said("listening on ");
        let (address, purpose) = said.split_once(" for datagrams to ").or_else(|| said.split_once(" for connections to ")).unwrap();
        (address.parse().unwrap(), purpose.to_owned())
    }

    /// Returns the number of the process.
    pub(crate) fn id(&self) -> String {
        self.child.as_ref().unwrap().id().to_string()
    }

    /// Sends a signal, waits for the end of the command, and returns its outcome.
    pub(crate) fn end_by(self, signal: &str) -> Outcome {
        assert!(Command::new("kill").args([signal, &self.id()]).status().unwrap().success());
        self.end()
    }

    /// Kills the command at once: it cannot finish anything.
    pub(crate) fn kill(mut self) {
        let mut child = self.child.take().unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
    }

    /// Waits until the command ends by itself, and returns its outcome.
    pub(crate) fn end(self) -> Outcome {
        self.end_within(PATIENCE)
    }

    pub(crate) fn end_within(mut self, patience: Duration) -> Outcome {
        let begin = Instant::now();
        // A report is longer than a pipe holds only for thousands of links.
        while self.child.as_mut().unwrap().try_wait().unwrap().is_none() {
            assert!(begin.elapsed() < patience, "it does not end");
            thread::sleep(Duration::from_millis(5));
        }
        let mut output = self.child.take().unwrap().wait_with_output().unwrap();
        output.stderr = self.reading.take().unwrap().join().unwrap().into_bytes();
        Outcome::of(output)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            drop(child.kill());
            drop(child.wait());
        }
    }
}

/// Live control of a command that was started with `--control --token-file token`.
pub(crate) struct Client {
    address: SocketAddr,
}

/// Content of the file `token`.
pub(crate) const TOKEN: &str = "0123456789-abcdefghijklm";

impl Client {
    pub(crate) fn of(running: &Running) -> Self {
        let url = running.said("live control: http://");
        let (address, rest) = url.split_once('/').unwrap();
        assert!(rest.contains(TOKEN), "{url}");
        Self { address: address.parse().unwrap() }
    }

    /// Asks over a connection of its own: the status and the body.
    pub(crate) fn ask(&self, method: &str, path: &str, body: &str) -> (u16, String) {
        self.ask_as(&format!("Authorization: Bearer {TOKEN}\r\n"), method, path, body)
    }

    pub(crate) fn ask_as(&self, who: &str, method: &str, path: &str, body: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (address, length) = (self.address, body.len());
        let head = format!("{method} {path} HTTP/1.1\r\nHost: {address}\r\n{who}Connection: close\r\nContent-Length: {length}\r\n\r\n");
        stream.write_all((head + body).as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        (head.split(' ').nth(1).unwrap().parse().unwrap(), body.to_owned())
    }

    pub(crate) fn json(&self, method: &str, path: &str, body: &str) -> Value {
        let (status, body) = self.ask(method, path, body);
        assert_eq!(status, 200, "{method} {path}: {body}");
        serde_json::from_str(&body).unwrap_or_else(|error| panic!("{error} in {body}"))
    }
}
