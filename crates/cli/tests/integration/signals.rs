//! SIGINT while nobody reads standard output: computed results are written however long that takes, and a second signal ends the writing.

use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::integration::desk::{Desk, parse};
use crate::integration::interrupt::listens;
use crate::integration::running::PATIENCE;
use crate::integration::scenes::TWO;

/// The line of a command whose results take long to write.
const WRITES: &str =
    "interrupted: what was computed is written before the program ends, however long that takes; a second signal ends the program at once";

/// Command whose standard output blocks until the test reads.
struct Blocked {
    child: Child,
    stdout: UnixStream,
    stderr: BufReader<ChildStderr>,
}

impl Blocked {
    fn begin(desk: &Desk, line: &str) -> Self {
        let (stdout, full) = UnixStream::pair().unwrap();
        fill(&full);
        let mut child = desk.command(line).stdout(OwnedFd::from(full)).stderr(Stdio::piped()).spawn().unwrap();
        let stderr = BufReader::new(child.stderr.take().unwrap());
        Self { child, stdout, stderr }
    }

    fn signal(&self) {
        assert!(Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap().success());
    }

    /// Signals once `begun` says that the command is at work, and reads standard error up to the line that says that results are being written.
    fn interrupt(&mut self, begun: impl Fn(u32) -> bool) {
        let begin = Instant::now();
        while !begun(self.child.id()) {
            assert!(begin.elapsed() < PATIENCE, "it does not begin");
            sleep(Duration::from_millis(5));
        }
        self.signal();
        let mut said = String::new();
        while !said.ends_with(&format!("{WRITES}\n")) {
            assert!(self.stderr.read_line(&mut said).unwrap() > 0, "it ended with {:?}: {said}", self.child.wait());
        }
    }

    fn status(&mut self) -> Option<i32> {
        let begin = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code();
            }
            assert!(begin.elapsed() < PATIENCE, "it does not end");
            sleep(Duration::from_millis(5));
        }
    }

    /// Returns the output of the command, once the command has ended.
    fn printed(&mut self) -> String {
        let mut text = String::new();
        self.stdout.set_read_timeout(Some(PATIENCE)).unwrap();
        self.stdout.read_to_string(&mut text).unwrap();
        text.trim_start().to_owned()
    }

    /// The document of the command: somebody reads it at last.
    fn document(&mut self) -> Value {
        let document = parse(&self.printed());
        assert_eq!(self.status(), Some(130), "{document:#}");
        document
    }
}

