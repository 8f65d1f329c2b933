//! Why a file is refused, and how that is shown.

use core::fmt;
use std::io;
use std::path::{Path, PathBuf};

use cohaptic_units::{Excerpt, Visible};

/// Why a file is refused.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// Something in the file, in an override, or in a file that it names makes no sense.
    #[error("{0}")]
    Invalid(Box<Diagnostic>),
    /// A file cannot be read: the document itself, or one that it names.
    #[error("{}", unreadable(path, source, place.as_deref()))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
        /// Where the document names the file; `None` for the document itself.
        place: Option<Box<Diagnostic>>,
    },
    /// A folder that should hold files of a kind holds none.
    #[error("{}: no {kind} here: expected a file that ends in .toml, in this folder or below it", escape(&folder.display().to_string()))]
    NoFile {
        /// The folder.
        folder: PathBuf,
        /// The kind of file: `scene`.
        kind: &'static str,
    },
}

impl FileError {
    /// Whether a file could not be read, as opposed to one that says something wrong.
    #[must_use]
    pub const fn is_io(&self) -> bool {
        matches!(self, Self::Read { .. })
    }

    /// The place in a text that is meant, if there is one.
    #[must_use]
    pub fn diagnostic(&self) -> Option<&Diagnostic> {
        match self {
            Self::Invalid(diagnostic) => Some(diagnostic),
            Self::Read { place, .. } => place.as_deref(),
            Self::NoFile { .. } => None,
        }
    }

    /// The fault alone, without its place, and without anything that stands in a file which the document names: for a person who may name a file and not see
    /// its content.
    #[must_use]
    pub fn bare_message(&self) -> String {
        match self.diagnostic() {
            // The note exists only for a fault in a named file. Message, excerpt and column quote or measure that file.
            Some(Diagnostic { note: Some(_), origin: Origin::File(path), excerpt, .. }) => {
                format!("line {} of {} is not what this key takes: expected another file", excerpt.line, path.display())
            }
            Some(diagnostic) => diagnostic.message.clone(),
            None => self.to_string(),
        }
    }
}

fn unreadable(path: &Path, source: &io::Error, place: Option<&Diagnostic>) -> String {
    match place {
        // The message of the diagnostic already holds both.
        Some(place) => place.to_string(),
        None => format!("{}: cannot be read: {}", escape(&path.display().to_string()), escape(&source.to_string())),
    }
}

/// One fault: its place, the fault itself, the expected text, and the line it stands in.
///
/// Its display form spans several lines and holds no control characters:
///
/// ```text
/// two.toml:6:9: link.delay: unknown unit "parsecs" in "24 parsecs": expected a duration such as "8ms", "1.5s" or "250us" (units: ns, us, ms, s, min, h)
///   |
/// 6 | delay = "24 parsecs"
///   |         ^^^^^^^^^^^^
/// ```
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Diagnostic {
    pub(crate) origin: Origin,
    pub(crate) excerpt: Excerpt,
    pub(crate) key: String,
    pub(crate) message: String,
    pub(crate) note: Option<String>,
}

/// What the text comes from.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Origin {
    File(PathBuf),
    /// An override, as given.
    Override(String),
}

impl Diagnostic {
    /// The file in which the fault is; `None` if it is in an override.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        match &self.origin {
            Origin::File(path) => Some(path),
            Origin::Override(_) => None,
        }
    }

    /// The `KEY=VALUE` text in which the fault is; `None` if it is in a file.
    #[must_use]
    pub fn override_text(&self) -> Option<&str> {
        match &self.origin {
            Origin::File(_) => None,
            Origin::Override(text) => Some(text),
        }
    }

    /// The line, from 1.
    #[must_use]
    pub const fn line(&self) -> usize {
        self.excerpt.line
    }

    /// The column, from 1, in characters.
    #[must_use]
    pub const fn column(&self) -> usize {
        self.excerpt.column
    }

    /// The dotted path of the key, such as `peers.left.device.mass`; empty if the text could not be read that far.
    #[must_use]
    pub fn key(&self) -> &str {
        &self.key
    }

    /// The fault, and what was expected.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The line as it is shown: control characters escaped, cut around the place if it is very long.
    #[must_use]
    pub fn shown_line(&self) -> &str {
        &self.excerpt.shown
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.origin {
            Origin::File(path) => write!(f, "{}:{}:{}: ", escape(&path.display().to_string()), self.excerpt.line, self.excerpt.column)?,
            Origin::Override(text) => write!(f, "--set {}: ", escape(&shorten(text)))?,
        }
        if !self.key.is_empty() {
            write!(f, "{}: ", escape(&self.key))?;
        }
        writeln!(f, "{}", escape(&self.message))?;
        self.excerpt.write(f, matches!(self.origin, Origin::File(_)))?;
        match &self.note {
            Some(note) => write!(f, "\nnote: {}", escape(note)),
            None => Ok(()),
        }
    }
}

/// A text as it is shown.
pub(super) fn escape(text: &str) -> String {
    Visible(text).to_string()
}

/// A text of the document within a message: in quotes, and not longer than anyone wants to read.
#[must_use]
pub fn quote(text: &str) -> String {
    format!("\"{}\"", shorten(text))
}

/// The beginning of a text that is too long for a message.
#[must_use]
pub fn shorten(text: &str) -> String {
    const LONGEST: usize = 80;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
