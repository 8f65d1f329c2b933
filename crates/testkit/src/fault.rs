//! Errors in texts of words, with their place.

use std::fmt;
use std::ops::Range;

use cohaptic_units::Excerpt;

/// Error in a text of links or hits, with the place of the error.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WordsError {
    excerpt: Excerpt,
    message: String,
}

impl WordsError {
    /// Returns the line of the error, from 1.
    #[must_use]
    pub const fn line(&self) -> usize {
        self.excerpt.line
    }

    /// Returns the column of the error, from 1, in characters.
    #[must_use]
    pub const fn column(&self) -> usize {
        self.excerpt.column
    }

    /// Returns the message: the fault, and what was expected.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.message
    }
}

impl std::error::Error for WordsError {}

impl fmt::Display for WordsError {
    /// Writes the place, the message, and the line with the place marked.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Excerpt { line, column, .. } = self.excerpt;
        writeln!(f, "{line}:{column}: {}", self.message)?;
        self.excerpt.write(f, true)
    }
}

/// Fault in a line: the range of bytes, and the message.
pub(crate) type Fault = (Range<usize>, String);

/// Converts a fault of the line `line` with the number `number` in its text.
pub(crate) fn locate(number: usize, line: &str, (span, message): Fault) -> WordsError {
    let mut excerpt = Excerpt::new(line, span);
    excerpt.line = number;
    WordsError { excerpt, message }
}
