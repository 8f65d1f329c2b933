//! A line of a source and the place in it that is meant, ready to be shown.
//!
//! Whatever stands in the source, the excerpt is one line of at most [`LONGEST`] characters without control characters.

use alloc::string::{String, ToString as _};
use alloc::vec::Vec;
use core::fmt;
use core::ops::Range;

use crate::Visible;

/// The longest line that is shown whole [character].
const LONGEST: usize = 200;

/// Where a span begins, and its line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Excerpt {
    /// From 1.
    pub line: usize,
    /// From 1, in characters of the source.
    pub column: usize,
    /// The line as shown.
    pub shown: String,
    /// How many shown characters stand before the caret.
    before: usize,
    /// How many carets; at least one.
    width: usize,
}

impl Excerpt {
    /// Finds a span of bytes in a text. A span over several lines is shown on its first one; one past the end at the end.
    #[must_use]
    pub fn new(text: &str, span: Range<usize>) -> Self {
        let Spot { line, marked } = Spot::of(text, span);
        let shown = |range: Range<usize>| Shown::of(&text[range]);
        let number = text[..line.start].bytes().filter(|byte| *byte == b'\n').count() + 1;
        let column = text[line.start..marked.start].chars().count() + 1;
        let (before, after) = (shown(line.start..marked.start), shown(marked.end..line.end.max(marked.end)));
        Self::cut(number, column, &before, &shown(marked), &after)
    }

    /// Keeps the neighbourhood of the caret where the line is too long.
    fn cut(line: usize, column: usize, before: &Shown, marked: &Shown, after: &Shown) -> Self {
        let mut shown: Vec<char> = before.0.iter().chain(&marked.0).chain(&after.0).copied().collect();
        let (mut caret, mut width) = (before.0.len(), marked.0.len().max(1));
        if shown.len() > LONGEST {
            let first = caret.saturating_sub(LONGEST / 2);
            let last = (first + LONGEST).min(shown.len());
            let cut_end = last < shown.len();
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

    /// Writes the line between bars with carets under the place; the number of the line stands before it if `numbered`.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn write(&self, f: &mut fmt::Formatter<'_>, numbered: bool) -> fmt::Result {
        let number = if numbered { self.line.to_string() } else { String::new() };
        let margin = number.len();
        writeln!(f, "{:margin$} |", "")?;
        writeln!(f, "{number} | {}", self.shown.trim_end())?;
        write!(f, "{:margin$} | {:before$}{:^<width$}", "", "", "", before = self.before, width = self.width)
    }
}

/// The bytes of a line of a text, without its end, and those of a span that begins in it. All are boundaries of characters.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Spot {
    /// The line.
    pub line: Range<usize>,
    /// The part of the span in this line; empty at the end of the text for a span past it.
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
        let line_end = if text[start..line_end].ends_with('\r') { line_end - 1 } else { line_end };
        Self { line: line_start..line_end, marked: start..end.min(line_end).max(start) }
    }
}

struct Shown(Vec<char>);

impl Shown {
    fn of(text: &str) -> Self {
        Self(Visible(text).to_string().chars().collect())
    }
}

/// The last boundary between characters at or before that byte.
fn character_boundary(text: &str, byte: usize) -> usize {
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
