//! Texts of the document within messages.

use cohaptic_units::Visible;

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