impl Drop for Blocked {
    fn drop(&mut self) {
        // After a failed assertion it is still there.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

/// Writes white space, which no document minds, until there is no room any more.
fn fill(full: &UnixStream) {
    full.set_nonblocking(true).unwrap();
    for length in [4096, 1] {
        loop {
            match (&*full).write(&[b'\n'; 4096][..length]) {
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => panic!("{error}"),
            }
        }
    }
    full.set_nonblocking(false).unwrap();
}

/// Returns whether a file has any content.
fn has_content(desk: &Desk, file: &str) -> bool {
    desk.path(file).metadata().is_ok_and(|metadata| metadata.len() > 0)
}

#[test]
fn a_run_writes_its_summary_and_its_files_however_long_that_takes() {
    let desk = Desk::with("two.toml", TWO);
    let mut run = Blocked::begin(&desk, "run two.toml --json --out out --set scene.duration=24h");
    run.interrupt(|_| has_content(&desk, "out/trajectory.csv.partial"));
    let document = run.document();
    assert_eq!(document["ending"], "interrupted");
    let rows = desk.read("out/trajectory.csv").lines().count() as u64;
    assert_eq!(rows, 1 + 2 * document["ticks"].as_u64().unwrap());
    assert!(desk.files("out").iter().all(|name| !name.ends_with(".partial")));
}

/// A pipe is opened only once somebody reads it.
#[test]
fn a_run_waits_for_the_reader_of_its_links() {
    let desk = Desk::with("two.toml", TWO);
    assert!(Command::new("mkfifo").arg(desk.path("links")).status().unwrap().success());
    let mut run = Blocked::begin(&desk, "run two.toml --json --links links --set scene.duration=24h");
    run.interrupt(listens_and_computes);
    assert!(desk.read("links").starts_with("link,offered,"));
    assert_eq!(run.document()["ending"], "interrupted");
}

#[test]
fn a_link_says_what_it_achieved_until_then() {
    let desk = Desk::new();
    let mut link = Blocked::begin(&desk, "link delay=20ms loss=10% --packets 1000000000 --json --fates fates.csv");
    link.interrupt(|_| has_content(&desk, "fates.csv.partial"));
    let document = link.document();
    assert_eq!(document["interrupted"], true);
    assert_eq!(desk.read("fates.csv").lines().count() as u64, 1 + document["fates"]["offered"].as_u64().unwrap());
}

#[test]
fn a_check_says_which_scenes_were_checked() {
    let desk = Desk::with("two.toml", &format!("{TWO}\n[expect]\ndiscrepancy = {{ max = 1.0 }}\n"));
    let mut check = Blocked::begin(&desk, "check two.toml --json --set scene.duration=24h");
    check.interrupt(listens);
    assert_eq!(check.document()["scenes"][0]["passed"], false);
}

#[test]
fn a_relay_reports_what_its_links_did() {
    let desk = Desk::new();
    let mut relay = Blocked::begin(&desk, "relay --listen 127.0.0.1:0 --to 127.0.0.1:9 --json --no-priority delay 30ms");
    // The command says that it listens when its ports are open.
    let mut said = String::new();
    relay.stderr.read_line(&mut said).unwrap();
    assert!(said.starts_with("listening on "), "{said}");
    relay.interrupt(|_| true);
    assert_eq!(relay.document()["ending"], "interrupted");
}

#[test]
fn a_session_keeps_its_records_and_reports() {
    let desk = Desk::with("two.toml", TWO);
    let mut live = Blocked::begin(&desk, "live two.toml --json --no-priority --out out --for 1h");
    live.interrupt(|_| has_content(&desk, "out/trajectory.csv.partial"));
    let document = live.document();
    assert_eq!(document["ending"], "interrupted");
    assert_eq!(desk.read("out/trajectory.csv").lines().count() as u64, 1 + 2 * document["ticks"].as_u64().unwrap());
}

#[test]
fn a_device_that_was_watched_is_described() {
    let desk = Desk::new();
    let mut watch = Blocked::begin(&desk, "falcon watch --simulated --csv samples.csv --json --for 1h");
    watch.interrupt(|_| has_content(&desk, "samples.csv.partial"));
    assert_eq!(watch.document()["ending"], "interrupted");
    assert!(has_content(&desk, "samples.csv"));
}

/// Commands that keep finished results after an interruption report this, in words and in their documents.
#[test]
fn a_campaign_and_a_map_say_what_they_keep() {
    let desk = Desk::with("two.toml", TWO);
    for line in [
        "campaign two.toml --runs 1000000000 --json --out runs",
        "stability map two.toml --x coordination.stiffness=1..2 --y coordination.damping=0..1 --grid 1000x1000 --json --out map",
    ] {
        let mut command = Blocked::begin(&desk, line);
        command.interrupt(listens_and_computes);
        let document = command.document();
        assert_eq!(document["schema"], "cohaptic/error", "{line}");
        assert!(document["message"].as_str().unwrap().contains(" kept in "), "{line}: {document:#}");
    }
}

/// Returns whether a command listens to signals and has computed for a tenth of a second.
fn listens_and_computes(id: u32) -> bool {
    crate::integration::stop::has_worked(10, id)
}

#[test]
fn a_second_signal_ends_it_at_once() {
    let desk = Desk::with("two.toml", TWO);
    let mut run = Blocked::begin(&desk, "run two.toml --json --no-plot --set scene.duration=24h");
    run.interrupt(listens_and_computes);
    run.signal();
    assert_eq!((run.status(), run.printed().as_str()), (Some(130), ""));
}
