//! Writer of the document: elements with escaped attributes, and numbers with two decimals.

use std::fmt::Write as _;

use crate::text::{LOWERED, RAISED, SMALL, Stand, Text, shown};

/// A document, or a part of a document, being written.
#[derive(Debug, Default)]
pub(crate) struct Xml {
    pub(crate) text: String,
}

/// Escapes text for use between tags and in quoted attributes, in XML and HTML. Characters forbidden in XML, and characters that change the direction of
/// writing, become U+FFFD.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            // Both are allowed in XML, and preformatted text needs both.
            '\n' | '\t' => escaped.push(letter),
            _ => escaped.push(shown(letter)),
        }
    }
    escaped
}

/// Writes a number with at most two decimals. NaN becomes 0, and numbers far outside any picture are limited.
pub(crate) fn coordinate(value: f64) -> String {
    let value = if value.is_nan() { 0.0 } else { value.clamp(-1e6, 1e6) };
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    // A small negative number rounds to "-0.00".
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Part of a text placed at its position: beginning, middle or end.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

impl Xml {
    /// Writes an element without content. Attribute values are not escaped, because they are numbers and words of this crate.
    pub(crate) fn element(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.open(name, attributes);
        // Replaces the ">" written by `open`.
        self.text.truncate(self.text.len() - 1);
        self.text.push_str("/>\n");
    }

    fn open(&mut self, name: &str, attributes: &[(&str, &str)]) {
        let _ = write!(self.text, "<{name}");
        for (name, value) in attributes {
            let _ = write!(self.text, " {name}=\"{value}\"");
        }
        self.text.push('>');
    }

    /// Writes a line of text with the base line at (x, y).
    pub(crate) fn line_of_text(&mut self, text: &Text, (x, y): (f64, f64), size: f64, class: &str, anchor: Anchor) {
        self.write_text(text, (x, y), size, class, anchor, None);
    }

    /// Writes a line of text that runs upwards.
    pub(crate) fn text_upwards(&mut self, text: &Text, (x, y): (f64, f64), size: f64, class: &str) {
        let turn = format!("rotate(-90 {} {})", coordinate(x), coordinate(y));
        self.write_text(text, (x, y), size, class, Anchor::Middle, Some(&turn));
    }

    fn write_text(&mut self, text: &Text, (x, y): (f64, f64), size: f64, class: &str, anchor: Anchor, turn: Option<&str>) {
        if text.is_empty() {
            return;
        }
        let (x, y, height) = (coordinate(x), coordinate(y), coordinate(size));
        let mut attributes = vec![("class", class), ("x", x.as_str()), ("y", y.as_str()), ("font-size", height.as_str())];
        match anchor {
            Anchor::Start => {}
            Anchor::Middle => attributes.push(("text-anchor", "middle")),
            Anchor::End => attributes.push(("text-anchor", "end")),
        }
        attributes.extend(turn.map(|turn| ("transform", turn)));
        self.open("text", &attributes);
        // Displacement of the base line by earlier spans. `dy` moves all following spans, so the next span must undo the displacement.
        let mut moved = 0.0;
        for span in &text.spans {
            let (shift, small) = match span.stand {
                Stand::Plain | Stand::Symbol => (0.0, false),
                Stand::Subscript => (LOWERED * size, true),
                Stand::Superscript => (-RAISED * size, true),
            };
            let by = coordinate(shift - moved);
            moved = shift;
            let mut attributes = Vec::new();
            if by != "0" {
                attributes.push(("dy", by.as_str()));
            }
            let smaller = coordinate(SMALL * size);
            if small {
                attributes.push(("font-size", smaller.as_str()));
            }
            if span.stand == Stand::Symbol {
                attributes.push(("font-style", "italic"));
            }
            if attributes.is_empty() {
                self.text.push_str(&escape(&span.text));
            } else {
                self.open("tspan", &attributes);
                self.text.push_str(&escape(&span.text));
                self.text.push_str("</tspan>");
            }
        }
        self.text.push_str("</text>\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_two_decimals_at_most_and_are_always_numbers() {
        let written = [1.0, 1.256, -0.001, 100.0, f64::NAN, f64::INFINITY].map(coordinate);
        assert_eq!(written, ["1", "1.26", "0", "100", "0", "1000000"]);
    }
}
