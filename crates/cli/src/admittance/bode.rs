//! The Bode plot: magnitude over phase, over a logarithmic frequency, beside free masses (as Rakhsha & Constantinescu 2015, Figure 5).

use cohaptic_harness::record::svg::{self, Drawing, DrawingResult};
use cohaptic_stability::Verdict;
use plotters::prelude::*;

use super::axes::{Decades, Steps};
use super::curve::Curve;
use crate::failure::Failure;
use crate::lines::{Look, Sample, draw_legend, draw_line, legend_height};

/// Width and height without the legend \[pixels\].
const SIZE: (u32, u32) = (960, 720);

/// A line with its name.
struct Line {
    name: String,
    look: Look,
    magnitudes: Vec<(f64, f64)>,
    phases: Vec<(f64, f64)>,
}

/// The plot as a document.
pub(super) fn svg(peer: &str, curves: &[Curve]) -> Result<String, Failure> {
    let mut lines = masses(curves);
    for (number, curve) in curves.iter().enumerate() {
        lines.push(responded(number, curve)?);
    }
    let entries: Vec<(Sample, String)> = lines.iter().map(|line| (Sample::Line(line.look), line.name.clone())).collect();
    let title = curves.first().map_or("", |curve| curve.title.as_str());
    Ok(svg::document((SIZE.0, SIZE.1 + legend_height(entries.len())), |root| {
        let (plots, legend) = root.split_vertically(SIZE.1);
        let (above, below) = plots.split_vertically(SIZE.1 / 2);
        let magnitudes: Vec<_> = lines.iter().map(|line| (line.magnitudes.as_slice(), line.look)).collect();
        let phases: Vec<_> = lines.iter().map(|line| (line.phases.as_slice(), line.look)).collect();
        panel(&above, &format!("{title}: velocity over force of {peer}"), "dB (m/s per N)", 20.0, &magnitudes)?;
        panel(&below, "Phase", "degrees", 45.0, &phases)?;
        draw_legend(&legend, &entries)
    }))
}

/// Between two points of a line a frequency is this much higher at most: a resonance is round then, and a phase can be followed through its jumps.
const FINEST: f64 = 1.02;

/// The frequencies that were asked for, rising, with so many between them that no two are far apart.
fn filled(curve: &Curve) -> Vec<f64> {
    let mut asked: Vec<f64> = curve.response.points.iter().map(|point| point.hz).collect();
    asked.sort_by(f64::total_cmp);
    let between = |pair: &[f64]| {
        let (low, high) = (pair[0], pair[1]);
        std::iter::successors(Some(low), |hz| Some(hz * FINEST)).take_while(move |hz| *hz < high).collect::<Vec<f64>>()
    };
    asked.windows(2).flat_map(between).chain(asked.last().copied()).collect()
}

fn responded(number: usize, curve: &Curve) -> Result<Line, Failure> {
    let response = curve.admittance.response(&filled(curve)).map_err(|error| Failure::Input(error.to_string()))?;
    let hz = || response.points.iter().map(|point| point.hz);
    Ok(Line {
        name: named(curve),
        look: Look::of(number),
        magnitudes: hz().zip(response.magnitudes_db()).collect(),
        phases: hz().zip(response.phases_deg()).collect(),
    })
}

/// The name, and the verdict where it is no good one: such a curve is nothing that could be measured.
fn named(curve: &Curve) -> String {
    match curve.admittance.verdict() {
        Verdict::Stable => curve.name.clone(),
        verdict @ (Verdict::Marginal | Verdict::Overflow | Verdict::Unstable) => format!("{} ({})", curve.name, verdict.word().to_uppercase()),
    }
}

/// The objects of all curves, as free masses: each mass once.
fn masses(curves: &[Curve]) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    for curve in curves {
        let name = format!("free mass of {} kg", curve.mass);
        if lines.iter().any(|line| line.name == name) {
            continue;
        }
        // Straight over a logarithmic frequency.
        let ends = extent(curve.response.points.iter().map(|point| point.hz))
            .map_or(Vec::new(), |(low, high)| if low < high { vec![low, high] } else { vec![low] });
        let magnitudes = ends.iter().map(|hz| (*hz, curve.ideal_db(*hz))).collect();
        lines.push(Line { name, look: Look::grey(), magnitudes, phases: ends.into_iter().map(|hz| (hz, -90.0)).collect() });
    }
    lines
}

/// One diagram. Its vertical axis ends at multiples of `step`, or of so many of them that there are not too many.
fn panel<'a>(area: &Drawing<'a>, title: &str, unit: &str, step: f64, lines: &[(&[(f64, f64)], Look)]) -> DrawingResult<'a> {
    let shown = || lines.iter().flat_map(|(points, _)| points.iter()).filter(|(_, value)| value.is_finite());
    let frequencies = Decades::of(extent(shown().map(|(hz, _)| *hz)).unwrap_or((1.0, 10.0)));
    let values = Steps::of(extent(shown().map(|(_, value)| *value)).unwrap_or((0.0, 0.0)), step);
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 16))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(68)
        .build_cartesian_2d(frequencies, values)?;
    chart
        .configure_mesh()
        .x_desc("f [Hz]")
        .y_desc(unit)
        .x_label_formatter(&|hz| format!("{hz}"))
        .y_label_formatter(&|value| format!("{value}"))
        .light_line_style(BLACK.mix(0.06))
        .draw()?;
    for (points, look) in lines {
        for run in points.split(|(_, value)| !value.is_finite()) {
            match run {
                [alone] => drop(chart.draw_series([Circle::new(*alone, 3, look.colour().filled())])?),
                run => draw_line(&mut chart, run, *look)?,
            }
        }
    }
    Ok(())
}

fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |found, value| Some(found.map_or((value, value), |(low, high): (f64, f64)| (low.min(value), high.max(value)))))
}
