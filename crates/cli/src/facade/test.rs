//! `cohaptic test`: calls `cargo test` with the generated package in the place of tokio, and leaves `Cargo.lock` as it was.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, ExitCode, ExitStatus};
use std::thread;
use std::time::Duration;

use super::cargo::{cargo, missing};
use super::workspace::Workspace;
use crate::failure::Failure;
use crate::file::{read_text, write_file};
use crate::interrupt;

/// Interval at which a signal to this program is looked for.
const LOOK: Duration = Duration::from_millis(20);
/// Number of looks after a signal for which cargo may end by itself: a terminal sends Ctrl-C to cargo as well.
const TO_END: u32 = 100;

/// Runs `cargo test` with `arguments`.
pub(super) fn run(arguments: &[OsString]) -> Result<ExitCode, Failure> {
    for option in ["--locked", "--frozen"] {
        if arguments.iter().take_while(|argument| *argument != "--").any(|argument| argument == option) {
            return Err(Failure::Input(format!(
                "{option} cannot be: while the tests run, Cargo.lock names another tokio. Expected no {option}; the file is put back afterwards"
            )));
        }
    }
    // The tests are those of this workspace, also if there is another one for tests.
    let workspace = Workspace::here(Some(Path::new(".")))?;
    let folder = workspace.folder();
    super::files::make_folder(&folder)?;
    let saved = Saved::new(&workspace.lock_file(), folder.join("Cargo.lock.saved"))?;
    let (_, package) = super::generate(&workspace)?;
    // From here on the program ends by itself after a signal, when cargo has ended and the file is put back.
    interrupt::has_results();
    let patch = format!("patch.crates-io.tokio.path={}", toml::Value::String(package.display().to_string()));
    let mut command = cargo(Path::new("."));
    command.env("CARGO_TARGET_DIR", folder.join("build")).arg("--config").arg(patch).arg("test").args(arguments);
    let child = command.spawn().map_err(|error| missing(&error))?;
    // A second signal ends this program at once.
    let again = saved.clone();
    interrupt::before_exit(move || drop(again.put_back()));
    let status = wait(child);
    saved.put_back()?;
    saved.forget();
    status.map(code).map_err(|error| Failure::System(format!("cargo cannot be waited for: {error}")))
}

/// Waits for cargo. Ends cargo if this program is to end and cargo goes on: a signal may have been sent to this program alone.
fn wait(mut child: Child) -> std::io::Result<ExitStatus> {
    let mut looks = 0;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if interrupt::requested() {
            looks += 1;
            if looks == TO_END {
                child.kill()?;
            }
        }
        thread::sleep(LOOK);
    }
}

/// Returns the exit status of cargo as that of this program.
fn code(status: ExitStatus) -> ExitCode {
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    code.map_or(ExitCode::FAILURE, ExitCode::from)
}

/// Content of `Cargo.lock` before the tests.
#[derive(Clone, Debug)]
struct Saved {
    path: PathBuf,
    /// A copy on disk, for the case that this program is killed. The next call then puts the file back.
    copy: PathBuf,
    /// Text of the file; `None` if the file did not exist.
    content: Option<String>,
}

impl Saved {
    fn new(path: &Path, copy: PathBuf) -> Result<Self, Failure> {
        let is_changed = |text: &str| text.contains(super::package::REAL);
        let mut content = if path.exists() { Some(read_text(path)?) } else { None };
        // An earlier call was killed before it could put the file back.
        if content.as_deref().is_some_and(is_changed) && copy.exists() {
            content = Some(read_text(&copy)?);
        }
        let saved = Self { path: path.to_owned(), copy, content };
        saved.put_back()?;
        if let Some(content) = &saved.content {
            write_file(&saved.copy, content)?;
        }
        Ok(saved)
    }

    /// Restores the file if it has changed. Removes the file if it did not exist before.
    fn put_back(&self) -> Result<(), Failure> {
        match &self.content {
            Some(content) if fs::read(&self.path).is_ok_and(|now| now == content.as_bytes()) => Ok(()),
            Some(content) => write_file(&self.path, content),
            None if self.path.exists() => {
                fs::remove_file(&self.path).map_err(|error| Failure::File { verb: "remove", path: self.path.clone(), error })
            }
            None => Ok(()),
        }
    }

    fn forget(&self) {
        // A copy that stays is the same as the file, and the next call writes it anew.
        let _ = fs::remove_file(&self.copy);
    }
}
