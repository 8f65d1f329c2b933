//! Runs what measures.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use cohaptic_benches::effort::Effort;

/// The programs that measure, as they lie beside this one.
#[derive(Debug)]
pub(crate) struct Programs {
    folder: PathBuf,
    pub(crate) effort: Effort,
}

impl Programs {
    pub(crate) fn beside_this_one(effort: Effort) -> Result<Self, String> {
        let here = std::env::current_exe().map_err(|error| format!("cannot tell where this program is: {error}"))?;
        Ok(Self { folder: here.with_file_name(""), effort })
    }

    /// The folder that commands on the page are typed in.
    pub(crate) fn root() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
    }

    /// What a program of this package prints: a page.
    pub(crate) fn table(&self, program: &str) -> Result<String, String> {
        let option = Some(self.effort.option()).filter(|option| !option.is_empty());
        self.printed(Command::new(self.path(program)).args(option), program)
    }

    /// Runs `cohaptic` with these arguments, none of which has a space in it, and returns what it prints.
    pub(crate) fn cohaptic(&self, arguments: &str) -> Result<String, String> {
        self.beside("cohaptic", arguments)
    }

    /// Runs a program that lies beside this one with these arguments, none of which has a space in it, and returns what it prints.
    pub(crate) fn beside(&self, program: &str, arguments: &str) -> Result<String, String> {
        eprintln!("      {program} {arguments}");
        self.printed(Command::new(self.path(program)).args(arguments.split(' ')), program)
    }

    /// What a line prints that is typed into a shell.
    pub(crate) fn shell(&self, line: &str) -> Result<String, String> {
        self.printed(Command::new("sh").args(["-c", line]).env("COHAPTIC", self.path("cohaptic")), line)
    }

    fn path(&self, program: &str) -> PathBuf {
        self.folder.join(format!("{program}{}", std::env::consts::EXE_SUFFIX))
    }

    fn printed(&self, command: &mut Command, name: &str) -> Result<String, String> {
        let command = command.current_dir(Self::root()).stdin(Stdio::null()).stderr(Stdio::inherit());
        let output = command.output().map_err(|error| format!("cannot run {name}: {error} (looked in {})", self.folder.display()))?;
        if !output.status.success() {
            return Err(format!("{name} failed: {}", output.status));
        }
        String::from_utf8(output.stdout).map_err(|_| format!("{name} printed text that is not UTF-8"))
    }
}

/// What came of a step.
#[derive(Debug)]
pub(crate) struct Measured {
    /// What stands below the commands.
    pub(crate) body: String,
    /// Files in `docs/`, and their content.
    pub(crate) files: Vec<(PathBuf, String)>,
}

impl Measured {
    /// The note on a step that could not be done here.
    pub(crate) fn nothing(why: &str) -> Self {
        Self { body: format!("**Not measured then:** {why}. The page linked above, if it is there, is from an earlier day.\n"), files: Vec::new() }
    }
}
