//! Text with symbols: subscripts, superscripts and italics in a line, widths, and wrapping.
//!
//! A `&str` or `String` is plain text: an underscore in the name of a scene stays an underscore. Only [`Text::math`] reads `K_T` as a symbol.

use crate::advance::advance;

/// Style of a part of a text.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Stand {
    Plain,
    /// Symbol of a formula, in italics.
    Symbol,
    Subscript,
    Superscript,
}

/// Size of subscripts and superscripts \[font sizes\].
pub(crate) const SMALL: f64 = 0.7;
/// Distance by which subscripts are lowered \[font sizes\].
pub(crate) const LOWERED: f64 = 0.16;
/// Distance by which superscripts are raised \[font sizes\].
pub(crate) const RAISED: f64 = 0.33;
/// Largest height of letters above the base line, superscripts included \[font sizes\]. Letters reach 0.33 below the base line.
pub(crate) const ASCENT: f64 = 0.98;
/// Distance between base lines \[font sizes\].
pub(crate) const LEADING: f64 = 1.34;

/// A part of a text in a single style.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Span {
    pub(crate) text: String,
    pub(crate) stand: Stand,
}

/// A line or a paragraph of text. Control characters, and characters that change the direction of writing, become a visible U+FFFD.
///
/// ```
/// use cohaptic_picture::Text;
///
/// let axis = Text::from("Coordination stiffness ").then(Text::math("K_T")).then(" [N/m]");
/// assert_eq!(axis.plain(), "Coordination stiffness KT [N/m]");
/// ```
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Text {
    pub(crate) spans: Vec<Span>,
}

impl From<&str> for Text {
    fn from(text: &str) -> Self {
        Self::standing(text, Stand::Plain)
    }
}

impl From<String> for Text {
    fn from(text: String) -> Self {
        Self::from(text.as_str())
    }
}

impl From<&String> for Text {
    fn from(text: &String) -> Self {
        Self::from(text.as_str())
    }
}

impl Text {
    /// Parses a formula: letters are italic, `_x` and `_{text}` are subscripts, `^x` and `^{text}` are superscripts.
    #[must_use]
    pub fn math(formula: &str) -> Self {
        let mut text = Self::default();
        let mut letters = formula.chars().peekable();
        while let Some(letter) = letters.next() {
            let stand = match letter {
                '_' => Stand::Subscript,
                '^' => Stand::Superscript,
                _ => {
                    // Digits and signs of a formula stay upright, as is usual in print.
                    let stand = if letter.is_alphabetic() { Stand::Symbol } else { Stand::Plain };
                    text.push(&letter.to_string(), stand);
                    continue;
                }
            };
            let part: String = match letters.next() {
                // Without the closing brace the part reaches to the end: a formula is never refused.
                Some('{') => letters.by_ref().take_while(|letter| *letter != '}').collect(),
                Some(one) => one.to_string(),
                None => String::new(),
            };
            text.push(&part, stand);
        }
        text
    }

    /// Returns a power of ten or a multiple of a power of ten: 10⁻³.
    #[must_use]
    pub(crate) fn power_of_ten(factor: &str, exponent: i32) -> Self {
        let mut text = Self::from(if factor == "1" { "10".to_owned() } else { format!("{factor}·10") });
        text.push(&exponent.to_string().replace('-', "\u{2212}"), Stand::Superscript);
        text
    }

    /// Appends another text.
    #[must_use]
    pub fn then(mut self, other: impl Into<Self>) -> Self {
        for span in other.into().spans {
            self.push(&span.text, span.stand);
        }
        self
    }

    /// Returns the letters without styles.
    #[must_use]
    pub fn plain(&self) -> String {
        self.spans.iter().map(|span| span.text.as_str()).collect()
    }

