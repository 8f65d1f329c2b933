//! Tables of quantiles in the format of netem's `.dist` files.
//!
//! A `.dist` file lists N integers, 8192·F⁻¹(i/N) of a law with mean 0 and standard deviation 1, with `#` at the begin of a comment. netem draws an entry at
//! random, each with the same probability, and delays by mean + sd·entry/8192. [`Distribution::Table`](super::Distribution::Table) does exactly the same. An
//! entry's size is limited to 32767, 4 standard deviations. For a law with interpolation between the entries, make an [`Empirical`](super::Empirical) from the
//! entries.

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::fmt;

use super::tail::Tail;

/// Sorted entries of a `.dist` file. An entry stands for `entry/8192` standard deviations.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DistTable {
    entries: Vec<i16>,
}

/// Reason for the refusal of a text as a table. Lines and columns count from 1, columns in characters.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum DistTableError {
    /// A word is not an integer.
    NotAnInteger {
        /// Line of the word.
        line: usize,
        /// Column of the word's first character.
        column: usize,
        /// Word, or its first 24 characters.
        word: Box<str>,
    },
    /// An integer is outside of the range of an entry.
    OutOfRange {
        /// Line of the word.
        line: usize,
        /// Column of the word's first character.
        column: usize,
        /// Word, or its first 24 characters.
        word: Box<str>,
    },
    /// The file has more than 16384 entries.
    TooMany {
        /// Line of the first surplus entry.
        line: usize,
        /// Column of the entry's first character.
        column: usize,
    },
    /// The file has no entry.
    Empty,
}

impl fmt::Display for DistTableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotAnInteger { line, column, word } => {
                write!(f, "line {line}, column {column}: `{word}` is not an integer: expected one from -32768 to 32767, decimal, 0x… or 0… in octal")
            }
            Self::OutOfRange { line, column, word } => {
                write!(f, "line {line}, column {column}: `{word}` is out of range: expected an integer from -32768 to 32767")
            }
            Self::TooMany { line, column } => {
                write!(f, "line {line}, column {column}: entry {} begins here: expected at most {}", DistTable::MOST + 1, DistTable::MOST)
            }
            Self::Empty => write!(f, "a table without entries: expected 1 to {}", DistTable::MOST),
        }
    }
}

impl core::error::Error for DistTableError {}

impl DistTable {
    /// Largest number of entries for `tc`.
    pub(crate) const MOST: usize = 16_384;
    /// Entry of one standard deviation.
    pub(crate) const ONE_DEVIATION: f64 = 8192.0;

    /// Reads a `.dist` file: integers in the forms of C's `strtol` in base 0, separated by white space. `#` begins a comment up to the end of the line.
    ///
    /// # Errors
    ///
    /// [`DistTableError`] with the place of the first wrong word.
    pub fn parse(text: &str) -> Result<Self, DistTableError> {
        let mut entries = entries(text)?;
        entries.sort_unstable();
        Ok(Self { entries })
    }

    /// Returns the entries in ascending order. There is at least one.
    #[must_use]
    pub fn entries(&self) -> &[i16] {
        &self.entries
    }

    /// Returns the entry at a place of the law. Every entry has the same share of the probability.
    pub(super) fn at(&self, place: Tail) -> f64 {
        let count = self.entries.len();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "neither negative nor above 16384; a NaN becomes 0")]
        let index = match place {
            Tail::Below(p) => ((p * real(count)) as usize).min(count - 1),
            // Entry of the probability 1 − q, counted from above.
            Tail::Above(q) => count - (libm::ceil(q * real(count)) as usize).clamp(1, count),
        };
        f64::from(self.entries[index])
    }

    /// Returns the probabilities of at most x and of more than x.
    pub(super) fn tails(&self, x: f64) -> (f64, f64) {
        let count = self.entries.len();
        let below = self.entries.partition_point(|&entry| f64::from(entry) <= x);
        (real(below) / real(count), real(count - below) / real(count))
    }

    /// Returns the mean and the standard deviation of max(entry, cut).
    pub(super) fn moments(&self, cut: f64) -> (f64, f64) {
        let count = real(self.entries.len());
        let values = || self.entries.iter().map(|&entry| f64::from(entry).max(cut));
        let mean = values().sum::<f64>() / count;
        (mean, libm::sqrt(values().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count))
    }
}

/// Writes the entries as a `.dist` file, eight per line.
impl fmt::Display for DistTable {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for line in self.entries.chunks(8) {
            for (i, entry) in line.iter().enumerate() {
                write!(formatter, "{}{entry}", if i == 0 { "" } else { " " })?;
            }
            writeln!(formatter)?;
        }
        Ok(())
    }
}

