//! What every plot has in common: a drawing in memory that becomes one valid SVG document or a part of a page, and colours.

use plotters::coord::Shift;
use plotters::prelude::*;

/// An area to draw on.
pub type Drawing<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// What drawing gives: nothing, or a fault that cannot happen in memory.
pub type DrawingResult<'a> = Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>>;

/// Colours that are told apart with any kind of colour vision (Okabe & Ito 2008), then darker ones.
pub const COLOURS: [RGBColor; 10] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(120, 120, 120),
    RGBColor(0, 57, 89),
    RGBColor(106, 47, 0),
    RGBColor(0, 79, 57),
];

/// Draws a picture of that width and height \[pixels\] and gives the document. Texts are escaped, and what XML cannot hold is replaced.
///
/// # Panics
///
/// If `draw` reports a fault: drawing to memory has none.
pub fn document(size: (u32, u32), draw: impl for<'a> FnOnce(&Drawing<'a>) -> DrawingResult<'a>) -> String {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE).and_then(|()| draw(&root)).and_then(|()| root.present()).expect("drawing to memory does not fail");
    }
    svg.chars().map(|letter| if is_xml(letter) { letter } else { char::REPLACEMENT_CHARACTER }).collect()
}

/// The same as a part of a page of HTML: without a background, in the colour of the text around it where it is black, and with what a screen reader says.
///
/// # Panics
///
/// As [`document`].
pub fn within_a_page(size: (u32, u32), title: &str, draw: impl for<'a> FnOnce(&Drawing<'a>) -> DrawingResult<'a>) -> String {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw(&root).and_then(|()| root.present()).expect("drawing to memory does not fail");
    }
    let svg = svg.replace("\"#000000\"", "\"currentColor\"").replacen("<svg ", "<svg role=\"img\" ", 1);
    let title = escape(title);
    svg.find('>').map_or_else(|| svg.clone(), |end| format!("{}<title>{title}</title>{}", &svg[..=end], &svg[end + 1..]))
}

/// Text as it may stand between tags and in quoted attributes.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            _ => escaped.push(letter),
        }
    }
    escaped
}

/// Whether XML 1.0 can hold a character, escaped or not: see its production `Char`. A title may have others.
fn is_xml(letter: char) -> bool {
    matches!(letter, '\t' | '\n' | '\r' | '\u{20}'..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..)
}
