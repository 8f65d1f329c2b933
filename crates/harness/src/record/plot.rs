//! Plots over time as SVG.

use std::path::PathBuf;

use plotters::prelude::*;

use super::band::Bands;
use super::file::PartialFile;
use super::svg::{self, COLOURS, Drawing, DrawingResult};
use crate::record::RecordError;

/// One panel of a plot: curves over time with their names, or without.
pub(crate) struct Panel<'a> {
    pub(crate) title: String,
    pub(crate) unit: &'a str,
    pub(crate) names: &'a [String],
    pub(crate) bands: &'a Bands,
    /// What values are multiplied by before they are shown: 100 to show metres in centimetres.
    pub(crate) scale: f64,
    /// What curves do not exceed in a scene that does not diverge: see [`Bands::range`].
    pub(crate) sane: f64,
    /// Whether values below zero have no meaning, so that the axis begins there.
    pub(crate) not_negative: bool,
}

/// More curves than this are drawn in one colour and not named.
const MOST_NAMED: usize = COLOURS.len();

/// Writes the panels below one another.
pub(crate) fn write(path: PathBuf, panels: &[Panel<'_>]) -> Result<PathBuf, RecordError> {
    let height = 60 + 300 * u32::try_from(panels.len()).unwrap_or(1);
    let svg = svg::document((960, height), |root| draw(root, panels));
    let mut file = PartialFile::create(path)?;
    file.write(svg.as_bytes())?;
    file.finish()
}

fn draw<'a>(root: &Drawing<'a>, panels: &[Panel<'_>]) -> DrawingResult<'a> {
    for (area, panel) in root.split_evenly((panels.len(), 1)).iter().zip(panels) {
        draw_panel(area, panel)?;
    }
    Ok(())
}

fn draw_panel<'a>(area: &Drawing<'a>, panel: &Panel<'_>) -> DrawingResult<'a> {
    let (range, cut) = panel.bands.range(panel.sane);
    let lowest = if panel.not_negative { 0.0 } else { f64::NEG_INFINITY };
    let range = (range.start * panel.scale).max(lowest)..range.end * panel.scale;
    let title = if cut { format!("{} (what goes far beyond is cut off)", panel.title) } else { panel.title.clone() };
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 16))
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..panel.bands.seconds(), range.clone())?;
    chart.configure_mesh().x_desc("t [s]").y_desc(panel.unit).light_line_style(WHITE).draw()?;
    let few = panel.bands.curves() <= MOST_NAMED;
    for curve in 0..panel.bands.curves() {
        let colour = COLOURS.get(curve).copied().filter(|_| few).unwrap_or(COLOURS[0]);
        let style = colour.mix(if few { 0.9 } else { 0.35 }).stroke_width(1);
        for run in visible_runs(panel, curve, &range) {
            chart.draw_series(LineSeries::new(run, style))?;
        }
        if let Some(name) = panel.names.get(curve).filter(|_| few) {
            let empty = LineSeries::new(std::iter::empty::<(f64, f64)>(), style);
            chart.draw_series(empty)?.label(name).legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        }
    }
    if few && !panel.names.is_empty() {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .draw()?;
    }
    Ok(())
}

/// The parts of a curve that lie in the range shown: lowest and highest value of each span, in the order that continues the line.
fn visible_runs(panel: &Panel<'_>, curve: usize, range: &std::ops::Range<f64>) -> Vec<Vec<(f64, f64)>> {
    let mut runs = vec![Vec::new()];
    let mut last = f64::NAN;
    for (t, low, high) in panel.bands.curve(curve) {
        let (low, high) = (low * panel.scale, high * panel.scale);
        if !range.contains(&low) || !range.contains(&high) {
            runs.push(Vec::new());
            continue;
        }
        let run = runs.last_mut().expect("there is always a run");
        let rising = (last - low).abs() <= (last - high).abs() || last.is_nan();
        let (first, second) = if rising { (low, high) } else { (high, low) };
        run.push((t, first));
        if first.to_bits() != second.to_bits() {
            run.push((t, second));
        }
        last = second;
    }
    runs.retain(|run| !run.is_empty());
    runs
}
