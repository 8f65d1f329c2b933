//! Draws a laid out picture as an SVG document.
//!
//! Input is a [`Picture`] and its [`Layout`] with all positions; output is text. No position of a text is decided here.

use crate::content::{Band, Content, HeatMap, Line, Region, Rug};
use crate::extent::{Extent, Scale, count, whole};
use crate::layout::{AFTER_TICK, AxisLayout, BAR, Layout, PanelLayout, TICK, TITLE};
use crate::legend::{draw_marker, stroke};
use crate::look::{Fill, PATTERNS, style};
use crate::panel::{Extents, Panel};
use crate::path::{Frame, data, reduced};
use crate::picture::Picture;
use crate::size::MILLIMETRE;
use crate::text::{ASCENT, LEADING, Text};
use crate::xml::{Anchor, Xml, coordinate, escape};

/// Distance from the middle of letters to the base line \[font sizes\].
const MIDDLE: f64 = 0.35;

impl Picture {
    /// Returns the picture as an SVG document, valid as a file and as a part of an HTML page.
    #[must_use]
    pub fn svg(&self) -> String {
        document(self, &Layout::of(self))
    }
}

fn document(picture: &Picture, layout: &Layout) -> String {
    let mut xml = Xml::default();
    let (width, height) = (coordinate(layout.width), coordinate(layout.height));
    let millimetres = |pixels: f64| format!("{}mm", coordinate(pixels / MILLIMETRE));
    let (shown_width, shown_height) =
        if picture.size.print { (millimetres(layout.width), millimetres(layout.height)) } else { (width.clone(), height.clone()) };
    xml.text.push_str(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"cohaptic-picture\" role=\"img\" width=\"{shown_width}\" height=\"{shown_height}\" viewBox=\"0 0 {width} {height}\">\n\
         <title>{}</title>\n<desc>{}</desc>\n",
        escape(&picture.title.plain()),
        escape(&picture.spoken())
    ));
    xml.text.push_str(&format!("<style>\n{}</style>\n", style()));
    xml.text.push_str(PATTERNS);
    xml.element("rect", &[("class", "paper"), ("width", &width), ("height", &height)]);
    let font = picture.size.font;
    let mut y = layout.margin;
    for (lines, size, class) in [(&layout.title, TITLE * font, "ink"), (&layout.notes, font, "quiet")] {
        for line in lines {
            xml.line_of_text(line, (layout.margin, y + ASCENT * size), size, class, Anchor::Start);
            y += LEADING * size;
        }
    }
    for (panel, placed) in picture.panels.iter().zip(&layout.panels) {
        Sheet { xml: &mut xml, placed, font }.draw(panel);
    }
    layout.legend.draw(&mut xml, layout.legend_at);
    xml.text.push_str("</svg>\n");
    xml.text
}

/// A panel being drawn.
struct Sheet<'a> {
    xml: &'a mut Xml,
    placed: &'a PanelLayout,
    font: f64,
}

