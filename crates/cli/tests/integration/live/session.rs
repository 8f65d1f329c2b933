//! Running process of `cohaptic live`, `cohaptic play` or `cohaptic study`.

use std::io::{BufRead as _, BufReader, Read as _};
use std::net::SocketAddr;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread::JoinHandle;

use serde_json::Value;

use super::http::Control;
use super::{PATIENCE, wait_for};
use crate::integration::desk::{Desk, Outcome, parse};

/// Running session, which ends with the test.
pub(super) struct Session {
    child: Child,
    said: Receiver<String>,
    heard: Vec<String>,
    readers: Option<[JoinHandle<String>; 2]>,
}

impl Session {
    /// Begins one: `words` are what follows `live` on the command line.
    pub(super) fn begin(desk: &Desk, words: &str) -> Self {
        Self::of(desk, &format!("live {words}"))
    }

    /// Starts `cohaptic play`. `words` are the arguments after `play`.
    pub(super) fn play(desk: &Desk, words: &str) -> Self {
        Self::of(desk, &format!("play {words}"))
    }

    /// Starts `cohaptic study`. `words` are the arguments after `study`.
    pub(super) fn study(desk: &Desk, words: &str) -> Self {
        Self::of(desk, &format!("study {words}"))
    }

    /// Kills the process, as a loss of power does: the process cannot finish anything.
    pub(super) fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    fn of(desk: &Desk, line: &str) -> Self {
        let mut child = desk.command(&format!("{line} --no-priority")).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (mut out, err) = (child.stdout.take().unwrap(), BufReader::new(child.stderr.take().unwrap()));
        let (say, said) = channel();
        // Both are read to their ends: a program that cannot print stops.
        let out = std::thread::spawn(move || {
            let mut text = String::new();
            out.read_to_string(&mut text).unwrap();
            text
        });
        let err = std::thread::spawn(move || {
            let mut text = String::new();
            for line in err.lines().map(Result::unwrap) {
                text.push_str(&line);
                text.push('\n');
                // Nobody listens any more once the test knows enough.
                let _heard = say.send(line);
            }
            text
        });
        Self { child, said, heard: Vec::new(), readers: Some([out, err]) }
    }

    /// Waits for a line of standard error that begins with `words`, and returns the rest of the line.
    pub(super) fn told(&mut self, words: &str) -> String {
        loop {
            if let Some(line) = self.heard.iter().find_map(|line| line.strip_prefix(words)) {
                return line.to_owned();
            }
            let line = self.said.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("it did not say \"{words}\" but {:?}", self.heard));
            self.heard.push(line);
        }
    }

    /// Returns the address to which peers in other programs send.
    pub(super) fn address(&mut self) -> SocketAddr {
        self.told("listening on ").split(' ').next().unwrap().parse().unwrap()
    }

    /// Returns the live control of the session.
    pub(super) fn control(&mut self) -> Control {
        Control::at(&self.url())
    }

    pub(super) fn url(&mut self) -> String {
        self.told("live control: ")
    }

    /// Returns the memory of the process [KiB]; `None` if the system does not tell.
    pub(super) fn memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.trim().strip_suffix(" kB")?.trim().parse().ok()
    }

    /// Presses Ctrl-C.
    pub(super) fn interrupt(&self) {
        assert!(Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap().success());
    }

    /// Waits for the end of the process, and returns its status and outputs.
    pub(super) fn outcome(mut self) -> Outcome {
        let status: ExitStatus = wait_for("the end of the session", || self.child.try_wait().unwrap());
        let [stdout, stderr] = self.readers.take().unwrap().map(|reader| reader.join().unwrap().into_bytes());
        Outcome::of(std::process::Output { status, stdout, stderr })
    }

    /// Ends the session, and returns its document.
    pub(super) fn end(self) -> Value {
        self.interrupt();
        let outcome = self.outcome();
        assert_eq!(outcome.status, Some(130), "{outcome:#?}");
        parse(&outcome.stdout)
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        // It has ended already, unless a test fails.
        let _ended = self.child.kill().and_then(|()| self.child.wait());
    }
}
