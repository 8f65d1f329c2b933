//! The texts that make a document, and places in them.

use core::ops::Range;
use std::path::Path;

use cohaptic_units::Excerpt;

use super::error::{Diagnostic, Origin, shorten};

/// A span of bytes in one of the texts. The order is that in which they are read: the file from its beginning, then the overrides.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Place {
    /// 0 for the file, i for the i-th override.
    pub source: usize,
    /// The first byte.
    pub start: usize,
    /// The first byte behind it.
    pub end: usize,
}

impl Place {
    /// A span of bytes in the source with that number.
    #[must_use]
    pub const fn new(source: usize, span: Range<usize>) -> Self {
        Self { source, start: span.start, end: span.end }
    }
}

/// The beginning of the file: where something is that is nowhere.
pub const BEGINNING: Place = Place::new(0, 0..0);

/// The file and the overrides.
#[derive(Clone, Copy, Debug)]
pub struct Sources<'a> {
    /// The path that stands in messages; files that the document names are looked for in its folder.
    pub file: &'a Path,
    /// The text of the file.
    pub text: &'a str,
    /// Texts `KEY=VALUE`, in the order in which they are applied.
    pub overrides: &'a [String],
}

impl Sources<'_> {
    /// The text in which a place lies.
    #[must_use]
    pub fn text_of(&self, place: Place) -> &str {
        place.source.checked_sub(1).and_then(|index| self.overrides.get(index)).map_or(self.text, String::as_str)
    }

    /// Says what is wrong at a place.
    #[must_use]
    pub fn diagnostic(&self, place: Place, key: String, message: String) -> Diagnostic {
        let given = place.source.checked_sub(1).and_then(|index| self.overrides.get(index));
        let (origin, text) = match given {
            Some(text) => (Origin::Override(text.clone()), text.as_str()),
            None => (Origin::File(self.file.to_path_buf()), self.text),
        };
        Diagnostic { origin, excerpt: Excerpt::new(text, place.start..place.end), key: shorten(&key), message, note: None }
    }

    /// The place in words, for a note: `two.toml:6:9`.
    #[must_use]
    pub fn describe(&self, place: Place) -> String {
        let diagnostic = self.diagnostic(place, String::new(), String::new());
        match &diagnostic.origin {
            Origin::File(path) => format!("{}:{}:{}", path.display(), diagnostic.line(), diagnostic.column()),
            Origin::Override(text) => format!("--set {}", shorten(text)),
        }
    }
}
