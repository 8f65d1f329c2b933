//! Writes answers to standard output, as text for people or as one JSON document.

use std::io::{self, Write as _};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

pub(crate) use cohaptic_answers::{are, figure};
use cohaptic_units::visible_lines;
use serde::Serialize;

use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::interrupt;

/// Set if answers are JSON documents, including the answer to a wrong argument.
static WANTS_JSON: AtomicBool = AtomicBool::new(false);

/// Set once anything was written to standard output.
static ANSWERED: AtomicBool = AtomicBool::new(false);

/// Set if standard error is for errors alone.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Suppresses the progress and the names of written files on standard error.
pub(crate) fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// Returns whether standard error is for errors alone.
pub(crate) fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Makes errors print a JSON document.
pub(crate) fn want_json() {
    WANTS_JSON.store(true, Ordering::Relaxed);
}

/// Returns whether an error prints a JSON document: the user asked for JSON, and nothing was printed before.
pub(crate) fn wants_json_error() -> bool {
    WANTS_JSON.load(Ordering::Relaxed) && !ANSWERED.load(Ordering::Relaxed)
}

/// Prints text that ends with a line break. Control characters in titles and names of files are escaped, because control characters could disturb a terminal.
pub(crate) fn text(text: &str) -> Result<(), Failure> {
    raw(visible_lines(text).as_bytes())
}

/// Prints a JSON document with kind and version. Numbers that are not finite become `null`.
pub(crate) fn json(schema: DocumentSchema, document: &impl Serialize) -> Result<(), Failure> {
    // The document is written as one text, because standard output makes one system call per line otherwise.
    let mut text = serde_json::to_vec_pretty(&schema.of(document)).map_err(io::Error::from).map_err(Failure::StandardOutput)?;
    text.push(b'\n');
    raw(&text)
}

/// Prints an answer as a JSON document, or as text followed by the names of the written files.
pub(crate) fn answer(
    json_wanted: bool,
    schema: DocumentSchema,
    document: &impl Serialize,
    words: impl FnOnce() -> String,
    files: impl IntoIterator<Item = impl AsRef<Path>>,
) -> Result<(), Failure> {
    if json_wanted {
        return json(schema, document);
    }
    text(&words())?;
    wrote(files);
    Ok(())
}

/// Empty list, for an answer without written files.
pub(crate) const NO_FILES: [&str; 0] = [];

/// Prints bytes unchanged, such as a scene, a schema or a manual page.
pub(crate) fn raw(content: &[u8]) -> Result<(), Failure> {
    interrupt::has_results();
    // Set before the write: after a part of a document, a second document would only make the output unreadable.
    ANSWERED.store(true, Ordering::Relaxed);
    cohaptic_files::print(content).map_err(Failure::StandardOutput)
}

/// Prints the names of the written files on standard error, one per line, for people. A JSON document contains the names itself.
pub(crate) fn wrote(files: impl IntoIterator<Item = impl AsRef<Path>>) {
    if is_quiet() {
        return;
    }
    let mut to = io::stderr().lock();
    for file in files {
        // The files are written even if standard error cannot be written to.
        let _ = writeln!(to, "wrote {}", visible_lines(&path(file.as_ref())));
    }
}

/// Converts a path to text. Bytes that are not Unicode are replaced, because JSON cannot represent such bytes.
pub(crate) fn path(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}
