//! The texts that make a scene, and places in them.

use core::ops::Range;
use std::path::Path;

use crate::error::{Diagnostic, Origin};
use crate::excerpt::Excerpt;
use crate::tree::shorten;

/// A span of bytes in one of the texts. The order is that in which they are read: the file from its beginning, then the overrides.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Place {
    /// 0 for the file, i for the i-th override.
    pub(crate) source: usize,
    pub(crate) start: usize,
    pub(crate) end: usize,
}

impl Place {
    pub(crate) const fn new(source: usize, span: Range<usize>) -> Self {
        Self { source, start: span.start, end: span.end }
    }
}

/// The beginning of the file: where something is that is nowhere.
pub(crate) const BEGINNING: Place = Place::new(0, 0..0);

/// The file and the overrides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sources<'a> {
    pub(crate) file: &'a Path,
    pub(crate) text: &'a str,
    pub(crate) overrides: &'a [String],
}

impl Sources<'_> {
    /// The text in which a place lies.
    pub(crate) fn text_of(&self, place: Place) -> &str {
        place.source.checked_sub(1).and_then(|index| self.overrides.get(index)).map_or(self.text, String::as_str)
    }

    /// Says what is wrong at a place.
    pub(crate) fn diagnostic(&self, place: Place, key: String, message: String) -> Diagnostic {
        let given = place.source.checked_sub(1).and_then(|index| self.overrides.get(index));
        let (origin, text) = match given {
            Some(text) => (Origin::Override(text.clone()), text.as_str()),
            None => (Origin::File(self.file.to_path_buf()), self.text),
        };
        Diagnostic { origin, excerpt: Excerpt::new(text, place.start..place.end), key: shorten(&key), message, note: None }
    }

    /// The place in words, for a note: `two.toml:6:9`.
    pub(crate) fn describe(&self, place: Place) -> String {
        let diagnostic = self.diagnostic(place, String::new(), String::new());
        match &diagnostic.origin {
            Origin::File(path) => format!("{}:{}:{}", path.display(), diagnostic.line(), diagnostic.column()),
            Origin::Override(text) => format!("--set {}", shorten(text)),
        }
    }
}
