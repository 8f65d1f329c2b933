//! Standard output: text for people or one JSON document.

use std::io::{self, Write as _};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

pub(crate) use cohaptic_answers::{are, figure};
use cohaptic_units::visible_lines;
use serde::Serialize;

use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::interrupt;

/// Whether the answer is to be a JSON document, also that to a wrong argument.
static WANTS_JSON: AtomicBool = AtomicBool::new(false);

/// Whether there is something on standard output already.
static ANSWERED: AtomicBool = AtomicBool::new(false);

/// `true` if standard error is for what goes wrong alone.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Keeps progress and the names of files that were written from standard error.
pub(crate) fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// Returns whether standard error is for what goes wrong alone.
pub(crate) fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Has errors answered by a JSON document.
pub(crate) fn want_json() {
    WANTS_JSON.store(true, Ordering::Relaxed);
}

/// Whether an error is to be answered by a JSON document: it was asked for, and nothing else was printed.
pub(crate) fn wants_json_error() -> bool {
    WANTS_JSON.load(Ordering::Relaxed) && !ANSWERED.load(Ordering::Relaxed)
}

/// Prints text, which ends with a line break. Titles and names of files may hold control characters, which are escaped before they disturb a
/// terminal.
pub(crate) fn text(text: &str) -> Result<(), Failure> {
    raw(visible_lines(text).as_bytes())
}

/// Prints one JSON document, which says of which kind and version it is. Numbers that are not finite become `null`.
pub(crate) fn json(schema: DocumentSchema, document: &impl Serialize) -> Result<(), Failure> {
    // As one text: standard output takes many calls of the system otherwise, one a line.
    let mut text = serde_json::to_vec_pretty(&schema.of(document)).map_err(io::Error::from).map_err(Failure::StandardOutput)?;
    text.push(b'\n');
    raw(&text)
}

/// Answers with a JSON document, or with text and the names of the files that were written.
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

/// Of an answer without files.
pub(crate) const NO_FILES: [&str; 0] = [];

/// Prints a file as it is: a scene, a schema, a page for another program.
pub(crate) fn raw(content: &[u8]) -> Result<(), Failure> {
    interrupt::has_results();
    ANSWERED.store(true, Ordering::Relaxed);
    cohaptic_files::print(content).map_err(Failure::StandardOutput)
}

/// Says on standard error which files were written: one a line, for people. A JSON document names them itself.
pub(crate) fn wrote(files: impl IntoIterator<Item = impl AsRef<Path>>) {
    if is_quiet() {
        return;
    }
    let mut to = io::stderr().lock();
    for file in files {
        // What cannot be said was written all the same.
        let _ = writeln!(to, "wrote {}", visible_lines(&path(file.as_ref())));
    }
}

/// A path as text. Bytes that are not Unicode are replaced: JSON cannot hold it.
pub(crate) fn path(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}
