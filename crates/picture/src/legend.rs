//! The legend: a sample and a name for each line and area, in rows wrapped like text.

use crate::content::Content;
use crate::extent::count;
use crate::look::{Fill, Look, Marker};
use crate::text::{ASCENT, LEADING, Text};
use crate::xml::{Anchor, Xml, coordinate};

/// Place of the legend, always outside the plots.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum LegendPlace {
    /// Below the panels.
    #[default]
    Below,
    /// To the right of the panels.
    Right,
    /// No legend.
    Nowhere,
}

/// Sample of a content, drawn before its name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Sample {
    Line { look: Look, joined: bool, marker: Option<Marker> },
    Area { fill: Fill, border: Option<Look> },
    Tick(Look),
}

/// Returns sample and name of a content; `None` for a content without a name.
pub(crate) fn entry(content: &Content) -> Option<(Sample, &Text)> {
    let (sample, name) = match content {
        Content::Line(line) => (Sample::Line { look: line.look, joined: line.joined, marker: line.marker }, &line.name),
        Content::Band(band) => (Sample::Area { fill: band.fill, border: None }, &band.name),
        Content::Region(region) => (Sample::Area { fill: region.fill, border: region.border.as_ref().map(|line| line.look) }, &region.name),
        Content::Rug(rug) => (Sample::Tick(rug.look), &rug.name),
        Content::HeatMap(_) => return None,
    };
    (!name.is_empty()).then_some((sample, name))
}

/// Entries of a legend, positioned from the legend's top left corner \[px\].
#[derive(Debug, Default)]
pub(crate) struct Legend {
    entries: Vec<Placed>,
    pub(crate) width: f64,
    pub(crate) height: f64,
    font: f64,
}

#[derive(Debug)]
struct Placed {
    sample: Sample,
    x: f64,
    y: f64,
    lines: Vec<Text>,
}

/// Width of a sample \[font sizes\].
const SAMPLE: f64 = 2.6;
/// Distance from a sample to its name \[font sizes\].
const DISTANCE: f64 = 0.5;
/// Distance between two entries of a row \[font sizes\].
const BETWEEN: f64 = 1.6;

impl Legend {
    /// Lays out entries in rows of at most `width` \[px\], or an entry per row if `narrow`.
    pub(crate) fn new(entries: &[(Sample, Text)], font: f64, width: f64, narrow: bool) -> Self {
        let before = (SAMPLE + DISTANCE) * font;
        let mut legend = Self { font, ..Self::default() };
        let (mut x, mut y, mut row) = (0.0, 0.0, 0.0_f64);
        for (sample, name) in entries {
            // A legend narrower than a sample still leaves two font sizes for a name.
            let lines = name.wrapped(font, (width - before).max(2.0 * font), 4);
            let own = before + lines.iter().map(|line| line.width(font)).fold(0.0, f64::max);
            let height = LEADING * font * count(lines.len());
            // At the begin of a row `x` is zero: an entry too wide for any row stands alone, and no empty row comes before.
            if x > 0.0 && (narrow || x + own > width) {
                (x, y, row) = (0.0, y + row, 0.0);
            }
            legend.entries.push(Placed { sample: *sample, x, y, lines });
            legend.width = legend.width.max(x + own);
            x += own + BETWEEN * font;
            row = row.max(height);
        }
        legend.height = y + row;
        legend
    }

    pub(crate) fn draw(&self, xml: &mut Xml, (left, top): (f64, f64)) {
        for Placed { sample, x, y, lines } in &self.entries {
            let (x, y) = (left + x, top + y);
            // A sample stands 0.36 font sizes above the base line, at about half of the height of a capital letter.
            let middle = y + (ASCENT - 0.36) * self.font;
            draw_sample(xml, *sample, x, middle, self.font);
            let mut base = y + ASCENT * self.font;
            for line in lines {
                xml.line_of_text(line, (x + (SAMPLE + DISTANCE) * self.font, base), self.font, "ink", Anchor::Start);
                base += LEADING * self.font;
            }
        }
    }
}

fn draw_sample(xml: &mut Xml, sample: Sample, x: f64, y: f64, font: f64) {
    let end = x + SAMPLE * font;
    match sample {
        Sample::Line { look, joined, marker } => {
            if joined {
                stroke(xml, look, &format!("M{},{}H{}", coordinate(x), coordinate(y), coordinate(end)));
            }
            if let Some(marker) = marker {
                draw_marker(xml, marker, look, 0.5 * (x + end), y);
            }
        }
        Sample::Area { fill, border } => {
            let (left, top, height, width) = (coordinate(x), coordinate(y - 0.375 * font), coordinate(0.75 * font), coordinate(end - x));
            for class in fill.classes() {
                xml.element("rect", &[("class", &class), ("x", &left), ("y", &top), ("width", &width), ("height", &height)]);
            }
            if let Some(look) = border {
                stroke(xml, look, &format!("M{left},{top}h{width}v{height}h-{width}Z"));
            }
        }
        Sample::Tick(look) => {
            let at = |share: f64| coordinate(x + share * (end - x));
            let (low, high) = (coordinate(y + 0.4 * font), coordinate(y - 0.4 * font));
            // Uneven distances, as instants of losses have.
            let ticks: String = [0.25, 0.45, 0.8].iter().map(|share| format!("M{0},{low}L{0},{high}", at(*share))).collect();
            stroke(xml, look.solid().thin(), &ticks);
        }
    }
}

/// Draws a path with the stroke of a look.
pub(crate) fn stroke(xml: &mut Xml, look: Look, data: &str) {
    let class = look.stroke_class();
    let mut attributes = vec![("class", class.as_str()), ("stroke-width", look.width())];
    if !look.dashes().is_empty() {
        attributes.push(("stroke-dasharray", look.dashes()));
    }
    attributes.push(("d", data));
    xml.element("path", &attributes);
}

/// Half of the width of a marker \[px\].
const MARKER: f64 = 2.6;

pub(crate) fn draw_marker(xml: &mut Xml, marker: Marker, look: Look, x: f64, y: f64) {
    let (strokes, filled) = marker.strokes();
    // The disc is the only marker without outlines.
    if strokes.is_empty() {
        xml.element("circle", &[("class", &look.fill_class()), ("cx", &coordinate(x)), ("cy", &coordinate(y)), ("r", &coordinate(MARKER))]);
        return;
    }
    let runs: Vec<Vec<(f64, f64)>> =
        strokes.iter().map(|corners| corners.iter().map(|(dx, dy)| (x + MARKER * dx, y + MARKER * dy)).collect()).collect();
    let data = crate::path::data(&runs, filled);
    if filled {
        xml.element("path", &[("class", &look.fill_class()), ("d", &data)]);
    } else {
        // Dashes would hide the shape of a small marker.
        stroke(xml, look.solid(), &data);
    }
}
