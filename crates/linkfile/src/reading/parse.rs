//! Parsing: from a file or a text to a document, and from the document to the answer of a reader.

use core::ops::Range;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cohaptic_files::MOST_TOML_BYTES;
use toml::de::DeTable;

use super::context::{Context, Faults, FileReader, Files, Profiles};
use super::overrides;
use crate::document::{BEGINNING, Diagnostic, FileError, Node, Place, Sources, TooDeep, join};
use crate::fingerprint::Fingerprint;

const TOO_DEEP: &str = "nested too deeply: expected at most 16 levels";

/// Reads the text of a file, and passes the text to `read`.
///
/// # Errors
///
/// The errors of [`file_text`] and of `read`.
pub fn with_text<T>(path: &Path, read: impl FnOnce(&str) -> Result<T, FileError>) -> Result<T, FileError> {
    let bytes = cohaptic_files::read_bytes_up_to(path, MOST_TOML_BYTES).map_err(|source| FileError::Read {
        path: path.to_path_buf(),
        source,
        place: None,
    })?;
    text_of(path, &bytes).and_then(read)
}

/// Reads the text of a scene file, a relay file or a router file.
///
/// # Errors
///
/// [`FileError::Read`] if the file cannot be read or is too long, [`FileError::Invalid`] if the bytes are not UTF-8.
pub fn file_text(path: &Path) -> Result<String, FileError> {
    with_text(path, |text| Ok(text.to_owned()))
}

/// Returns the bytes of a file as a text. `file` is the path for messages.
///
/// # Errors
///
/// [`FileError::Invalid`] with the place of the first byte that is not UTF-8.
pub fn text_of<'a>(file: &Path, bytes: &'a [u8]) -> Result<&'a str, FileError> {
    core::str::from_utf8(bytes).map_err(|error| {
        let place = Place::new(0, error.valid_up_to()..error.valid_up_to() + 1);
        // The lossy text equals the file up to the first faulty byte, so line and column of the fault are those of the file.
        let sources = Sources { file, text: &String::from_utf8_lossy(bytes), overrides: &[] };
        invalid(sources.diagnostic(place, String::new(), "not UTF-8: expected a text file in TOML".to_owned()))
    })
}

/// Document accepted by a reader.
#[derive(Debug)]
pub struct Parsed<T> {
    /// Answer of the reader.
    pub whole: T,
    /// Tree of values with the overrides applied.
    pub document: Node,
    /// Fingerprint of each file named in the document, by path.
    pub files: BTreeMap<PathBuf, Fingerprint>,
}

/// Parses a text, applies the overrides, and passes the tree to `read`, which must return `None` exactly after a reported fault.
///
/// # Errors
///
/// [`FileError`]. Of several faults of the reader, the first in the text; faults in overrides come after faults in the text, and missing keys come last.
pub fn parse<T>(sources: Sources<'_>, read: impl FnOnce(&Node, Context<'_>) -> Option<T>) -> Result<Parsed<T>, FileError> {
    parse_with(sources, FileReader::ANY, read)
}

/// Like [`parse`], but `reader` reads the files named in the document.
///
/// # Errors
///
/// As [`parse`]. A file that `reader` refuses is [`FileError::Read`].
pub fn parse_with<T>(
    sources: Sources<'_>,
    reader: FileReader<'_>,
    read: impl FnOnce(&Node, Context<'_>) -> Option<T>,
) -> Result<Parsed<T>, FileError> {
    let mut document = parse_toml(sources.text, sources)?;
    let faults = Faults::default();
    let files = Files::default();
    let profiles = Profiles::default();
    let context =
        Context { sources, faults: &faults, files: &files, reader, profiles: &profiles, names: None, modulators: None, partial: false, ends: None };
    overrides::apply(&mut document, sources.overrides, context);
    let whole = read(&document, context);
    match (faults.into_first(), whole) {
        (Some(error), _) => Err(error),
        (None, Some(whole)) => Ok(Parsed { whole, document, files: files.into_held() }),
        // Not reached as long as every reader that returns `None` has reported a fault. An error instead of a panic, because no text may cause a panic.
        (None, None) => Err(invalid(sources.diagnostic(BEGINNING, String::new(), "the file is refused: expected another one".to_owned()))),
    }
}

/// Returns the answer of a reader to a table without keys, in which every key has its declared default.
///
/// # Panics
///
/// If the reader refuses such a table.
pub fn defaults<T>(read: impl FnOnce(&Node, Context<'_>) -> Option<T>) -> T {
    parse(Sources { file: Path::new(""), text: "", overrides: &[] }, read).expect("every key has a default").whole
}

/// Returns the name of a file without its ending, or `scene` if the path has no name.
#[must_use]
pub fn default_title(file: &Path) -> String {
    file.file_stem().map_or_else(|| "scene".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

fn invalid(diagnostic: Diagnostic) -> FileError {
    FileError::Invalid(Box::new(diagnostic))
}

/// Parses a text of TOML into a tree. Of several faults of syntax, the first is returned.
fn parse_toml(text: &str, sources: Sources<'_>) -> Result<Node, FileError> {
    // `with_text` bounds the length of a file. A text from another source is checked here, before the parser uses many times its length in memory.
    if text.len() as u64 > MOST_TOML_BYTES {
        let message = format!("longer than {} MiB: expected a file of at most that", MOST_TOML_BYTES >> 20);
        return Err(invalid(sources.diagnostic(BEGINNING, String::new(), message)));
    }
    let (table, errors) = DeTable::parse_recoverable(text);
    // The errors need not be in the order of the text.
    let first = errors.iter().min_by_key(|error| error.span().map_or(usize::MAX, |span| span.start));
    if let Some(error) = first {
        let span = error.span().unwrap_or(text.len()..text.len());
        let key = key_at(text, &span);
        return Err(invalid(sources.diagnostic(Place::new(0, span), key, syntax_message(error.message()))));
    }
    Node::document(table.get_ref()).map_err(|TooDeep(place)| {
        let key = key_at(text, &(place.start..place.end));
        invalid(sources.diagnostic(place, key, TOO_DEEP.to_owned()))
    })
}

/// Returns the message of the TOML parser, with an expected text where the parser gives none.
fn syntax_message(message: &str) -> String {
    match message {
        "duplicate key" => "this key or table was given before: expected it once".to_owned(),
        "recursion limit" => TOO_DEEP.to_owned(),
        other if other.contains("expected") => format!("not TOML: {other}"),
        other => format!("not TOML: {other}: expected a key and its value, such as delay = \"8ms\""),
    }
}

/// Returns the dotted path of the key in the line with a fault of syntax: the latest table header and the text before the equals sign. Parts that cannot be
/// recognised as keys are left out.
fn key_at(text: &str, span: &Range<usize>) -> String {
    let is_key = |key: &&str| !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.'));
    let end = text.get(span.start..).and_then(|rest| rest.find('\n')).map_or(text.len(), |newline| span.start + newline);
    // Backwards from the faulty line to the nearest header of a table.
    let mut lines = text.get(..end).unwrap_or(text).lines().rev().map(str::trim).peekable();
    let key = lines.peek().filter(|line| !line.starts_with('[')).and_then(|line| line.split_once('=')).map(|(key, _)| key.trim());
    let header = lines.find(|line| line.starts_with('['));
    let table = header.and_then(|line| line.trim_start_matches('[').split(']').next()).map(str::trim);
    [table, key].into_iter().flatten().filter(is_key).fold(String::new(), |path, key| join(&path, key))
}
