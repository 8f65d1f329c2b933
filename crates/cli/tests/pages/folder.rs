//! Place in which the commands of a page run: a folder with the scenes of the project, and a shell.

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use tempfile::TempDir;

use crate::pages::root;
use crate::process::output;

/// A command of a page that takes longer hangs. The longest one takes 3 minutes on a quiet machine with two cores, and more than 5 beside other programs.
const AT_MOST: Duration = Duration::from_secs(1800);

/// Outputs and statuses of a script.
#[derive(Debug)]
pub(crate) struct Outcome {
    /// Standard output and standard error, in the order of printing.
    pub(crate) printed: String,
    /// Exit status of each `cohaptic`, in order.
    pub(crate) statuses: Vec<i32>,
    /// Exit status of the script; `None` if the script was ended because it took too long.
    pub(crate) status: Option<i32>,
}

pub(crate) struct Folder(TempDir);

/// Script that runs the program and notes its exit status.
const WRAPPER: &str =
    "#!/bin/sh\n\"$COHAPTIC_PAGES_PROGRAM\" \"$@\" $COHAPTIC_PAGES_RUN_WITH\nstatus=$?\necho $status >>\"$COHAPTIC_PAGES_STATUSES\"\nexit $status\n";

impl Folder {
    pub(crate) fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        for name in ["bin", "desk", "home"] {
            fs::create_dir(folder.path(name)).unwrap();
        }
        let wrapper = folder.path("bin/cohaptic");
        fs::write(&wrapper, WRAPPER).unwrap();
        fs::set_permissions(&wrapper, fs::Permissions::from_mode(0o755)).unwrap();
        for (name, of) in [("scenarios", "scenarios"), ("studies", "studies"), ("docs", "docs"), ("programs", "crates/cli/tests/pages/programs")] {
            symlink(root().join(of), folder.path("desk").join(name)).unwrap();
        }
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: &str) {
        let path = self.path("desk").join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }

    /// Returns the content of a file that a command has written; `None` if the file does not exist.
    pub(crate) fn read(&self, name: &str) -> Option<String> {
        fs::read_to_string(self.path("desk").join(name)).ok()
    }

    /// Runs a script in `sh`, with the words `run_with` appended to those of every `cohaptic`.
    pub(crate) fn run(&self, script: &str, run_with: &str) -> Outcome {
        let log = self.path("statuses");
        fs::write(&log, "").unwrap();
        let path = std::env::var("PATH").unwrap_or_default();
        let mut command = Command::new("sh");
        command
            .args(["-c", &format!("exec 2>&1\n{script}")])
            .current_dir(self.path("desk"))
            .env("PATH", format!("{}:{path}", self.path("bin").display()))
            .env("HOME", self.path("home"))
            .env("COHAPTIC_PAGES_PROGRAM", env!("CARGO_BIN_EXE_cohaptic"))
            .env("COHAPTIC_PAGES_RUN_WITH", run_with)
            .env("COHAPTIC_PAGES_STATUSES", &log)
            .env_remove("COLUMNS");
        let output = output(&mut command, b"", AT_MOST);
        let statuses = fs::read_to_string(&log).unwrap().lines().map(|line| line.parse().unwrap()).collect();
        Outcome { printed: String::from_utf8(output.stdout).unwrap(), statuses, status: output.status.code() }
    }

    /// Returns whether a program is installed, or a line with more words than that succeeds.
    pub(crate) fn has(&self, needs: &str) -> bool {
        let line = if needs.contains(' ') { needs.to_owned() } else { format!("command -v {needs}") };
        self.run(&line, "").status == Some(0)
    }
}

#[test]
fn a_script_sees_the_scenes_and_its_statuses_are_noted() {
    let folder = Folder::new();
    folder.write("a.toml", "no scene\n");
    let outcome = folder.run("cohaptic check a.toml\ncohaptic explain scenarios/network/ideal.toml > said\ngrep -q lockstep said", "");
    assert_eq!((outcome.statuses, outcome.status), (vec![2, 0], Some(0)), "{}", outcome.printed);
    assert!(outcome.printed.contains("a.toml:1:4: "), "{}", outcome.printed);
    assert!(folder.has("sh") && !folder.has("no-such-program") && folder.has("test -d docs") && !folder.has("sh -c false"));
    assert_eq!(folder.run("cohaptic", "--version").statuses, [0]);
    assert!(folder.read("said").is_some_and(|said| said.contains("lockstep")) && folder.read("unsaid").is_none());
}
