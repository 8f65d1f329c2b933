//! Finds, compiles and runs the example programs, and reads their summaries.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

/// Time limit for a program. A program of these tests ends within a minute even on a busy machine, so that a program that takes longer hangs.
const AT_MOST: Duration = Duration::from_secs(120);

#[derive(Clone, Copy, Debug)]
pub(super) enum Language {
    Python,
    Cpp,
}

/// Program that can be run: the command and its first arguments.
#[derive(Clone, Debug)]
pub(super) struct Program {
    words: Vec<PathBuf>,
}

impl Program {
    pub(super) fn command(&self) -> Command {
        let mut command = Command::new(&self.words[0]);
        command.args(&self.words[1..]).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }
}

/// The compiled C++ program, made once for all tests, and its folder. `None` on a machine without a compiler.
static CPP: LazyLock<Option<(TempDir, PathBuf)>> = LazyLock::new(|| {
    let compiler = ["c++", "g++", "clang++"].into_iter().find(|name| is_there(name))?;
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("udp_peer");
    let output = Command::new(compiler)
        .args(["-std=c++17", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror", "-pthread", "-o"])
        .args([&program, &example("udp_peer.cpp")])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some((folder, program))
});

impl Language {
    /// Returns the program. Prints a message and returns `None` if the machine lacks the interpreter or the compiler.
    pub(super) fn program(self) -> Option<Program> {
        let words = match self {
            Self::Python => is_there("python3").then(|| vec!["python3".into(), example("udp_peer.py")]),
            Self::Cpp => CPP.as_ref().map(|(_, program)| vec![program.clone()]),
        };
        if words.is_none() {
            eprintln!("skipped: no {} was found", if matches!(self, Self::Python) { "python3" } else { "C++ compiler" });
        }
        words.map(|words| Program { words })
    }
}

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/examples").join(name)
}

fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

/// Running program, which is killed when dropped, so that a failing test leaves no program behind.
pub(super) struct Running {
    child: Child,
    since: Instant,
}

impl Running {
    pub(super) fn new(child: Child) -> Self {
        Self { child, since: Instant::now() }
    }

    /// Returns whether the program is still running. Fails if the program has been running for longer than `AT_MOST`.
    pub(super) fn is_running(&mut self) -> bool {
        let running = self.child.try_wait().unwrap().is_none();
        assert!(!running || self.since.elapsed() < AT_MOST, "it does not end");
        running
    }

    /// Waits for the end of the program. Returns whether the program succeeded, its standard output and its standard error.
    pub(super) fn output(mut self) -> (bool, String, String) {
        while self.is_running() {
            std::thread::sleep(Duration::from_millis(2));
        }
        let mut texts = [String::new(), String::new()];
        std::io::Read::read_to_string(&mut self.child.stdout.take().unwrap(), &mut texts[0]).unwrap();
        std::io::Read::read_to_string(&mut self.child.stderr.take().unwrap(), &mut texts[1]).unwrap();
        let success = self.child.wait().unwrap().success();
        let [out, error] = texts;
        (success, out, error)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // The program has ended already, unless a test fails.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Summary that a program prints at its end.
#[derive(Debug)]
pub(super) struct Summary {
    pub(super) ticks: u64,
    pub(super) sent: u64,
    pub(super) joinings: u64,
    pub(super) ignored: u64,
    pub(super) position: Vec<f64>,
    pub(super) velocity: Vec<f64>,
    pub(super) device: Vec<f64>,
    pub(super) orientation: Option<[f64; 4]>,
    pub(super) others: Vec<Other>,
}

#[derive(Debug)]
pub(super) struct Other {
    pub(super) sender: u64,
    pub(super) received: u64,
    pub(super) late: u64,
    pub(super) stale: bool,
}

/// Waits for the end of the program and returns its summary.
pub(super) fn finish(child: Child) -> Summary {
    summary(Running::new(child))
}

pub(super) fn summary(running: Running) -> Summary {
    let (success, out, error) = running.output();
    assert!(success && error.is_empty(), "{error}");
    let value: Value = serde_json::from_str(&out).unwrap();
    let count = |key: &str| value[key].as_u64().unwrap();
    let numbers = |key: &str| value[key].as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect();
    let others = value["others"].as_array().unwrap().iter();
    Summary {
        ticks: count("ticks"),
        sent: count("sent"),
        joinings: count("joinings"),
        ignored: count("ignored"),
        position: numbers("position"),
        velocity: numbers("velocity"),
        device: numbers("device"),
        orientation: value["orientation"].as_array().map(|q| std::array::from_fn(|place| q[place].as_f64().unwrap())),
        others: others
            .map(|other| Other {
                sender: other["sender"].as_u64().unwrap(),
                received: other["received"].as_u64().unwrap(),
                late: other["late"].as_u64().unwrap(),
                stale: other["stale"].as_bool().unwrap(),
            })
            .collect(),
    }
}
