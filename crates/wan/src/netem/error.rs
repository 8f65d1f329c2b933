//! Errors of reading words, and an excerpt of the words with a mark under the faulty word.

use alloc::format;
use alloc::string::{String, ToString};
use core::fmt;
use core::ops::Range;

use cohaptic_units::Spot;

use super::Contradiction;

/// Reason for the refusal of words as a netem, with the faulty word.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct NetemError {
    /// Kind of the fault.
    pub kind: NetemErrorKind,
    /// Byte range of the faulty word in the read text.
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
#[non_exhaustive]
pub enum NetemErrorKind {
    /// An unknown word in place of an option.
    UnknownWord {
        /// The unknown word.
        word: String,
    },
    /// A word that is no value of its option.
    Value {
        /// Name of the option.
        option: &'static str,
        /// The refused word.
        word: String,
        /// Description of the option's values.
        expected: &'static str,
    },
    /// A number without a unit, with a different meaning in another notation or in another version of `tc`. Zero means the same everywhere and needs no unit.
    NoUnit {
        /// Name of the option.
        option: &'static str,
        /// The number without a unit.
        word: String,
        /// The reading of each notation, and the words to write instead.
        readings: String,
    },
    /// The end of the words, with a value of an option missing.
    Missing {
        /// Name of the option.
        option: &'static str,
        /// Description of the option's values.
        expected: &'static str,
    },
    /// An option that was given before. `tc` would use the last values, and earlier values if the last are incomplete.
    Repeated {
        /// Name of the option.
        option: &'static str,
    },
    /// Contradicting options.
    Contradiction(Contradiction),
}

/// Disciplines of a queue that are qdiscs of their own in `tc` and keys of a link here.
const DISCIPLINES: [&str; 5] = ["codel", "dualpi2", "fq_codel", "pie", "red"];

impl fmt::Display for NetemErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownWord { word } if DISCIPLINES.contains(&word.as_str()) => write!(
                f,
                "{word} is a qdisc of its own and no option of netem, below which it would see no queue: expected a link of keys with rate and queue.discipline"
            ),
            Self::UnknownWord { word } => write!(
                f,
                "unknown word \"{word}\": expected limit, delay, distribution, loss, ecn, corrupt, duplicate, reorder, gap, rate, cross, slot, seed or the end"
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
    /// Returns the line of `input` with the faulty word, with carets under the word and a description of the values expected.
    ///
    /// ```text
    /// delay 24ms loss 250%
    ///                 ^^^^ expected a percentage from 0 to 100
    /// ```
    ///
    /// `input` must be the read text. With another text the carets stand elsewhere, or at the end.
    #[must_use]
    pub fn excerpt(&self, input: &str) -> String {
        let Spot { line, marked } = Spot::of(input, self.span.clone());
        // Tabs are kept, so the caret stands below the word whatever the width of a tab.
        let indent: String = input[line.start..marked.start].chars().map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
        // A missing word has no length, but still needs a mark.
        let carets = "^".repeat(input[marked].chars().count().max(1));
        let line = input[line].trim_end_matches('\r');
        format!("{line}\n{indent}{carets} {}", self.advice())
    }

    /// Returns a description of the values expected, without the faulty word, because the excerpt shows the word already.
    fn advice(&self) -> String {
        match &self.kind {
            NetemErrorKind::Value { expected, .. } => format!("expected {expected}"),
            NetemErrorKind::NoUnit { readings, .. } => format!("no unit: {readings}"),
            NetemErrorKind::Missing { expected, .. } => format!("expected {expected} after this"),
            NetemErrorKind::UnknownWord { .. } | NetemErrorKind::Repeated { .. } | NetemErrorKind::Contradiction(_) => self.kind.to_string(),
        }
    }
}
