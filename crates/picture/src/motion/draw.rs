//! The shapes of an animation, at the places of the last frame.

use std::fmt::Write as _;

use super::style::COUNT;
use super::{EDGE, FONT, HEIGHT, MARGIN, Motion, MotionRun, RING, TITLE, View, WIDTH, edge_of};
use crate::xml::{coordinate, escape};

impl Motion {
    /// Returns the animation as an SVG document. For a reader who has turned animations off, the document shows the last frame.
    #[must_use]
    pub fn svg(&self) -> String {
        let view = self.view();
        let top = MARGIN + 1.2 * TITLE + if self.note.is_empty() { 0.0 } else { 1.5 * FONT };
        let height = top + 2.2 * FONT + HEIGHT + 2.8 * FONT;
        let mut xml = String::new();
        let (width, shown_height) = (coordinate(WIDTH), coordinate(height));
        let _ = write!(
            xml,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"cohaptic-picture\" role=\"img\" width=\"{width}\" height=\"{shown_height}\" \
             viewBox=\"0 0 {width} {shown_height}\">\n<title>{}</title>\n<desc>{}</desc>\n",
            escape(&self.title),
            escape(&self.spoken(&view))
        );
        let _ = writeln!(xml, "<style>\n{}</style>", self.style(&view));
        let _ = writeln!(xml, "<rect class=\"paper\" width=\"{width}\" height=\"{shown_height}\"/>");
        write_text(&mut xml, &self.title, [MARGIN, MARGIN + TITLE], TITLE, "");
        write_text(&mut xml, &self.note, [MARGIN, MARGIN + TITLE + 1.5 * FONT], FONT, "");
        let mut left = MARGIN;
        for number in 0..self.runs.len() {
            self.write_run(&mut xml, number, [left, top], &view);
            left += self.frame_width() + MARGIN;
        }
        xml.push_str("</svg>\n");
        xml
    }

