//! Checks for tests of pictures, drawn by this crate for any command.
//!
//! [`faults`] reads a document and computes the place of each text with the widest common fonts. [`in_browser`] asks Chromium, if installed.
//! [`colour_faults`] reads the colours of pictures and pages, light and dark.

mod browser;
mod colours;
mod page;

pub use browser::{Scheme, computed_colours, in_browser, page_in_browser};
pub use colours::{colour_faults, contrast};
pub use page::page_faults;

use crate::advance::advance;
use crate::text::SMALL;

/// A text with its bounding box.
#[derive(Clone, PartialEq, Debug)]
pub struct TextBox {
    /// Text.
    pub text: String,
    /// Left, top, right and bottom of the box \[px\].
    pub sides: [f64; 4],
}

/// Returns the faults of a picture as sentences; empty without a fault. A fault is malformed XML, a number with more than two decimals, or a text that is
/// outside the picture or overlaps another text.
#[must_use]
pub fn faults(svg: &str) -> Vec<String> {
    let document = match roxmltree::Document::parse(svg) {
        Ok(document) => document,
        Err(error) => return vec![format!("no well-formed XML: {error}")],
    };
    let view: Vec<f64> = numbers(document.root_element().attribute("viewBox").unwrap_or_default());
    let [_, _, width, height] = view[..] else { return vec!["no viewBox".to_owned()] };
    let mut faults = Vec::new();
    for node in document.descendants() {
        for attribute in node.attributes() {
            let drawn = !matches!(attribute.name(), "class" | "fill" | "role" | "id");
            for word in attribute.value().split(|letter: char| !(letter.is_ascii_digit() || letter == '.')).filter(|_| drawn) {
                if word.split_once('.').is_some_and(|(_, decimals)| decimals.len() > 2) {
                    faults.push(format!("{}=\"…{word}…\" of <{}> has more than two decimals", attribute.name(), node.tag_name().name()));
                }
            }
            if ["NaN", "inf"].iter().any(|word| attribute.value().contains(word)) {
                faults.push(format!("{} of <{}> is not a number: {}", attribute.name(), node.tag_name().name(), attribute.value()));
            }
        }
    }
    let texts: Vec<TextBox> =
        document.descendants().filter(|node| node.has_tag_name("text") || node.tag_name().name() == "text").map(estimated).collect();
    faults.extend(misplaced(&texts, (width, height)));
    faults
}

/// Returns the texts outside a picture of the given width and height, and the overlapping texts, as sentences.
#[must_use]
pub fn misplaced(texts: &[TextBox], (width, height): (f64, f64)) -> Vec<String> {
    // Coordinates are rounded to a hundredth, so boxes may touch by a little more.
    const ROUNDING: f64 = 0.05;
    let mut faults = Vec::new();
    for (place, TextBox { text, sides: [left, top, right, bottom] }) in texts.iter().enumerate() {
        if *left < -ROUNDING || *top < -ROUNDING || *right > width + ROUNDING || *bottom > height + ROUNDING {
            faults.push(format!("{text:?} at {left:.2}..{right:.2}, {top:.2}..{bottom:.2} is outside of {width} by {height}"));
        }
        for other in &texts[..place] {
            let [a, b, c, d] = other.sides;
            if *left + ROUNDING < c && a + ROUNDING < *right && *top + ROUNDING < d && b + ROUNDING < *bottom {
                faults.push(format!("{text:?} is on {:?}: {:.2?} and {:.2?}", other.text, [left, top, right, bottom], other.sides));
            }
        }
    }
    faults
}

fn numbers(text: &str) -> Vec<f64> {
    text.split([' ', '(', ')', ',']).filter_map(|word| word.parse().ok()).collect()
}

/// Extent of plain letters above the base line in DejaVu Sans, the tallest common font \[font sizes\]. The next constant is the extent below the base line.
const ABOVE: f64 = 0.93;
const BELOW: f64 = 0.24;

/// Returns the box of a text node as it would be in the widest and tallest of the common fonts, and so a box that holds the text in any common font.
fn estimated(node: roxmltree::Node<'_, '_>) -> TextBox {
    let number = |node: roxmltree::Node<'_, '_>, name: &str| node.attribute(name).and_then(|text| text.parse::<f64>().ok());
    let size = number(node, "font-size").unwrap_or(16.0);
    let (x, y) = (number(node, "x").unwrap_or(0.0), number(node, "y").unwrap_or(0.0));
    let (mut width, mut shift, mut above, mut below, mut text) = (0.0, 0.0, ABOVE * size, BELOW * size, String::new());
    for part in node.children() {
        let span = part.is_element();
        let words = if span { part.text() } else { part.text().filter(|_| part.is_text()) }.unwrap_or_default();
        let own = if span { number(part, "font-size").unwrap_or(size) } else { size };
        shift += if span { number(part, "dy").unwrap_or(0.0) } else { 0.0 };
        width += words.chars().map(advance).sum::<f64>() * own;
        above = above.max(ABOVE * own - shift);
        below = below.max(BELOW * own + shift);
        text.push_str(words);
        debug_assert!(!span || own >= 0.99 * SMALL * size, "no smaller letters are drawn");
    }
    let left = match node.attribute("text-anchor") {
        Some("middle") => -0.5 * width,
        Some("end") => -width,
        _ => 0.0,
    };
    let sides = if node.attribute("transform").is_some_and(|turn| turn.starts_with("rotate(-90")) {
        [x - above, y - left - width, x + below, y - left]
    } else {
        [x + left, y - above, x + left + width, y + below]
    };
    TextBox { text, sides }
}
