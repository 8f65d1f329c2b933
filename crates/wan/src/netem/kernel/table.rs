//! Tables of inverse distributions.

use alloc::boxed::Box;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

use super::built_in;

/// An inverse distribution function at equal steps, in multiples of 1/8192 of the deviation: what a `.dist` file holds.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Table {
    entries: Box<[i16]>,
}

/// Why a text is no table.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// A word that is no integer of 16 bits.
    #[error("line {line}: \"{word}\" is no entry of a table: expected an integer from -32768 to 32767")]
    Entry {
        /// The line, from 1.
        line: usize,
        /// The word.
        word: String,
    },
    /// Nothing to draw from.
    #[error("a table without entries: expected 1 to 16384")]
    Empty,
    /// More than the kernel takes.
    #[error("line {line}: entry number 16385 of a table: expected 1 to 16384")]
    TooLong {
        /// The line, from 1.
        line: usize,
    },
}

impl Table {
    /// The most entries the kernel takes.
    pub const LONGEST: usize = 16_384;

    /// A table of these entries; `None` unless there are 1 to 16384.
    #[must_use]
    pub fn new(entries: impl Into<Box<[i16]>>) -> Option<Self> {
        let entries = entries.into();
        (1..=Self::LONGEST).contains(&entries.len()).then_some(Self { entries })
    }

    /// Reads a `.dist` file: integers between white space, in base 8 after `0` and 16 after `0x`; lines that begin with `#` are comments.
    ///
    /// # Errors
    ///
    /// [`TableError`] for what is no integer of 16 bits (`tc` would cut it off), no entry at all, or more than 16384.
    pub fn parse(text: &str) -> Result<Self, TableError> {
        let mut entries = Vec::new();
        for (index, content) in text.lines().enumerate().filter(|(_, content)| !content.starts_with('#')) {
            let line = index + 1;
            for word in content.split_whitespace() {
                let entry = crate::netem::number::signed(word).and_then(|entry| i16::try_from(entry).ok());
                entries.push(entry.ok_or_else(|| TableError::Entry { line, word: word.to_string() })?);
                if entries.len() > Self::LONGEST {
                    return Err(TableError::TooLong { line });
                }
            }
        }
        Self::new(entries).ok_or(TableError::Empty)
    }

    /// The table `normal`, entry for entry as iproute2 ships it.
    ///
    /// Entry j is 8192·x for the last x on a grid of 5·10⁻⁵ from −10 with Φ(x) < (4j + ½)/16384. So its support is lopsided: −4.00 to +3.52.
    #[must_use]
    pub fn normal() -> Self {
        Self { entries: built_in::normal() }
    }

    /// The table `pareto`, entry for entry as iproute2 ships it.
    ///
    /// Entry j is 8192·(u^(−1/3) − 3/2)·4/3 with u = 1 − j/4096, at most 32767: the Pareto law of index 3 from 1 on, whose mean is 3/2 and whose
    /// deviation is √3/2. The cut at 4 and a factor of 4/3 instead of 2/√3 leave a deviation of 0.82 instead of 1.
    #[must_use]
    pub fn pareto() -> Self {
        Self { entries: built_in::pareto() }
    }

    /// The table `paretonormal`, entry for entry as iproute2 ships it: a quarter of the normal entry and three quarters of the Pareto one, added
    /// rank by rank.
    #[must_use]
    pub fn pareto_normal() -> Self {
        Self { entries: built_in::pareto_normal() }
    }

    /// The entries.
    #[must_use]
    pub fn entries(&self) -> &[i16] {
        &self.entries
    }

    /// The entry that 32 random bits draw.
    pub(super) fn entry(&self, random: u32) -> i64 {
        let index = random as usize % self.entries.len();
        i64::from(self.entries[index])
    }
}
