//! An excerpt for error messages: a line of a source text, with carets below the marked place.
//!
//! The shown line has at most [`LONGEST`] characters plus two ellipses, and no control characters, whatever the source contains.

use alloc::string::{String, ToString as _};
use alloc::vec::Vec;
use core::fmt;
use core::ops::Range;

use crate::Visible;

/// Length of the longest line shown whole \[character\].
const LONGEST: usize = 200;

/// A line of a source, and the marked place in the line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Excerpt {
    /// Number of the line, from 1.
    pub line: usize,
    /// Column of the marked place, from 1, in characters of the source.
    pub column: usize,
    /// Line as shown: escaped, and cut around the marked place if too long.
    pub shown: String,
    /// Number of shown characters before the first caret.
    before: usize,
    /// Number of carets, at least one.
    width: usize,
}

impl Excerpt {
    /// Makes the excerpt for a span of bytes of `text`. A span of several lines is marked up to the end of its first line. A span past the end of the text
    /// marks the end.
    #[must_use]
    pub fn new(text: &str, span: Range<usize>) -> Self {
        let Spot { line, marked } = Spot::of(text, span);
        let shown = |range: Range<usize>| Shown::of(&text[range]);
        let number = text[..line.start].bytes().filter(|byte| *byte == b'\n').count() + 1;
        let column = text[line.start..marked.start].chars().count() + 1;
        let (before, after) = (shown(line.start..marked.start), shown(marked.end..line.end.max(marked.end)));
        Self::cut(number, column, &before, &shown(marked), &after)
    }

    /// Cuts a long line to [`LONGEST`] characters around the first caret, and marks cuts with an ellipsis.
    fn cut(line: usize, column: usize, before: &Shown, marked: &Shown, after: &Shown) -> Self {
        let mut shown: Vec<char> = before.0.iter().chain(&marked.0).chain(&after.0).copied().collect();
        let (mut caret, mut width) = (before.0.len(), marked.0.len().max(1));
        if shown.len() > LONGEST {
            // Half of the characters stand before the caret. Near the beginning of the line, more than half follow the caret.
            let first = caret.saturating_sub(LONGEST / 2);
            let last = (first + LONGEST).min(shown.len());
            let cut_end = last < shown.len();
            // The end is cut first, because draining the beginning would shift `last`.
            shown.truncate(last);
            shown.drain(..first);
            caret -= first;
            if first > 0 {
                shown.insert(0, '…');
                caret += 1;
            }
            width = width.min(shown.len().saturating_sub(caret).max(1));
            if cut_end {
                shown.push('…');
            }
        }
        Self { line, column, shown: shown.into_iter().collect(), before: caret, width }
    }

    /// Writes three lines, each after a vertical bar: an empty line, the source line, and carets below the marked place. The number of the source line
    /// stands before its bar if `numbered`.
    ///
    /// # Errors
    ///
    /// The errors of the writer.
    pub fn write(&self, f: &mut fmt::Formatter<'_>, numbered: bool) -> fmt::Result {
        let number = if numbered { self.line.to_string() } else { String::new() };
        let margin = number.len();
        writeln!(f, "{:margin$} |", "")?;
        writeln!(f, "{number} | {}", self.shown.trim_end())?;
        write!(f, "{:margin$} | {:before$}{:^<width$}", "", "", "", before = self.before, width = self.width)
    }
}

/// Byte ranges of a line of a text and of the marked part in the line. All ends lie on boundaries between characters.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Spot {
    /// Range of the line, without its end of line.
    pub line: Range<usize>,
    /// Range of the part of the span inside the line. Empty at the end of the text for a span past the end.
    pub marked: Range<usize>,
}

impl Spot {
    /// Finds the line in which a span of bytes begins.
    #[must_use]
    pub fn of(text: &str, span: Range<usize>) -> Self {
        let start = character_boundary(text, span.start);
        let end = character_boundary(text, span.end.max(start));
        let line_start = text[..start].rfind('\n').map_or(0, |newline| newline + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |newline| start + newline);
        // A Windows line ends in "\r\n"; the carriage return belongs to the end and not to the line.
        let line_end = if text[start..line_end].ends_with('\r') { line_end - 1 } else { line_end };
        Self { line: line_start..line_end, marked: start..end.min(line_end).max(start) }
    }
}

/// Characters of a text as shown, control characters escaped.
struct Shown(Vec<char>);

impl Shown {
    fn of(text: &str) -> Self {
        Self(Visible(text).to_string().chars().collect())
    }
}

/// Returns the last boundary between characters at or before `byte`.
fn character_boundary(text: &str, byte: usize) -> usize {
    // The loop ends at 0 at the latest, which is always a boundary.
    let mut byte = byte.min(text.len());
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    byte
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters_and_lines_begin_at_one() {
        let excerpt = Excerpt::new("a = 1\nµé = \"x\"\r\n", 13..16);
        assert_eq!((excerpt.line, excerpt.column, excerpt.shown.as_str(), excerpt.width), (2, 6, "µé = \"x\"", 3));
    }

    #[test]
    fn control_characters_are_escaped_and_the_caret_moves_along() {
        let excerpt = Excerpt::new("\u{1b}[2J\tx = 1", 9..10);
        assert_eq!(excerpt.shown, "\\u{1b}[2J\\tx = 1");
        assert_eq!((excerpt.column, excerpt.before), (10, 15));
    }

    #[test]
    fn a_very_long_line_is_cut_around_the_caret() {
        let text = "x".repeat(10_000);
        let excerpt = Excerpt::new(&text, 5_000..9_000);
        assert_eq!(excerpt.column, 5_001);
        assert_eq!(excerpt.shown.chars().count(), LONGEST + 2);
        assert_eq!(excerpt.before + excerpt.width, LONGEST + 1);
    }

    #[test]
    fn any_span_of_any_text_can_be_shown() {
        for text in ["", "\n", "\r\n", "é", "a\r\n\r\nb"] {
            for start in 0..8 {
                for end in 0..8 {
                    let excerpt = Excerpt::new(text, start..end);
                    assert!(excerpt.line >= 1 && excerpt.column >= 1 && excerpt.width >= 1);
                }
            }
        }
    }
}