    /// Returns whether the text has no visible letter.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.spans.iter().all(|span| span.text.trim().is_empty())
    }

    fn standing(text: &str, stand: Stand) -> Self {
        let mut new = Self::default();
        new.push(text, stand);
        new
    }

    fn push(&mut self, text: &str, stand: Stand) {
        let clean = text.chars().map(shown);
        // Neighbouring letters of one style share a span, so that equal texts have equal spans.
        match self.spans.last_mut().filter(|span| span.stand == stand) {
            Some(span) => span.text.extend(clean),
            None => self.spans.push(Span { text: clean.collect(), stand }),
        }
    }

    /// Returns an upper bound of the width at a font size, in the unit of `size`.
    pub(crate) fn width(&self, size: f64) -> f64 {
        self.spans.iter().flat_map(|span| span.text.chars().map(|letter| width_of(letter, span.stand))).sum::<f64>() * size
    }

    /// Wraps the text to lines of at most `width`, at most `most` lines. Longer text ends in an ellipsis. A word wider than a line is broken.
    pub(crate) fn wrapped(&self, size: f64, width: f64, most: usize) -> Vec<Self> {
        let mut lines = vec![Self::default()];
        for word in self.words() {
            let mut word = word;
            let line = lines.last_mut().expect("there is always a line");
            // White space at the end of a line takes no room.
            if line.width(size) + word.trimmed().width(size) <= width {
                line.append(word);
                continue;
            }
            if !line.spans.is_empty() {
                lines.push(Self::default());
            }
            while word.trimmed().width(size) > width {
                let (head, tail) = word.broken(size, width);
                lines.last_mut().expect("there is always a line").append(head);
                lines.push(Self::default());
                word = tail;
            }
            lines.last_mut().expect("there is always a line").append(word);
        }
        let mut lines: Vec<Self> = lines.iter().map(Self::trimmed).filter(|line| !line.is_empty()).collect();
        if lines.len() > most {
            lines.truncate(most);
            // The last line gives up letters for the ellipsis, which tells of the lines left out.
            if let Some(last) = lines.last_mut() {
                *last = last.broken(size, width - size * advance('…')).0.then("…");
            }
        }
        lines
    }

    fn append(&mut self, other: Self) {
        for span in other.spans {
            self.push(&span.text, span.stand);
        }
    }

    /// Returns the words, each with the following white space.
    fn words(&self) -> Vec<Self> {
        let mut words = vec![Self::default()];
        let mut after_space = false;
        for span in &self.spans {
            for letter in span.text.chars() {
                // Only U+0020 ends a word; U+00A0 keeps words together.
                let space = letter == ' ';
                if after_space && !space {
                    words.push(Self::default());
                }
                words.last_mut().expect("there is always a word").push(letter.encode_utf8(&mut [0; 4]), span.stand);
                after_space = space;
            }
        }
        words
    }

    /// Removes white space at both ends.
    fn trimmed(&self) -> Self {
        let mut spans = self.spans.clone();
        // A space at an end may fill whole spans, so spans are removed until a span begins with a letter.
        while let Some(first) = spans.first_mut() {
            first.text = first.text.trim_start_matches(' ').to_owned();
            if !first.text.is_empty() {
                break;
            }
            spans.remove(0);
        }
        while let Some(last) = spans.last_mut() {
            last.text = last.text.trim_end_matches(' ').to_owned();
            if !last.text.is_empty() {
                break;
            }
            spans.pop();
        }
        Self { spans }
    }

    /// Splits the text after as many letters as fit, at least one.
    fn broken(&self, size: f64, width: f64) -> (Self, Self) {
        let (mut head, mut tail, mut so_far) = (Self::default(), Self::default(), 0.0);
        for span in &self.spans {
            for letter in span.text.chars() {
                so_far += size * width_of(letter, span.stand);
                // After the first letter without room all letters go to the tail: no narrow letter may overtake.
                let fits = tail.spans.is_empty() && (so_far <= width || head.spans.is_empty());
                if fits { &mut head } else { &mut tail }.push(letter.encode_utf8(&mut [0; 4]), span.stand);
            }
        }
        (head, tail)
    }
}

fn width_of(letter: char, stand: Stand) -> f64 {
    match stand {
        // Italic letters lean beyond their right edge.
        Stand::Symbol => advance(letter) + 0.05,
        Stand::Plain => advance(letter),
        Stand::Subscript | Stand::Superscript => SMALL * advance(letter),
    }
}

/// Returns a letter as shown. Replaces letters forbidden in XML, invisible letters, and letters that change the direction of writing.
pub(crate) fn shown(letter: char) -> char {
    match letter {
        '\t' | '\n' | '\r' => ' ',
        // Marks, overrides and isolates of direction, line and paragraph separators, zero width characters, byte order mark.
        '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{61c}' | '\u{feff}' => char::REPLACEMENT_CHARACTER,
        '\u{fffe}' | '\u{ffff}' => char::REPLACEMENT_CHARACTER,
        control if control.is_control() => char::REPLACEMENT_CHARACTER,
        letter => letter,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str, width: f64) -> Vec<String> {
        Text::from(text).wrapped(10.0, width, 9).iter().map(Text::plain).collect()
    }

    #[test]
    fn a_line_breaks_between_words_and_a_long_word_anywhere() {
        // By the stored widths "aaa" at 10 px is 18.39 px wide, and a space 3.18 px.
        assert_eq!(lines("aaa aaa aaa", 40.0), ["aaa aaa", "aaa"]);
        assert_eq!(lines("aaa aaa", 39.9), ["aaa", "aaa"]);
        assert_eq!(lines("aaaaaaa", 20.0), ["aaa", "aaa", "a"]);
        assert!(lines("   ", 20.0).is_empty());
    }

    #[test]
    fn what_is_left_out_shows_as_an_ellipsis() {
        let cut = Text::from("aaa aaa aaa aaa").wrapped(10.0, 20.0, 2);
        assert_eq!(cut.iter().map(Text::plain).collect::<Vec<_>>(), ["aaa", "a…"]);
        assert!(cut.iter().all(|line| line.width(10.0) <= 20.0));
    }

    #[test]
    fn a_formula_has_subscripts_and_a_plain_text_underscores() {
        let stands = |text: Text| text.spans.into_iter().map(|span| (span.text, span.stand)).collect::<Vec<_>>();
        assert_eq!(stands(Text::math("K_T")), [("K".into(), Stand::Symbol), ("T".into(), Stand::Subscript)]);
        assert_eq!(stands(Text::math("10^{-3}")), [("10".into(), Stand::Plain), ("-3".into(), Stand::Superscript)]);
        assert_eq!(stands(Text::from("K_T")), [("K_T".into(), Stand::Plain)]);
    }

    #[test]
    fn nothing_turns_the_direction_of_writing() {
        assert_eq!(Text::from("a\u{202e}b\u{0}c\nd").plain(), "a\u{fffd}b\u{fffd}c d");
    }
}
