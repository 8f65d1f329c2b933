//! Quantiles as bands over a key of numbers.

use cohaptic_campaign::Quantiles;
use cohaptic_picture::{Axis, Band, Fill, Line, Look, Marker, Panel};

use super::arranged::Along;
use super::scale::Scale;
use super::{SHARE, Sheet};

/// With no more values than this, each is marked.
const MOST_MARKED: usize = 60;

/// The median and the bands around it.
pub(super) fn quantiles(sheet: &Sheet<'_>, along: &Along, facet: usize, scale: &Scale) -> Panel {
    let points: Vec<(f64, Option<Quantiles>)> =
        along.values.iter().enumerate().map(|(at, x)| (*x, sheet.quantiles_of(sheet.combination(facet, &[at])))).collect();
    let curve =
        |of: fn(&Quantiles) -> f64| points.iter().map(move |(x, known)| (*x, known.as_ref().map_or(f64::NAN, |known| scale.value(of(known)))));
    let band = |low: fn(&Quantiles) -> f64, high: fn(&Quantiles) -> f64| curve(low).zip(curve(high)).map(|((x, low), (_, high))| (x, low, high));
    let panel = Panel::new(along.axis(), scale.axis());
    let median = marked(Line::new(curve(|of| of.median), Look::of(0)), along);
    if sheet.plan.runs_of_each() == 1 {
        return panel.with(median);
    }
    panel
        .with(Band::new(band(|of| of.p5, |of| of.p95), Fill::Tint(0)).named("90 % of the runs"))
        .with(Band::new(band(|of| of.p25, |of| of.p75), Fill::Deep(0)).named("50 % of the runs"))
        .with(median.named("median"))
}

/// Which share of the runs diverged.
pub(super) fn shares(sheet: &Sheet<'_>, along: &Along, facet: usize) -> Panel {
    let points = along.values.iter().enumerate().map(|(at, x)| (*x, sheet.share(sheet.combination(facet, &[at]))));
    Panel::new(along.axis(), Axis::new(SHARE).range(0.0, 1.0)).with(marked(Line::new(points, Look::of(1)), along).named("diverged"))
}

/// With its points marked, unless marks would hide the line.
pub(super) fn marked(line: Line, along: &Along) -> Line {
    if along.values.len() <= MOST_MARKED { line.marked(Marker::Disc) } else { line }
}