/// Reads the entries of a `.dist` file, in the order of the file. Returns at least one entry.
pub(crate) fn entries(text: &str) -> Result<Vec<i16>, DistTableError> {
    let mut entries = Vec::new();
    for (number, content) in text.lines().enumerate() {
        let line = number + 1;
        // A comment may follow entries on the same line.
        let content = content.split('#').next().unwrap_or_default();
        for (column, word) in words(content) {
            let shown = || word.chars().take(24).collect();
            let entry = match integer(word) {
                None => return Err(DistTableError::NotAnInteger { line, column, word: shown() }),
                Some(value) => i16::try_from(value).map_err(|_| DistTableError::OutOfRange { line, column, word: shown() })?,
            };
            if entries.len() == DistTable::MOST {
                return Err(DistTableError::TooMany { line, column });
            }
            entries.push(entry);
        }
    }
    if entries.is_empty() { Err(DistTableError::Empty) } else { Ok(entries) }
}

/// Returns the words of a line, each with its column.
fn words(line: &str) -> impl Iterator<Item = (usize, &str)> {
    line.split_whitespace().map(move |word| {
        // Both are slices of one string, so the difference of their addresses is an offset in bytes.
        let start = word.as_ptr().addr() - line.as_ptr().addr();
        (line[..start].chars().count() + 1, word)
    })
}

/// Returns the whole word as read by `strtol` in base 0, or `None` if the word is not an integer. Numbers outside of an `i64` saturate.
fn integer(word: &str) -> Option<i64> {
    let (negative, digits) = match word.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, word.strip_prefix('+').unwrap_or(word)),
    };
    // Base 0 of `strtol`: 0x for hexadecimal, a leading 0 for octal, and a single 0 is zero.
    let (radix, digits) = match (digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")), digits.strip_prefix('0')) {
        (Some(hex), _) => (16, hex),
        (None, Some(octal)) if !octal.is_empty() => (8, octal),
        (None, _) => (10, digits),
    };
    if digits.is_empty() {
        return None;
    }
    // Saturation is enough: a saturated number is out of the range of an entry.
    let size = digits.chars().try_fold(0_i64, |value, c| {
        let digit = c.to_digit(radix)?;
        Some(value.saturating_mul(i64::from(radix)).saturating_add(i64::from(digit)))
    })?;
    Some(if negative { -size } else { size })
}

#[expect(clippy::cast_precision_loss, reason = "there are at most 16384 entries")]
fn real(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_read_as_by_strtol() {
        let table = DistTable::parse("# a comment\n\n -32768 +7 0x1F\t017 # 99\r\n0 -0X10").unwrap();
        assert_eq!(table.entries(), [-32_768, -16, 0, 7, 15, 31]);
    }

    #[test]
    fn a_bad_word_is_shown_with_its_place() {
        let reason = |text: &str| DistTable::parse(text).unwrap_err().to_string();
        assert_eq!(reason("1 2\n µ  3x"), "line 2, column 2: `µ` is not an integer: expected one from -32768 to 32767, decimal, 0x… or 0… in octal");
        assert_eq!(reason("1\n2 40000"), "line 2, column 3: `40000` is out of range: expected an integer from -32768 to 32767");
        assert!(reason("09").contains("`09` is not an integer"));
        assert!(reason("99999999999999999999").contains("out of range"));
        assert_eq!(reason(" # nothing\n"), "a table without entries: expected 1 to 16384");
        assert_eq!(reason(&"1 ".repeat(16_385)), "line 1, column 32769: entry 16385 begins here: expected at most 16384");
    }

    #[test]
    fn every_entry_has_the_same_share() {
        let table = DistTable::parse("30 10 20 20").unwrap();
        let at = [Tail::Below(0.0), Tail::Below(0.24), Tail::Below(0.26), Tail::Above(0.5), Tail::Above(0.26), Tail::Above(0.24), Tail::Above(0.0)];
        assert_eq!(at.map(|place| table.at(place)), [10.0, 10.0, 20.0, 20.0, 20.0, 30.0, 30.0]);
        assert_eq!([9.0, 10.0, 20.0, 30.0].map(|x| table.tails(x).0), [0.0, 0.25, 0.75, 1.0]);
        assert_eq!(table.moments(f64::NEG_INFINITY), (20.0, libm::sqrt(50.0)));
        assert_eq!(table.moments(20.0), (22.5, libm::sqrt(18.75)));
    }
}
