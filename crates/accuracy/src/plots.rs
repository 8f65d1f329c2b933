//! Work–precision plots: cost along, error up, both logarithmic, a line for each method.
//!
//! An error of zero has no logarithm. It is drawn at the foot of the plot, below all other errors, as a triangle that points down, and the legend says
//! so. What has no error or no cost is not drawn; the caption counts it.

use cohaptic_harness::record::svg::{self, COLOURS, Drawing, DrawingResult};
use plotters::element::DashedPathElement;
use plotters::prelude::*;

use crate::Row;
use crate::groups::{Group, groups};
use crate::scale::Scale;

/// One plot.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Plot {
    /// A short name, also that of its file; no two are the same.
    pub id: String,
    /// What it shows.
    pub title: String,
    /// What is not drawn, or drawn elsewhere; may be empty.
    pub caption: String,
    /// The drawing, an SVG document without a background, whose text has the colour of the text around it.
    pub svg: String,
}

impl Plot {
    /// The picture on a white ground, for a file of its own.
    #[must_use]
    pub fn on_white(&self) -> String {
        self.svg.replacen("<svg ", "<svg style=\"background:#fff;color:#000\" ", 1)
    }
}

/// A plot for each group of rows that has anything to draw.
#[must_use]
pub fn plots(rows: &[Row]) -> Vec<Plot> {
    let mut plots: Vec<Plot> = Vec::new();
    for group in groups(rows) {
        let drawn = Drawn::of(&group);
        if drawn.methods.is_empty() {
            continue;
        }
        let wanted = slug(&format!("{}-{}-{}", group.subject.name(), group.case, group.error_unit));
        let taken = |id: &str| plots.iter().any(|plot| plot.id == id);
        let id = if taken(&wanted) { slug(&format!("{wanted}-{}", group.cost_unit)) } else { wanted };
        let mut unique = id.clone();
        let mut number = 2;
        while taken(&unique) {
            unique = format!("{id}-{number}");
            number += 1;
        }
        plots.push(Plot { id: unique, title: group.title(), caption: drawn.caption(), svg: draw(&group, &drawn) });
    }
    plots
}

/// Small letters, digits and hyphens.
fn slug(text: &str) -> String {
    let mut slug = String::new();
    for letter in text.chars() {
        if letter.is_ascii_alphanumeric() {
            slug.push(letter.to_ascii_lowercase());
        } else if !slug.ends_with('-') && !slug.is_empty() {
            slug.push('-');
        }
    }
    slug.trim_end_matches('-').to_owned()
}

/// What is drawn of a group: the decimal logarithms of numbers, on which plotters' own logarithmic scale is not sure of itself over hundreds of decades.
struct Drawn<'a> {
    /// Cost and error of each row of each method. An error of zero is at the floor.
    methods: Vec<(&'a str, Vec<Point>)>,
    x: Scale,
    y: Scale,
    zeros: usize,
    left_out: usize,
}

#[derive(Clone, Copy)]
struct Point {
    cost: f64,
    error: f64,
    is_zero: bool,
}

impl<'a> Drawn<'a> {
    fn of(group: &Group<'a>) -> Self {
        let usable = |row: &Row| match (row.cost, row.error) {
            (Some(cost), Some(error)) if cost.is_finite() && cost > 0.0 && error.is_finite() && error >= 0.0 => Some((cost, error)),
            _ => None,
        };
        let all: Vec<(f64, f64)> = group.rows.iter().filter_map(|row| usable(row)).collect();
        let zeros = all.iter().filter(|(_, error)| *error == 0.0).count();
        let (x, mut y) = (Scale::over(all.iter().map(|(cost, _)| *cost)), Scale::over(all.iter().map(|(_, error)| *error)));
        if zeros > 0 {
            // The floor is a decade below the least error, so that zero is not taken for it.
            y.low -= 1.0;
        }
        let mut methods = Vec::new();
        for method in group.methods() {
            let rows = group.rows.iter().filter(|row| row.method == method);
            let point = |(cost, error): (f64, f64)| {
                let is_zero = error == 0.0;
                Point { cost: libm::log10(cost), error: if is_zero { y.low } else { libm::log10(error) }, is_zero }
            };
            let points: Vec<Point> = rows.filter_map(|row| usable(row)).map(point).collect();
            if !points.is_empty() {
                methods.push((method, points));
            }
        }
        Self { methods, x, y, zeros, left_out: group.rows.len() - all.len() }
    }

