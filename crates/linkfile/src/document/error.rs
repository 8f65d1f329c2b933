//! Errors of files: [`FileError`], and [`Diagnostic`] with the place of a fault and the line shown to the user.

use core::fmt;
use std::io;
use std::path::{Path, PathBuf};

use cohaptic_units::{Excerpt, Visible};

/// Reason for refusing a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The content of the file, of an override, or of a file named in the document is wrong.
    #[error("{0}")]
    Invalid(Box<Diagnostic>),
    /// A file cannot be read: the document, or a file named in the document.
    #[error("{}", unreadable(path, source, place.as_deref()))]
    Read {
        /// Path of the file that cannot be read.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
        /// Place at which the document names the file, or `None` for the document itself.
        place: Option<Box<Diagnostic>>,
    },
    /// A folder holds no file of the expected kind.
    #[error("{}: no {kind} here: expected a file that ends in .toml, in this folder or below it", escape(&folder.display().to_string()))]
    NoFile {
        /// Folder in which files were looked for.
        folder: PathBuf,
        /// Kind of the files, such as `scene`.
        kind: &'static str,
    },
}

impl FileError {
    /// Returns whether a file could not be read, as opposed to a file with wrong content.
    #[must_use]
    pub const fn is_io(&self) -> bool {
        matches!(self, Self::Read { .. })
    }

    /// Returns the fault with its place in a text, or `None` if the error has no place.
    #[must_use]
    pub fn diagnostic(&self) -> Option<&Diagnostic> {
        match self {
            Self::Invalid(diagnostic) => Some(diagnostic),
            Self::Read { place, .. } => place.as_deref(),
            Self::NoFile { .. } => None,
        }
    }

    /// Returns the message of the fault without the place, and without any content of files named in the document. For answers to a person who may name a file
    /// but not see the content.
    #[must_use]
    pub fn bare_message(&self) -> String {
        match self.diagnostic() {
            // The note exists only for a fault in a named file. Message, excerpt and column quote or measure the named file.
            Some(Diagnostic { note: Some(_), origin: Origin::File(path), excerpt, .. }) => {
                format!("line {} of {} is not what this key takes: expected another file", excerpt.line, path.display())
            }
            Some(diagnostic) => diagnostic.message.clone(),
            None => self.to_string(),
        }
    }
}

/// Returns the display form of [`FileError::Read`].
fn unreadable(path: &Path, source: &io::Error, place: Option<&Diagnostic>) -> String {
    match place {
        // The message of the diagnostic already contains path and system error.
        Some(place) => place.to_string(),
        None => format!("{}: cannot be read: {}", escape(&path.display().to_string()), escape(&source.to_string())),
    }
}

/// One fault: its place, the message with the expected text, and the line with the fault.
///
/// The display form spans several lines and holds no control characters:
///
/// ```text
/// two.toml:6:9: link.delay: unknown unit "parsecs" in "24 parsecs": expected a duration such as "8ms", "1.5s" or "250us" (units: ns, us, ms, s, min, h)
///   |
/// 6 | delay = "24 parsecs"
///   |         ^^^^^^^^^^^^
/// ```
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Diagnostic {
    /// File or override that contains the fault.
    pub(crate) origin: Origin,
    /// Line of the fault as shown, with line number and column.
    pub(crate) excerpt: Excerpt,
    /// Dotted path of the key, or an empty text.
    pub(crate) key: String,
    /// The fault and the expected text.
    pub(crate) message: String,
    /// Place in the document that names the file with the fault. `None` for a fault in the document itself or in an override.
    pub(crate) note: Option<String>,
}

/// Origin of a text.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Origin {
    File(PathBuf),
    /// An override `KEY=VALUE`, as given.
    Override(String),
}

impl Diagnostic {
    /// Returns the path of the file with the fault, or `None` if the fault is in an override.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        match &self.origin {
            Origin::File(path) => Some(path),
            Origin::Override(_) => None,
        }
    }

    /// Returns the `KEY=VALUE` text with the fault, or `None` if the fault is in a file.
    #[must_use]
    pub fn override_text(&self) -> Option<&str> {
        match &self.origin {
            Origin::File(_) => None,
            Origin::Override(text) => Some(text),
        }
    }

    /// Returns the line of the fault, counted from 1.
    #[must_use]
    pub const fn line(&self) -> usize {
        self.excerpt.line
    }

    /// Returns the column of the fault \[characters\], counted from 1.
    #[must_use]
    pub const fn column(&self) -> usize {
        self.excerpt.column
    }

    /// Returns the dotted path of the key, such as `peers.left.device.mass`. Empty if the fault belongs to no key, or if the key could not be read.
    #[must_use]
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Returns the message: the fault and the expected text.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Returns the line with the fault as shown: control characters are escaped, and a very long line is cut around the fault.
    #[must_use]
    pub fn shown_line(&self) -> &str {
        &self.excerpt.shown
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.origin {
            Origin::File(path) => write!(f, "{}:{}:{}: ", escape(&path.display().to_string()), self.excerpt.line, self.excerpt.column)?,
            // The text of an override shows the place by itself, without line and column.
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

/// Escapes the control characters of a text.
pub(super) fn escape(text: &str) -> String {
    Visible(text).to_string()
}

/// Quotes a text of the document for a message, cut to 80 characters.
#[must_use]
pub fn quote(text: &str) -> String {
    format!("\"{}\"", shorten(text))
}

/// Cuts a text to 80 characters and an ellipsis. A shorter text stays as it is.
#[must_use]
pub fn shorten(text: &str) -> String {
    const LONGEST: usize = 80;
    // The byte of character 80 is looked for, so that the cut never lies within a character.
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
