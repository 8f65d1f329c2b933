//! Panels of curves as SVG.
//!
//! There is no background, and what is black in the drawing has the colour of the text around it, so that a figure can stand on a dark page.

use cohaptic_harness::record::svg::{self, COLOURS, Drawing, DrawingResult};
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

/// A curve, which may have gaps.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Line {
    pub(crate) name: String,
    /// Which of the colours.
    pub(crate) colour: usize,
    pub(crate) dashed: bool,
    pub(crate) runs: Vec<Vec<(f64, f64)>>,
}

/// Curves over one pair of axes.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Panel {
    pub(crate) title: String,
    pub(crate) x_label: &'static str,
    pub(crate) y_label: &'static str,
    pub(crate) x: (f64, f64),
    pub(crate) y: (f64, f64),
    /// Whether x is logarithmic.
    pub(crate) decades: bool,
    pub(crate) lines: Vec<Line>,
}

/// The width of a panel [px].
const WIDTH: u32 = 480;
/// The height of a panel [px].
const HEIGHT: u32 = 300;
const GREY: RGBColor = RGBColor(128, 128, 128);

impl Line {
    /// A curve without gaps, cut where it leaves the range of y.
    pub(crate) fn within(name: String, colour: usize, points: impl IntoIterator<Item = (f64, f64)>, y: (f64, f64)) -> Self {
        let mut runs = vec![Vec::new()];
        for point in points {
            if (y.0..=y.1).contains(&point.1) {
                if let Some(run) = runs.last_mut() {
                    run.push(point);
                }
            } else {
                runs.push(Vec::new());
            }
        }
        runs.retain(|run| !run.is_empty());
        Self { name, colour, dashed: false, runs }
    }

    pub(crate) fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }
}

/// Draws the panels in that many columns.
pub(crate) fn draw(panels: &[Panel], columns: usize, title: &str) -> String {
    let rows = panels.len().div_ceil(columns);
    let pixels = |count: usize, each: u32| u32::try_from(count).unwrap_or(1) * each;
    svg::within_a_page((pixels(columns, WIDTH), pixels(rows, HEIGHT)), title, |root| all(root, panels, (rows, columns)))
}

fn all<'a>(root: &Drawing<'a>, panels: &[Panel], grid: (usize, usize)) -> DrawingResult<'a> {
    for (area, panel) in root.split_evenly(grid).iter().zip(panels) {
        let (low, high) = panel.x;
        if panel.decades {
            draw_panel(area, panel, (low..high).log_scale())?;
        } else {
            draw_panel(area, panel, low..high)?;
        }
    }
    Ok(())
}

fn draw_panel<'a, X>(area: &Drawing<'a>, panel: &Panel, x: X) -> DrawingResult<'a>
where
    X: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64> + Ranged<ValueType = f64>,
{
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 14))
        .margin(8)
        .x_label_area_size(36)
        .y_label_area_size(58)
        .build_cartesian_2d(x, panel.y.0..panel.y.1)?;
    let faint = GREY.mix(0.25);
    chart.configure_mesh().x_desc(panel.x_label).y_desc(panel.y_label).bold_line_style(faint).light_line_style(TRANSPARENT).draw()?;
    for line in &panel.lines {
        let style = COLOURS[line.colour % COLOURS.len()].stroke_width(if line.dashed { 1 } else { 2 });
        for run in &line.runs {
            if line.dashed {
                chart.draw_series(DashedLineSeries::new(run.iter().copied(), 5, 4, style))?;
            } else {
                chart.draw_series(LineSeries::new(run.iter().copied(), style))?;
            }
        }
        if !line.name.is_empty() {
            let none = LineSeries::new(std::iter::empty::<(f64, f64)>(), style);
            chart.draw_series(none)?.label(line.name.clone()).legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
        }
    }
    if panel.lines.iter().any(|line| !line.name.is_empty()) {
        chart.configure_series_labels().position(SeriesLabelPosition::UpperRight).border_style(GREY.mix(0.4)).draw()?;
    }
    Ok(())
}