    /// Writes a run: title, frame, paths, copies, hands and legend. `left` and `top` are the upper left corner \[px\].
    fn write_run(&self, xml: &mut String, number: usize, [left, top]: [f64; 2], view: &View) {
        let run = &self.runs[number];
        write_text(xml, &run.title, [left, top + 1.4 * FONT], FONT, "");
        let below = top + 2.2 * FONT;
        let width = self.frame_width();
        let [x, y, w, h] = [left, below, width, HEIGHT].map(coordinate);
        let _ = writeln!(xml, "<clipPath id=\"room{number}\"><rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"/></clipPath>");
        let _ = writeln!(xml, "<rect class=\"frame\" x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"/>");
        let bar = coordinate(below + HEIGHT);
        let _ = writeln!(xml, "<rect class=\"elapsed\" x=\"{x}\" y=\"{bar}\" width=\"{w}\" height=\"3\"/>");
        let _ = writeln!(xml, "<g clip-path=\"url(#room{number})\">");
        let middle = [left + width / 2.0, below + HEIGHT / 2.0];
        let at = |place: [f64; 2]| {
            let shift = view.shift(place);
            [middle[0] + shift[0], middle[1] + shift[1]]
        };
        // All paths come before all copies: no path may hide a copy.
        for copy in 0..run.names.len() {
            write_path(xml, run, copy, at);
        }
        for copy in 0..run.names.len() {
            // Without animations the reader sees the last frame, so the shapes stand there in the document itself.
            let shift = run.frames.last().and_then(|frame| frame.get(copy)).map_or([0.0; 2], |place| view.shift(*place));
            let edge = edge_of(copy, run.names.len());
            let [x, y] = middle.map(|middle| coordinate(middle - edge / 2.0));
            let ([dx, dy], edge, corner, colour) = (shift.map(coordinate), coordinate(edge), coordinate(edge / 6.0), copy % COUNT);
            let _ = writeln!(
                xml,
                "<rect class=\"f{colour} copy c{number}-{copy}\" x=\"{x}\" y=\"{y}\" width=\"{edge}\" height=\"{edge}\" rx=\"{corner}\" \
                 transform=\"translate({dx} {dy})\"/>"
            );
        }
        for (index, hand) in run.hands.iter().enumerate() {
            let [dx, dy] = hand.frames.last().map_or([0.0; 2], |place| view.shift(*place)).map(coordinate);
            let ([x, y], colour) = (middle.map(coordinate), hand.copy % COUNT);
            let _ = writeln!(
                xml,
                "<circle class=\"s{colour} hand h{number}-{index}\" cx=\"{x}\" cy=\"{y}\" r=\"{}\" transform=\"translate({dx} {dy})\"/>",
                coordinate(RING)
            );
        }
        if let Some(text) = self.departure(run, view) {
            write_text(xml, &text, [left + FONT, below + HEIGHT - FONT], FONT, &format!(" told g{number}"));
        }
        xml.push_str("</g>\n");
        write_legend(xml, run, [left, below + HEIGHT + 2.0 * FONT]);
        let seconds = format!("{:.1} s", self.seconds());
        // Aligned to the right edge of the frame by the width of the digits.
        let wide = u32::try_from(seconds.len()).map_or(0.0, f64::from) * 0.6 * FONT;
        write_text(xml, &seconds, [left + width - wide, below + HEIGHT + 2.0 * FONT], FONT, "");
    }

    /// Says since when the copies are outside the frame.
    fn departure(&self, run: &MotionRun, view: &View) -> Option<String> {
        run.left_at(view).map(|frame| format!("All copies are outside this frame from {:.1} s on.", self.time_of(frame)))
    }

    /// Returns the content in words, for readers who do not see the picture.
    fn spoken(&self, view: &View) -> String {
        let runs = self.runs.iter().map(|run| {
            let departure = self.departure(run, view).map_or(String::new(), |text| format!(" {text}"));
            format!("{}: {} in motion for {:.1} s.{departure}", run.title, run.names.join(", "), self.seconds())
        });
        std::iter::once(self.note.clone()).filter(|note| !note.is_empty()).chain(runs).collect::<Vec<_>>().join(" ")
    }
}

/// Writes the path of a copy, in pieces that appear one after the other. `at` maps a position \[m\] to the picture \[px\].
fn write_path(xml: &mut String, run: &MotionRun, copy: usize, at: impl Fn([f64; 2]) -> [f64; 2]) {
    let places: Vec<[f64; 2]> = run.frames.iter().filter_map(|places| places.get(copy)).map(|place| at(*place)).collect();
    let colour = copy % COUNT;
    // A path under others is wider, as the copy under others is larger: where copies move together, each path is seen.
    let width = coordinate(edge_of(copy, run.names.len()) / 12.0);
    for piece in run.pieces(copy) {
        let end = *piece.end();
        let points = places[piece].iter().map(|point| point.map(coordinate).join(","));
        let _ =
            writeln!(xml, "<polyline class=\"s{colour} path p{end}\" stroke-width=\"{width}\" points=\"{}\"/>", points.collect::<Vec<_>>().join(" "));
    }
}

/// Writes the names of the copies, each with colour and size, and the meaning of a ring.
fn write_legend(xml: &mut String, run: &MotionRun, [mut x, y]: [f64; 2]) {
    for (copy, name) in run.names.iter().enumerate() {
        // Sizes in the legend have the proportions of the sizes in the frame.
        let edge = FONT * edge_of(copy, run.names.len()) / EDGE;
        let [at, top, size] = [x + (FONT - edge) / 2.0, y - 0.35 * FONT - edge / 2.0, edge].map(coordinate);
        let _ = writeln!(xml, "<rect class=\"f{}\" x=\"{at}\" y=\"{top}\" width=\"{size}\" height=\"{size}\" rx=\"2\"/>", copy % COUNT);
        write_text(xml, name, [x + 1.4 * FONT, y], FONT, "");
        x += 2.6 * FONT + width_of(name);
    }
    if let Some(hand) = run.hands.first() {
        let [cx, cy, radius] = [x + FONT / 2.0, y - 0.35 * FONT, FONT / 2.0].map(coordinate);
        let _ = writeln!(xml, "<circle class=\"s{} hand\" cx=\"{cx}\" cy=\"{cy}\" r=\"{radius}\"/>", hand.copy % COUNT);
        write_text(xml, "device in the hand", [x + 1.4 * FONT, y], FONT, "");
    }
}

/// Returns a width \[px\] that the text does not exceed in any common font.
fn width_of(text: &str) -> f64 {
    u32::try_from(text.chars().count()).map_or(0.0, f64::from) * 0.7 * FONT
}

/// Writes a text of font size `size` \[px\] at a position \[px\]. `classes` are further classes of the style sheet, each after a space. Writes nothing for an
/// empty text.
fn write_text(xml: &mut String, text: &str, [x, y]: [f64; 2], size: f64, classes: &str) {
    if !text.is_empty() {
        let [x, y, size] = [x, y, size].map(coordinate);
        let _ = writeln!(xml, "<text class=\"ink{classes}\" x=\"{x}\" y=\"{y}\" font-size=\"{size}\">{}</text>", escape(text));
    }
}
