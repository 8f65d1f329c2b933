//! Place of a user: a folder with scenes, and a shell.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

use crate::process::output;

/// A folder of its own for one test, removed at the end.
pub(crate) struct Desk(TempDir);

/// No command of a test takes that long, however busy the machine is: one that does hangs.
const AT_MOST: Duration = Duration::from_secs(900);

/// Exit status and outputs of a command.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) status: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Desk {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// Creates a desk with one file.
    pub(crate) fn with(name: &str, scene: &str) -> Self {
        let desk = Self::new();
        desk.write(name, scene);
        desk
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }

    /// Gives a file these permissions, where the system has some.
    pub(crate) fn set_mode(&self, name: &str, mode: u32) {
        #[cfg(unix)]
        fs::set_permissions(self.path(name), std::os::unix::fs::PermissionsExt::from_mode(mode)).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The files of a folder, sorted; those of folders within are left out.
    pub(crate) fn files(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).unwrap().map(Result::unwrap);
        let mut files: Vec<String> = entries.filter(|entry| !entry.path().is_dir()).map(|entry| entry.file_name().into_string().unwrap()).collect();
        files.sort();
        files
    }

    /// `cohaptic` with these words, as they would be typed; single quotes keep spaces and double quotes, as in a shell.
    pub(crate) fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cohaptic"));
        command.args(words(line)).current_dir(self.0.path()).stdin(Stdio::null());
        command
    }

    pub(crate) fn cohaptic(&self, line: &str) -> Outcome {
        self.cohaptic_within(AT_MOST, line)
    }

    /// Like `cohaptic`, but ends a command that takes longer than `patience`, which then has no status. For commands that would not end if they were not
    /// refused.
    pub(crate) fn cohaptic_within(&self, patience: Duration, line: &str) -> Outcome {
        Outcome::of(output(&mut self.command(line), b"", patience))
    }

    /// Like `cohaptic`, with these bytes on standard input.
    pub(crate) fn piped(&self, line: &str, input: impl AsRef<[u8]>) -> Outcome {
        Outcome::of(output(&mut self.command(line), input.as_ref(), AT_MOST))
    }

    /// Returns the output of a command, which must succeed. Standard error may name the files written and the expected duration, which depends on the machine,
    /// and nothing else.
    pub(crate) fn text(&self, line: &str) -> String {
        let outcome = self.cohaptic(line);
        assert_eq!(outcome.status, Some(0), "{line}: {}", outcome.stderr);
        // A slow machine is told what a part costs, or how far a search is after a second.
        let is_duration = |note: &str| note.contains(": about ") || note.contains(" looked at in ");
        let is_usual = |line: &str| line.starts_with("wrote ") || line.strip_prefix("note: ").is_some_and(is_duration);
        assert!(outcome.stderr.lines().all(is_usual), "{line}: {}", outcome.stderr);
        outcome.stdout
    }

    /// Returns the document that a command prints. The command must succeed.
    pub(crate) fn json(&self, line: &str) -> Value {
        parse(&self.text(line))
    }
}

impl Outcome {
    /// Takes the outputs of a process. Standard error is no terminal, so it holds messages only, and it must not hold the marks of a panic.
    pub(crate) fn of(output: std::process::Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).expect("all output is UTF-8");
        let outcome = Self { status: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) };
        assert!(!outcome.stderr.contains("panicked") && outcome.status != Some(101), "{outcome:#?}");
        outcome
    }

    /// Checks that the command was refused with this status and a message with all of the parts, and that it printed nothing else than, with `--json`, the
    /// document of the error.
    pub(crate) fn assert_refused(&self, status: i32, parts: &[&str]) {
        assert_eq!(self.status, Some(status), "{}{}", self.stdout, self.stderr);
        if !self.stdout.is_empty() {
            let document = parse(&self.stdout);
            assert_eq!((&document["schema"], &document["status"]), (&"cohaptic/error".into(), &status.into()), "{}", self.stdout);
        }
        for part in parts {
            assert!(self.stderr.contains(part), "no {part:?} in:\n{}", self.stderr);
        }
    }
}

/// Parses a text of one JSON document that ends with a line break.
pub(crate) fn parse(text: &str) -> Value {
    assert!(text.ends_with("}\n"), "{text:?}");
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error} in {text}"))
}

/// Returns a document as text, without the duration of the run.
pub(crate) fn timeless(mut document: Value) -> String {
    let mut runs = vec![&mut document];
    while let Some(run) = runs.pop() {
        let run = run.as_object_mut().unwrap();
        assert!(run.remove("wall_s").is_some() && run.remove("realtime_factor").is_some());
        // The run of --against stands within a document, which says once of which kind it is.
        let _ = (run.remove("schema"), run.remove("version"));
        runs.extend(run.get_mut("against"));
    }
    serde_json::to_string_pretty(&document).unwrap()
}

fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quoted) = (Vec::new(), None, false);
    for letter in line.chars() {
        match letter {
            '\'' => {
                quoted = !quoted;
                word.get_or_insert_with(String::new);
            }
            ' ' if !quoted => words.extend(word.take()),
            letter => word.get_or_insert_with(String::new).push(letter),
        }
    }
    words.extend(word);
    words
}

/// Returns the path of a scene that ships with the program.
pub(crate) fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios").join(name)
}
