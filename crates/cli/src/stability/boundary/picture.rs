//! The spectral radius along a key as SVG, with the crossings marked.

use cohaptic_harness::record::svg;
use plotters::prelude::*;

use crate::lines::{Look, Sample, draw_legend, draw_line, legend_height};

/// What is shown.
pub(super) struct Picture<'a> {
    pub(super) title: &'a str,
    /// What the radius is called.
    pub(super) radius: &'a str,
    /// The key and its unit.
    pub(super) label: &'a str,
    /// From where to where the key was searched.
    pub(super) range: (f64, f64),
    /// Values of the key, rising, and the spectral radius at each.
    pub(super) samples: &'a [(f64, f64)],
    /// Where the verdict changes, and in words to what.
    pub(super) crossings: &'a [(f64, String)],
}

const SIZE: (u32, u32) = (960, 500);

/// A radius above this is cut off: how far beyond 1 it is says nothing about where it crosses.
const HIGHEST: f64 = 2.0;

impl Picture<'_> {
    /// The document.
    pub(super) fn svg(&self) -> String {
        let finite = || self.samples.iter().map(|(_, radius)| *radius).filter(|radius| radius.is_finite());
        let cut = self.samples.iter().any(|(_, radius)| radius.is_nan() || *radius > HIGHEST);
        let (low, high) = finite().fold((1.0_f64, 1.0_f64), |(low, high), radius| (low.min(radius), high.max(radius)));
        let high = high.min(HIGHEST);
        let margin = (0.05 * (high - low)).max(1e-3);
        let range = (low - margin).max(0.0)..high + margin;
        let title = if cut { format!("{} (what goes far beyond is cut off)", self.title) } else { self.title.to_owned() };
        let mut entries = vec![(Sample::Line(RADIUS), self.radius.to_owned()), (Sample::Line(Look::grey()), "1".to_owned())];
        entries.extend(self.crossings.iter().map(|(_, words)| (Sample::Line(crossing()), words.clone())));
        let entries = &entries[..entries.len().min(MOST_ENTRIES)];
        svg::document((SIZE.0, SIZE.1 + legend_height(entries.len())), |root| {
            let (area, legend) = root.split_vertically(SIZE.1);
            let mut chart = ChartBuilder::on(&area)
                .caption(title, ("sans-serif", 16))
                .margin(12)
                .x_label_area_size(40)
                .y_label_area_size(68)
                .build_cartesian_2d(self.range.0..self.range.1, range.clone())?;
            chart.configure_mesh().x_desc(self.label).y_desc(self.radius).light_line_style(TRANSPARENT).draw()?;
            draw_line(&mut chart, &[(self.range.0, 1.0), (self.range.1, 1.0)], Look::grey())?;
            for (value, _) in self.crossings {
                draw_line(&mut chart, &[(*value, range.start), (*value, range.end)], crossing())?;
            }
            for run in visible_runs(self.samples, range.end) {
                draw_line(&mut chart, &run, RADIUS)?;
            }
            draw_legend(&legend, entries)
        })
    }
}

/// The legend names this many lines at most.
const MOST_ENTRIES: usize = 22;

const RADIUS: Look = Look::solid();

fn crossing() -> Look {
    Look::of(1)
}

/// The parts of the curve that lie in the picture.
fn visible_runs(samples: &[(f64, f64)], top: f64) -> Vec<Vec<(f64, f64)>> {
    let visible = |sample: &(f64, f64)| sample.1 <= top;
    samples.chunk_by(|one, other| visible(one) && visible(other)).filter(|run| run.iter().all(visible)).map(<[_]>::to_vec).collect()
}

#[cfg(test)]
mod tests {
    use super::visible_runs;

    #[test]
    fn what_lies_above_the_picture_parts_the_curve() {
        let samples = [(0.0, 0.5), (1.0, 0.9), (2.0, 3.0), (3.0, f64::NAN), (4.0, f64::INFINITY), (5.0, 0.8)];
        assert_eq!(visible_runs(&samples, 1.5), [vec![(0.0, 0.5), (1.0, 0.9)], vec![(5.0, 0.8)]]);
    }
}
