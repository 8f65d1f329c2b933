//! Source texts of a document (the file and the overrides), and places in these texts.

use core::ops::Range;
use std::path::Path;

use cohaptic_units::Excerpt;

use super::error::{Diagnostic, Origin, shorten};

/// Span of bytes in one source text. Places are ordered as the texts are read: the file from its beginning, then the overrides.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Place {
    /// Source text: 0 for the file, i for the i-th override, counted from 1.
    pub(crate) source: usize,
    /// Index of the first byte.
    pub(crate) start: usize,
    /// Index after the last byte.
    pub(crate) end: usize,
}

impl Place {
    /// Returns the place of a span of bytes in the source with the number `source`.
    #[must_use]
    pub(crate) const fn new(source: usize, span: Range<usize>) -> Self {
        Self { source, start: span.start, end: span.end }
    }
}

/// Beginning of the file: the place of values and faults that are written nowhere, such as defaults.
pub const BEGINNING: Place = Place::new(0, 0..0);

/// Source texts of a document: the file and the overrides.
#[derive(Clone, Copy, Debug)]
pub struct Sources<'a> {
    /// Path of the file for messages. The folder of the path is the base of files named in the document.
    pub file: &'a Path,
    /// Text of the file.
    pub text: &'a str,
    /// Override texts `KEY=VALUE`, in the order of application.
    pub overrides: &'a [String],
}

impl Sources<'_> {
    /// Returns the source text that contains a place.
    #[must_use]
    pub(crate) fn text_of(&self, place: Place) -> &str {
        place.source.checked_sub(1).and_then(|index| self.overrides.get(index)).map_or(self.text, String::as_str)
    }

    /// Returns a diagnostic for a place, with the dotted path of the key and the message.
    #[must_use]
    pub(crate) fn diagnostic(&self, place: Place, key: String, message: String) -> Diagnostic {
        // Source 0 is the file, and has no override.
        let given = place.source.checked_sub(1).and_then(|index| self.overrides.get(index));
        let (origin, text) = match given {
            Some(text) => (Origin::Override(text.clone()), text.as_str()),
            None => (Origin::File(self.file.to_path_buf()), self.text),
        };
        Diagnostic { origin, excerpt: Excerpt::new(text, place.start..place.end), key: shorten(&key), message, note: None }
    }

    /// Describes a place for a note: `two.toml:6:9` in the file, `--set KEY=VALUE` in an override.
    #[must_use]
    pub(crate) fn describe(&self, place: Place) -> String {
        let diagnostic = self.diagnostic(place, String::new(), String::new());
        match &diagnostic.origin {
            Origin::File(path) => format!("{}:{}:{}", path.display(), diagnostic.line(), diagnostic.column()),
            Origin::Override(text) => format!("--set {}", shorten(text)),
        }
    }
}
