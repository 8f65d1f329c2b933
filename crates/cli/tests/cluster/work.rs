//! Campaign of some seconds, during which one worker is killed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// Two users over links that lose and delay at random.
const SCENE: &str = r#"
[scene]
title    = "Two users"
duration = "2s"

[object]
mass = 0.3

[coordination]
strategy  = "average-position"
stiffness = 1000.0
damping   = 20.0
update    = "8ms"

[peer]
device   = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 3500.0, damping = 5.0 }

[[peers]]
name = "left"
hand = { force = 1.5 }

[[peers]]
name = "right"

[link]
delay  = "24ms"
jitter = "2ms"
loss   = "10%"
"#;

/// The work without its folder: 64 parts of 64 runs.
const WORK: &str = "campaign scene.toml --vary link.loss=0%..30%/4 --runs 1024 --part 64 --threads 1 --no-plot";

/// Number of shards of the campaign.
pub(crate) const SHARDS: usize = 4;

/// Time limit of every wait, far longer than any wait takes on a slow machine.
const PATIENCE: Duration = Duration::from_secs(240);

/// Folder with a scene, in which processes do the campaign.
pub(crate) struct Work(TempDir);

impl Work {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
        Self(folder)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A file of `docs/examples/cluster`, put into the folder.
    pub(crate) fn bring(&self, name: &str) {
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/examples/cluster").join(name);
        fs::copy(from, self.path(name)).unwrap();
    }

    /// A program in this folder, which finds `cohaptic` and is not taken for a task of a scheduler that runs the tests.
    pub(crate) fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        let program = program_path();
        let folder = program.parent().unwrap();
        let path = std::env::var("PATH").unwrap_or_default();
        command.current_dir(self.0.path()).env("PATH", format!("{}:{path}", folder.display())).stdin(Stdio::null());
        for (name, _) in std::env::vars() {
            if ["SLURM_", "PARALLEL_", "OMPI_", "PMI_"].iter().any(|begin| name.starts_with(begin)) {
                command.env_remove(name);
            }
        }
        command
    }

    /// `cohaptic` with the words of the work and these.
    pub(crate) fn cohaptic(&self, options: &str) -> Command {
        let mut command = self.command(program_path());
        command.args(words()).args(options.split(' '));
        command
    }

    /// Returns the command that does the campaign on two threads.
    pub(crate) fn on_two_threads(&self, options: &str) -> Command {
        let mut command = self.command(program_path());
        command.args(words().into_iter().map(|word| if word == "1" { "2" } else { word })).args(options.split(' '));
        command
    }

    /// Waits until a worker is in the middle of its shard, and kills the worker. Returns the number of the killed process.
    pub(crate) fn kill_a_worker(&self, kill: impl FnOnce(u32)) -> u32 {
        let process = wait_for("a worker in the middle of its shard", || {
            let entries = fs::read_dir(self.path("losses")).ok()?;
            entries.flatten().find_map(|entry| {
                let name = entry.file_name().into_string().ok()?;
                let log = fs::read_to_string(entry.path()).ok().filter(|_| name.starts_with("worker-"))?;
                // It has 16 parts to do.
                let is_in_the_middle = (1..8).contains(&log.matches("\npiece ").count()) && !log.contains("\nend ");
                log.split(' ').nth(3).filter(|_| is_in_the_middle)?.parse().ok()
            })
        });
        kill(process);
        process
    }

    /// Checks by its log that a process was killed during its shard.
    pub(crate) fn assert_killed(&self, process: u32) {
        let logs: Vec<String> =
            fs::read_dir(self.path("losses")).unwrap().map(|entry| fs::read_to_string(entry.unwrap().path()).unwrap_or_default()).collect();
        let log = logs.iter().find(|log| log.starts_with("shard ") && log.contains(&format!(" process {process} "))).unwrap();
        assert!(!log.contains("\nend "), "it ended by itself: {log}");
    }

    /// Checks that the table and the names of files are those of a campaign in one process.
    pub(crate) fn assert_whole(&self) {
        let output = self.cohaptic("--out whole").output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let [found, expected] = ["losses", "whole"].map(|folder| fs::read(self.path(folder).join("runs.parquet")).unwrap());
        assert!(found == expected, "other bytes");
        let names = |folder: &str| {
            let mut names: Vec<_> = fs::read_dir(self.path(folder)).unwrap().map(|entry| entry.unwrap().file_name()).collect();
            names.sort();
            names
        };
        assert_eq!(names("losses"), names("whole"));
    }
}

/// Returns the path of the tested program: the value of `COHAPTIC_PROGRAM`, such as a release build, or the program built with these tests.
fn program_path() -> PathBuf {
    let named = std::env::var_os("COHAPTIC_PROGRAM").map(|named| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(named);
        path.canonicalize().unwrap()
    });
    named.unwrap_or_else(|| PathBuf::from(env!("CARGO_BIN_EXE_cohaptic")))
}

/// The words of the work.
pub(crate) fn words() -> Vec<&'static str> {
    WORK.split(' ').collect()
}

/// Returns whether a program is installed.
pub(crate) fn has(program: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(program).is_file())
}

/// Asks again and again.
pub(crate) fn wait_for<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(begun.elapsed() < PATIENCE, "waited in vain for {what}");
        sleep(Duration::from_millis(20));
    }
}

pub(crate) fn kill(process: u32) {
    assert!(Command::new("kill").args(["-KILL", &process.to_string()]).status().unwrap().success());
}

/// A process that goes on until this value is dropped.
pub(crate) struct Service(Child);

impl Service {
    pub(crate) fn start(command: &mut Command) -> Self {
        Self(command.spawn().unwrap())
    }

    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
