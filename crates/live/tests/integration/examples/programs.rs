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
    /// The bridge of `docs/examples/chai3d`, compiled with the stand-in for CHAI3D.
    Chai3d,
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

/// Options with which each compiled program of these tests must pass.
const STRICT: &[&str] = &["-O1", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror"];

/// Compiler of these tests.
#[derive(Clone, Copy, Debug)]
pub(super) enum Compiler {
    C99,
    Cpp11,
    Cpp17,
    /// MinGW-w64, whose programs are not run.
    Windows,
}

impl Compiler {
    /// Returns the command of the compiler with its strict options and the folder of the examples among the include folders, or `None` on a machine without
    /// the compiler.
    fn command(self) -> Option<Command> {
        let (names, standard) = match self {
            Self::C99 => (["cc", "gcc", "clang"], "-std=c99"),
            Self::Cpp11 => (["c++", "g++", "clang++"], "-std=c++11"),
            Self::Cpp17 => (["c++", "g++", "clang++"], "-std=c++17"),
            Self::Windows => (["x86_64-w64-mingw32-g++-posix", "x86_64-w64-mingw32-g++", "x86_64-w64-mingw32-c++"], "-std=c++11"),
        };
        let mut command = Command::new(names.into_iter().find(|name| is_there(name))?);
        command.arg(standard).args(STRICT).arg("-I").arg(example(""));
        Some(command)
    }

    /// Compiles a program from one source file. Returns the program and its folder. Prints a message and returns `None` on a machine without the compiler.
    /// `extra`: further options, before the source.
    pub(super) fn compile(self, source: &Path, extra: &[&str]) -> Option<(TempDir, PathBuf)> {
        let Some(mut command) = self.command() else {
            eprintln!("skipped: no compiler of {self:?} was found");
            return None;
        };
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("program");
        // A test in C is compiled as C++ too, under a name that says so.
        let renamed = folder.path().join("program.cpp");
        let is_c = source.extension().is_some_and(|extension| extension == "c");
        let source = if is_c && !matches!(self, Self::C99) {
            std::fs::copy(source, &renamed).unwrap();
            &renamed
        } else {
            source
        };
        // Libraries come after the sources that need them.
        let libraries: &[&str] = if matches!(self, Self::Windows) { &["-lws2_32", "-lbcrypt", "-lwinmm"] } else { &["-pthread", "-lm"] };
        let output = command.args(extra).arg(source).args(libraries).arg("-o").arg(&program).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        Some((folder, program))
    }

    /// Returns whether programs with these options can be compiled and run here.
    pub(super) fn can(self, options: &[&str]) -> bool {
        let folder = tempfile::tempdir().unwrap();
        let (source, program) = (folder.path().join("empty.c"), folder.path().join("empty"));
        std::fs::write(&source, "int main(void) { return 0; }\n").unwrap();
        let Some(mut command) = self.command() else { return false };
        let compiled = command.args(options).arg(&source).arg("-o").arg(&program).output().is_ok_and(|output| output.status.success());
        compiled && Command::new(&program).status().is_ok_and(|status| status.success())
    }
}

/// The compiled C++ program, made once for all tests, and its folder. `None` on a machine without a compiler.
static CPP: LazyLock<Option<(TempDir, PathBuf)>> = LazyLock::new(|| Compiler::Cpp17.compile(&example("udp_peer.cpp"), &[]));

/// The compiled bridge and its folder. `None` on a machine without a compiler.
static BRIDGE: LazyLock<Option<(TempDir, PathBuf)>> = LazyLock::new(|| {
    let stub = example("chai3d/stub");
    Compiler::Cpp11.compile(&example("chai3d/bridge.cpp"), &["-I", stub.to_str().unwrap()])
});

impl Language {
    /// Returns the program. Prints a message and returns `None` if the machine lacks the interpreter or the compiler.
    pub(super) fn program(self) -> Option<Program> {
        let words = match self {
            Self::Python => is_there("python3").then(|| vec!["python3".into(), example("udp_peer.py")]),
            Self::Cpp => CPP.as_ref().map(|(_, program)| vec![program.clone()]),
            Self::Chai3d => BRIDGE.as_ref().map(|(_, program)| vec![program.clone()]),
        };
        if words.is_none() {
            eprintln!("skipped: no {} was found", if matches!(self, Self::Python) { "python3" } else { "C++ compiler" });
        }
        words.map(|words| Program { words })
    }
}

/// Returns the path of a file of `docs/examples`.
pub(super) fn example(name: &str) -> PathBuf {
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
    pub(super) device_velocity: Vec<f64>,
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
    // The state of a device is missing where the device is not simulated by the program.
    let numbers = |key: &str| value[key].as_array().into_iter().flatten().map(|number| number.as_f64().unwrap()).collect();
    let others = value["others"].as_array().unwrap().iter();
    Summary {
        ticks: count("ticks"),
        sent: count("sent"),
        joinings: count("joinings"),
        ignored: count("ignored"),
        position: numbers("position"),
        velocity: numbers("velocity"),
        device: numbers("device"),
        device_velocity: numbers("device_velocity"),
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
