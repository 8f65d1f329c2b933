//! Why words are refused, and the words with a mark under the one to blame.

use alloc::format;
use alloc::string::{String, ToString};
use core::fmt;
use core::ops::Range;

use cohaptic_units::Spot;

use super::Contradiction;

/// Why the words are no netem, and which of them is to blame.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct NetemError {
    /// The fault.
    pub kind: NetemErrorKind,
    /// The bytes of the word to blame in the text that was read.
    pub span: Range<usize>,
}

impl fmt::Display for NetemError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, .. } = self;
        write!(f, "{kind}")
    }
}

impl core::error::Error for NetemError {}

/// A fault in the words of a netem.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum NetemErrorKind {
    /// A word where an option was expected.
    UnknownWord {
        /// The word.
        word: String,
    },
    /// A word that is not what its option takes.
    Value {
        /// The option.
        option: &'static str,
        /// The word.
        word: String,
        /// What would have been right.
        expected: &'static str,
    },
    /// A number without a unit, where another notation or another version of `tc` reads something else. Zero is the same everywhere and needs none.
    NoUnit {
        /// The option.
        option: &'static str,
        /// The word.
        word: String,
        /// The reading of each notation, and the words that would have been right.
        readings: String,
    },
    /// The end, where an option lacks a value.
    Missing {
        /// The option.
        option: &'static str,
        /// What would have been right.
        expected: &'static str,
    },
    /// An option said before. `tc` would take the last, mixed with what it leaves out.
    Repeated {
        /// The option.
        option: &'static str,
    },
    /// Options that do not go together.
    Contradiction(Contradiction),
}

impl fmt::Display for NetemErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownWord { word } => write!(
                f,
                "unknown word \"{word}\": expected limit, delay, distribution, loss, ecn, corrupt, duplicate, reorder, gap, rate, slot, seed or the end"
            ),
            Self::Value { option, word, expected } => write!(f, "\"{word}\" is not what {option} takes here: expected {expected}"),
            Self::NoUnit { option, word, readings } => write!(f, "\"{word}\" of {option} has no unit: {readings}"),
            Self::Missing { option, expected } => write!(f, "{option} ends too early: expected {expected} after it"),
            Self::Repeated { option } => write!(f, "{option} is said twice: expected it once"),
            Self::Contradiction(error) => fmt::Display::fmt(error, f),
        }
    }
}

impl core::error::Error for NetemErrorKind {}

impl From<Contradiction> for NetemErrorKind {
    fn from(error: Contradiction) -> Self {
        Self::Contradiction(error)
    }
}

impl NetemError {
    /// The line of `input` with carets under the word to blame, and what was expected there.
    ///
    /// ```text
    /// delay 24ms loss 250%
    ///                 ^^^^ expected a percentage from 0 to 100
    /// ```
    ///
    /// `input` is the text that was read; with another one the mark stands elsewhere, or at the end.
    #[must_use]
    pub fn excerpt(&self, input: &str) -> String {
        let Spot { line, marked } = Spot::of(input, self.span.clone());
        // A tab stays a tab, so that the caret stands below its word whatever the width of tabs.
        let indent: String = input[line.start..marked.start].chars().map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
        let carets = "^".repeat(input[marked].chars().count().max(1));
        let line = input[line].trim_end_matches('\r');
        format!("{line}\n{indent}{carets} {}", self.advice())
    }

    /// What was expected, without repeating the word that stands above it.
    fn advice(&self) -> String {
        match &self.kind {
            NetemErrorKind::Value { expected, .. } => format!("expected {expected}"),
            NetemErrorKind::NoUnit { readings, .. } => format!("no unit: {readings}"),
            NetemErrorKind::Missing { expected, .. } => format!("expected {expected} after this"),
            NetemErrorKind::UnknownWord { .. } | NetemErrorKind::Repeated { .. } | NetemErrorKind::Contradiction(_) => self.kind.to_string(),
        }
    }
}
