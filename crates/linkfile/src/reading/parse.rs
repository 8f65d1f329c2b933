//! From files and texts to documents, and to what a reader makes of them.

use core::ops::Range;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cohaptic_files::MOST_TOML_BYTES;
use toml::de::DeTable;

use super::context::{Context, Faults, FileReader, Files};
use super::overrides;
use crate::document::{BEGINNING, Diagnostic, FileError, Node, Place, Sources, TooDeep, join};
use crate::fingerprint::Fingerprint;

const TOO_DEEP: &str = "nested too deeply: expected at most 16 levels";

/// Reads the text of a file, and hands it to `read`.
///
/// # Errors
///
/// As [`file_text`], and those of `read`.
pub fn with_text<T>(path: &Path, read: impl FnOnce(&str) -> Result<T, FileError>) -> Result<T, FileError> {
    let bytes = cohaptic_files::read_bytes_up_to(path, MOST_TOML_BYTES).map_err(|source| FileError::Read {
        path: path.to_path_buf(),
        source,
        place: None,
    })?;
    text_of(path, &bytes).and_then(read)
}

/// The text of a file that is to be read as a scene, a relay file or a router file.
///
/// # Errors
///
/// [`FileError::Read`] if it cannot be read, [`FileError::Invalid`] if it is no text.
pub fn file_text(path: &Path) -> Result<String, FileError> {
    with_text(path, |text| Ok(text.to_owned()))
}

/// The text that the content of a file is. `file` stands in messages.
///
/// # Errors
///
/// [`FileError::Invalid`] with the place of the first byte that is not UTF-8.
pub fn text_of<'a>(file: &Path, bytes: &'a [u8]) -> Result<&'a str, FileError> {
    core::str::from_utf8(bytes).map_err(|error| {
        let place = Place::new(0, error.valid_up_to()..error.valid_up_to() + 1);
        // Up to the place, the text with replacements is the text itself.
        let sources = Sources { file, text: &String::from_utf8_lossy(bytes), overrides: &[] };
        invalid(sources.diagnostic(place, String::new(), "not UTF-8: expected a text file in TOML".to_owned()))
    })
}

/// A document that a reader has taken.
#[derive(Debug)]
pub struct Parsed<T> {
    /// The reader's answer.
    pub whole: T,
    /// The tree of values, overrides included.
    pub document: Node,
    /// A fingerprint of the content of each file that the document names.
    pub files: BTreeMap<PathBuf, Fingerprint>,
}

/// Parses a text, applies the overrides, and hands the tree to `read`, which answers `None` exactly if it has reported a fault.
///
/// # Errors
///
/// [`FileError`]: of several faults of the reader, the one that stands first in the text; faults in overrides come after those in the text.
pub fn parse<T>(sources: Sources<'_>, read: impl FnOnce(&Node, Context<'_>) -> Option<T>) -> Result<Parsed<T>, FileError> {
    parse_with(sources, FileReader::ANY, read)
}

/// [`parse`], with files that the document names read by `reader`.
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
    let context = Context { sources, faults: &faults, files: &files, reader, names: None, modulators: None, partial: false, ends: None };
    overrides::apply(&mut document, sources.overrides, context);
    let whole = read(&document, context);
    match (faults.into_first(), whole) {
        (Some(error), _) => Err(error),
        (None, Some(whole)) => Ok(Parsed { whole, document, files: files.into_held() }),
        // Not reached: a reader that answers nothing has reported why. An error all the same, because text must never be able to cause a panic.
        (None, None) => Err(invalid(sources.diagnostic(BEGINNING, String::new(), "the file is refused: expected another one".to_owned()))),
    }
}

/// What a reader makes of a table without keys: the declared default of each.
///
/// # Panics
///
/// If the reader refuses such a table.
pub fn defaults<T>(read: impl FnOnce(&Node, Context<'_>) -> Option<T>) -> T {
    parse(Sources { file: Path::new(""), text: "", overrides: &[] }, read).expect("every key has a default").whole
}

/// The name of the file without its ending.
#[must_use]
pub fn default_title(file: &Path) -> String {
    file.file_stem().map_or_else(|| "scene".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

fn invalid(diagnostic: Diagnostic) -> FileError {
    FileError::Invalid(Box::new(diagnostic))
}

/// The document as a tree. Of several faults of syntax, the first.
fn parse_toml(text: &str, sources: Sources<'_>) -> Result<Node, FileError> {
    // A text that came from elsewhere than a file: before the parser, which takes fifty times its length of memory.
    if text.len() as u64 > MOST_TOML_BYTES {
        let message = format!("longer than {} MiB: expected a file of at most that", MOST_TOML_BYTES >> 20);
        return Err(invalid(sources.diagnostic(BEGINNING, String::new(), message)));
    }
    let (table, errors) = DeTable::parse_recoverable(text);
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

/// What the TOML parser says, with what was expected where it leaves that out.
fn syntax_message(message: &str) -> String {
    match message {
        "duplicate key" => "this key or table is there already: expected it once".to_owned(),
        "recursion limit" => TOO_DEEP.to_owned(),
        other if other.contains("expected") => format!("not TOML: {other}"),
        other => format!("not TOML: {other}: expected a key and its value, such as delay = \"8ms\""),
    }
}

/// The key in whose line a fault of syntax stands, as far as it can be made out.
fn key_at(text: &str, span: &Range<usize>) -> String {
    let is_key = |key: &&str| !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.'));
    let end = text.get(span.start..).and_then(|rest| rest.find('\n')).map_or(text.len(), |newline| span.start + newline);
    let mut lines = text.get(..end).unwrap_or(text).lines().rev().map(str::trim).peekable();
    let key = lines.peek().filter(|line| !line.starts_with('[')).and_then(|line| line.split_once('=')).map(|(key, _)| key.trim());
    let header = lines.find(|line| line.starts_with('['));
    let table = header.and_then(|line| line.trim_start_matches('[').split(']').next()).map(str::trim);
    [table, key].into_iter().flatten().filter(is_key).fold(String::new(), |path, key| join(&path, key))
}