    fn caption(&self) -> String {
        let mut sentences = Vec::new();
        let rows = |count: usize| if count == 1 { "One row has".to_owned() } else { format!("{count} rows have") };
        if self.zeros > 0 {
            sentences.push(format!("{} an error of exactly 0: a triangle at the foot, where there is no scale.", rows(self.zeros)));
        }
        if self.left_out > 0 {
            sentences.push(format!("{} no error or no cost and cannot be drawn: see the table.", rows(self.left_out)));
        }
        sentences.join(" ")
    }
}

const WIDTH: u32 = 760;
const HEIGHT: u32 = 420;
/// The height of an entry of the legend \[pixels\].
const ENTRY: u32 = 20;
const GREY: RGBColor = RGBColor(128, 128, 128);
/// Lengths of dashes and gaps \[pixels\], so that lines are told apart in black and white.
const DASHES: [Option<(u32, u32)>; 5] = [None, Some((10, 5)), Some((3, 4)), Some((20, 6)), Some((6, 12))];

fn draw(group: &Group<'_>, drawn: &Drawn<'_>) -> String {
    let entries = u32::try_from(drawn.methods.len() + usize::from(drawn.zeros > 0)).unwrap_or(u32::MAX / ENTRY);
    let legend = entries.saturating_mul(ENTRY) + 12;
    svg::within_a_page((WIDTH, HEIGHT.saturating_add(legend)), &group.title(), |root| all(root, group, drawn))
}

fn all<'a>(root: &Drawing<'a>, group: &Group<'_>, drawn: &Drawn<'_>) -> DrawingResult<'a> {
    let (picture, legend) = root.split_vertically(HEIGHT);
    let mut chart = ChartBuilder::on(&picture)
        .caption(group.title(), ("sans-serif", 15))
        .margin(10)
        .margin_right(20)
        .x_label_area_size(42)
        .y_label_area_size(66)
        .build_cartesian_2d(drawn.x, drawn.y)?;
    chart
        .configure_mesh()
        .x_desc(group.cost_unit)
        .y_desc(format!("error: {}", group.error_unit))
        .bold_line_style(GREY.mix(0.3))
        .light_line_style(TRANSPARENT)
        .draw()?;
    for (place, (_, points)) in drawn.methods.iter().enumerate() {
        let (style, dash) = look(place);
        // A line joins what has an error; zero is no point of it.
        let line: Vec<(f64, f64)> = points.iter().filter(|point| !point.is_zero).map(|point| (point.cost, point.error)).collect();
        match dash {
            None => chart.draw_series(LineSeries::new(line.iter().copied(), style))?,
            Some((dash, gap)) => chart.draw_series(DashedLineSeries::new(line.iter().copied(), dash, gap, style))?,
        };
        chart.draw_series(line.iter().map(|at| Circle::new(*at, radius(place), style.filled())))?;
        let zeros = points.iter().filter(|point| point.is_zero);
        // A triangle of plotters points up; a negative size turns it round.
        chart.draw_series(zeros.map(|point| TriangleMarker::new((point.cost, point.error), -7, style.filled())))?;
    }
    draw_legend(&legend, drawn)
}

fn look(place: usize) -> (ShapeStyle, Option<(u32, u32)>) {
    (COLOURS[place % COLOURS.len()].stroke_width(2), DASHES[place % DASHES.len()])
}

/// The first points are larger, so that they are seen around others at the same place \[pixels\].
fn radius(place: usize) -> i32 {
    [5, 4].get(place).copied().unwrap_or(3)
}

fn draw_legend<'a>(area: &Drawing<'a>, drawn: &Drawn<'_>) -> DrawingResult<'a> {
    const LEFT: i32 = 76;
    const RIGHT: i32 = LEFT + 56;
    let mut y = ENTRY.cast_signed() / 2;
    for (place, (method, _)) in drawn.methods.iter().enumerate() {
        let (style, dash) = look(place);
        match dash {
            None => area.draw(&PathElement::new([(LEFT, y), (RIGHT, y)], style))?,
            Some((dash, gap)) => area.draw(&DashedPathElement::new([(LEFT, y), (RIGHT, y)], dash, gap, style))?,
        }
        area.draw(&Circle::new((LEFT.midpoint(RIGHT), y), radius(place), style.filled()))?;
        area.draw(&Text::new((*method).to_owned(), (RIGHT + 12, y - 7), ("sans-serif", 14)))?;
        y += ENTRY.cast_signed();
    }
    if drawn.zeros > 0 {
        area.draw(&TriangleMarker::new((LEFT.midpoint(RIGHT), y), -7, BLACK.filled()))?;
        area.draw(&Text::new("error exactly 0, drawn at the foot", (RIGHT + 12, y - 7), ("sans-serif", 14)))?;
    }
    Ok(())
}