impl Sheet<'_> {
    fn frame(&self) -> Frame {
        self.placed.frame
    }

    /// Returns the pixel position of an x value.
    fn x(&self, value: f64) -> f64 {
        let frame = self.frame();
        // Positions far outside are invisible; the limit keeps later computations finite.
        frame.left + frame.width() * self.placed.extents.x.place(value).clamp(-1e6, 1e6)
    }

    fn y(&self, value: f64) -> f64 {
        let frame = self.frame();
        frame.bottom - frame.height() * self.placed.extents.y.place(value).clamp(-1e6, 1e6)
    }

    /// Returns the pixel position of a corner of an area. A value of zero or below on a logarithmic axis is placed below the low end, where the border of
    /// the area is invisible.
    fn corner(&self, x: f64, y: f64) -> (f64, f64) {
        let reaching = |extent: Extent, value: f64| if extent.scale == Scale::Logarithmic { value.max(f64::MIN_POSITIVE) } else { value };
        let Extents { x: along, y: up } = self.placed.extents;
        (self.x(reaching(along, x)), self.y(reaching(up, y)))
    }

    fn draw(&mut self, panel: &Panel) {
        // Areas first, then the grid, then lines, so that neither the grid nor lines are covered.
        for content in &panel.contents {
            match content {
                Content::HeatMap(map) => self.heat_map(map),
                Content::Band(band) => self.band(band),
                Content::Region(region) => self.region(region),
                Content::Line(_) | Content::Rug(_) => {}
            }
        }
        // Grid lines over a heat map would hide cells.
        if panel.heat_map().is_none() {
            self.grid();
        }
        self.axes();
        for content in &panel.contents {
            match content {
                Content::Line(line) => self.line(line),
                Content::Rug(rug) => self.rug(rug),
                Content::Region(region) => region.border.iter().for_each(|border| self.line(border)),
                Content::HeatMap(_) | Content::Band(_) => {}
            }
        }
        self.ends();
        if let (Some(map), Some(bar)) = (panel.heat_map(), &self.placed.bar) {
            self.colour_bar(map, bar);
        }
    }

    fn grid(&mut self) {
        let frame = self.frame();
        let mut path = String::new();
        for value in values(&self.placed.x) {
            path.push_str(&format!("M{0},{1}L{0},{2}", coordinate(self.x(value)), coordinate(frame.top), coordinate(frame.bottom)));
        }
        for value in values(&self.placed.y) {
            path.push_str(&format!("M{1},{0}L{2},{0}", coordinate(self.y(value)), coordinate(frame.left), coordinate(frame.right)));
        }
        self.xml.element("path", &[("class", "grid"), ("stroke-width", "0.7"), ("d", &path)]);
    }

    fn axes(&mut self) {
        let (frame, font) = (self.frame(), self.font);
        let (left, right, top, bottom) = (coordinate(frame.left), coordinate(frame.right), coordinate(frame.top), coordinate(frame.bottom));
        let mut path = format!("M{left},{top}L{left},{bottom}L{right},{bottom}");
        // A heat map fills the plot, so a closed frame separates the cells from the paper.
        if self.placed.bar.is_some() {
            path.push_str(&format!("L{right},{top}Z"));
        }
        let outside = (coordinate(frame.bottom + TICK * font), coordinate(frame.left - TICK * font));
        for value in values(&self.placed.x) {
            path.push_str(&format!("M{0},{bottom}L{0},{1}", coordinate(self.x(value)), outside.0));
        }
        for value in values(&self.placed.y) {
            path.push_str(&format!("M{left},{0}L{1},{0}", coordinate(self.y(value)), outside.1));
        }
        self.xml.element("path", &[("class", "frame"), ("stroke-width", "0.9"), ("d", &path)]);

        let mut base = frame.top - 0.75 * font - LEADING * font * count(self.placed.title.len()) + ASCENT * font;
        for line in &self.placed.title {
            self.xml.line_of_text(line, (frame.left, base), font, "ink", Anchor::Start);
            base += LEADING * font;
        }
        let placed = self.placed;
        let mut base = frame.bottom + (0.6 + ASCENT) * font;
        if placed.x.labelled {
            for (value, label) in marks(&placed.x) {
                let x = self.x(*value);
                self.xml.line_of_text(label, (x, base), font, "ink", Anchor::Middle);
            }
            base += LEADING * font;
        }
        for line in &placed.x.title {
            self.xml.line_of_text(line, (frame.left + 0.5 * frame.width(), base), font, "ink", Anchor::Middle);
            base += LEADING * font;
        }
        if placed.y.labelled {
            for (value, label) in marks(&placed.y) {
                let y = self.y(*value) + MIDDLE * font;
                self.xml.line_of_text(label, (frame.left - (TICK + AFTER_TICK) * font, y), font, "ink", Anchor::End);
            }
        }
        // The last line of a rotated title is nearest to the axis, so lines are drawn from the last to the first.
        let mut x = frame.left - placed.y_title_at - (LEADING - ASCENT) * font;
        for line in placed.y.title.iter().rev() {
            self.xml.text_upwards(line, (x, frame.top + 0.5 * frame.height()), font, "ink");
            x -= LEADING * font;
        }
    }

    fn line(&mut self, line: &Line) {
        let frame = self.frame();
        let mut seen: Vec<Vec<(f64, f64)>> = Vec::new();
        for run in &line.runs {
            let points: Vec<(f64, f64)> = run.iter().map(|(x, y)| (self.x(*x), self.y(*y))).collect();
            // The line is interrupted at a value without a place, such as zero on a logarithmic axis.
            for part in points.split(|(x, y)| !x.is_finite() || !y.is_finite()).filter(|part| !part.is_empty()) {
                seen.extend(frame.cut_line(part));
            }
            if let Some(marker) = line.marker {
                let mut last: Option<(f64, f64)> = None;
                for (x, y) in points.into_iter().filter(|point| frame.contains(*point)) {
                    // A marker on top of a marker would only lengthen the document. The distance counts from the last drawn marker, so that many small steps
                    // add up.
                    if last.is_none_or(|(a, b)| libm::hypot(x - a, y - b) > 0.3) {
                        draw_marker(self.xml, marker, line.look, x, y);
                        last = Some((x, y));
                    }
                }
            }
        }
        if !line.joined {
            return;
        }
        // A run of a single point has no length and would be invisible as a path; it becomes a dot.
        let (alone, runs): (Vec<_>, Vec<_>) = seen.iter().map(|run| reduced(run)).partition(|run| run.len() == 1);
        if !runs.is_empty() {
            stroke(self.xml, line.look, &data(&runs, false));
        }
        for (x, y) in alone.into_iter().flatten().filter(|_| line.marker.is_none()) {
            let class = line.look.fill_class();
            self.xml.element("circle", &[("class", &class), ("cx", &coordinate(x)), ("cy", &coordinate(y)), ("r", "1.2")]);
        }
    }

    fn area(&mut self, outlines: &[Vec<(f64, f64)>], fill: Fill) {
        let frame = self.frame();
        let cut: Vec<Vec<(f64, f64)>> = outlines
            .iter()
            .filter(|outline| outline.iter().all(|(x, y)| x.is_finite() && y.is_finite()))
            .map(|outline| frame.cut_outline(outline))
            .filter(|outline| outline.len() > 2)
            .collect();
        if cut.is_empty() {
            return;
        }
        // One path for all outlines, because the even-odd rule makes holes only within a path.
        let data = data(&cut, true);
        for class in fill.classes() {
            self.xml.element("path", &[("class", &class), ("fill-rule", "evenodd"), ("d", &data)]);
        }
    }

    fn band(&mut self, band: &Band) {
        for run in &band.runs {
            let high = reduced(&run.iter().map(|(x, _, high)| self.corner(*x, *high)).collect::<Vec<_>>());
            let low = reduced(&run.iter().map(|(x, low, _)| self.corner(*x, *low)).collect::<Vec<_>>());
            // Along the upper curve and back along the lower curve: a closed outline.
            self.area(&[high.into_iter().chain(low.into_iter().rev()).collect()], band.fill);
        }
    }

    fn region(&mut self, region: &Region) {
        let outline = |outline: &Vec<(f64, f64)>| outline.iter().map(|(x, y)| self.corner(*x, *y)).collect();
        let outlines: Vec<Vec<(f64, f64)>> = region.outlines.iter().map(outline).collect();
        self.area(&outlines, region.fill);
    }

    fn rug(&mut self, rug: &Rug) {
        let frame = self.frame();
        let mut path = String::new();
        let mut places: Vec<f64> = rug.xs.iter().map(|x| self.x(*x)).filter(|x| frame.contains((*x, frame.bottom))).collect();
        places.sort_by(f64::total_cmp);
        // Two marks closer than a quarter of a pixel look like one.
        places.dedup_by(|one, other| (*one - *other).abs() < 0.25);
        for x in places {
            path.push_str(&format!("M{0},{1}L{0},{2}", coordinate(x), coordinate(frame.bottom), coordinate(frame.bottom - 0.8 * self.font)));
        }
        if !path.is_empty() {
            // Dashes would break up marks as short as these.
            stroke(self.xml, rug.look.solid().thin(), &path);
        }
    }

    fn heat_map(&mut self, map: &HeatMap) {
        let extent = map.extent();
        // Any value inside both scales will do for the coordinate that is ignored; 1 has a place on a logarithmic axis too.
        let (xs, ys): (Vec<f64>, Vec<f64>) =
            (map.columns.iter().map(|x| self.corner(*x, 1.0).0).collect(), map.rows.iter().map(|y| self.corner(1.0, *y).1).collect());
        // Neighbouring cells of the same colour form a rectangle, and all rectangles of a colour form a path, which keeps the document small.
        let mut by_colour: Vec<Vec<Vec<(f64, f64)>>> = vec![Vec::new(); SHADES];
        for (row, values) in map.values.iter().enumerate() {
            let shades: Vec<Option<usize>> = values.iter().map(|value| shade(extent, *value)).collect();
            let mut column = 0;
            for run in shades.chunk_by(|one, other| one == other) {
                let (left, right) = (xs[column], xs[column + run.len()]);
                column += run.len();
                if let Some(shade) = run[0] {
                    by_colour[shade].push(vec![(left, ys[row]), (right, ys[row]), (right, ys[row + 1]), (left, ys[row + 1])]);
                }
            }
        }
        let frame = self.frame();
        for (shade, outlines) in by_colour.iter().enumerate() {
            let cut: Vec<_> = outlines.iter().map(|outline| frame.cut_outline(outline)).filter(|outline| outline.len() > 2).collect();
            if !cut.is_empty() {
                self.xml.element("path", &[("class", "cells"), ("fill", &colour(shade)), ("d", &data(&cut, true))]);
            }
        }
    }

    fn colour_bar(&mut self, map: &HeatMap, bar: &AxisLayout) {
        let (frame, font, extent) = (self.frame(), self.font, map.extent());
        let (left, right) = (frame.right + 0.8 * font, frame.right + (0.8 + BAR) * font);
        let at = |share: f64| frame.bottom - frame.height() * share;
        let shades = count(SHADES);
        for place in 0..SHADES {
            let (low, high) = (at(count(place) / shades), at(count(place + 1) / shades));
            let outline = vec![(left, low), (right, low), (right, high), (left, high)];
            self.xml.element("path", &[("class", "cells"), ("fill", &colour(place)), ("d", &data(&[outline], true))]);
        }
        let mut path = data(&[vec![(left, frame.bottom), (right, frame.bottom), (right, frame.top), (left, frame.top)]], true);
        for (value, label) in marks(bar) {
            let y = at(extent.place(*value));
            path.push_str(&data(&[vec![(right, y), (right + TICK * font, y)]], false));
            self.xml.line_of_text(label, (right + (TICK + AFTER_TICK) * font, y + MIDDLE * font), font, "ink", Anchor::Start);
        }
        self.xml.element("path", &[("class", "frame"), ("stroke-width", "0.9"), ("d", &path)]);
        let mut x = right + (TICK + AFTER_TICK + 0.35 + ASCENT) * font + bar.widest(font);
        for line in &bar.title {
            self.xml.text_upwards(line, (x, frame.top + 0.5 * frame.height()), font, "ink");
            x += LEADING * font;
        }
    }

    fn ends(&mut self) {
        let (frame, font) = (self.frame(), self.font);
        for label in &self.placed.ends {
            let (end, middle) = (frame.top + frame.height() * label.end, frame.top + frame.height() * label.middle);
            let leader = vec![
                (frame.right + 0.2 * font, end),
                (frame.right + 0.5 * font, end),
                (frame.right + 0.9 * font, middle),
                (frame.right + 1.3 * font, middle),
            ];
            stroke(self.xml, label.look.solid().thin(), &data(&[leader], false));
            let lines = count(label.lines.len());
            let mut base = middle - 0.5 * LEADING * font * lines + (0.5 * LEADING + MIDDLE) * font;
            for line in &label.lines {
                self.xml.line_of_text(line, (frame.right + 1.5 * font, base), font, "ink", Anchor::Start);
                base += LEADING * font;
            }
        }
    }
}

fn marks(axis: &AxisLayout) -> &[(f64, Text)] {
    axis.ticks.as_ref().map_or(&[], |ticks| &ticks.marks)
}

fn values(axis: &AxisLayout) -> impl Iterator<Item = f64> {
    marks(axis).iter().map(|(value, _)| *value)
}

/// Number of colours of a heat map.
const SHADES: usize = 64;

fn shade(extent: Extent, value: f64) -> Option<usize> {
    let share = extent.place(value);
    (value.is_finite() && share.is_finite()).then(|| whole(share.clamp(0.0, 1.0) * count(SHADES)).min(SHADES - 1))
}

fn colour(shade: usize) -> String {
    let colour = colorous::CIVIDIS.eval_rational(shade, SHADES);
    format!("#{colour:x}")
}
