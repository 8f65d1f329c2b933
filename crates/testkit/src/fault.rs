//! Why a text in words makes no sense, and where.

use std::fmt;
use std::ops::Range;

use cohaptic_units::Excerpt;

/// Why a text says no links, and where.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WordsError {
    excerpt: Excerpt,
    message: String,
}

impl WordsError {
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

    /// The fault, and what was expected.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.message
    }
}

impl std::error::Error for WordsError {}

impl fmt::Display for WordsError {
    /// The place, the message, and the line with the place marked.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Excerpt { line, column, .. } = self.excerpt;
        writeln!(f, "{line}:{column}: {}", self.message)?;
        self.excerpt.write(f, true)
    }
}

/// A fault in some bytes of a line.
pub(crate) type Fault = (Range<usize>, String);

/// Says where in a text the fault of a line is.
pub(crate) fn locate(number: usize, line: &str, (span, message): Fault) -> WordsError {
    let mut excerpt = Excerpt::new(line, span);
    excerpt.line = number;
    WordsError { excerpt, message }
}
