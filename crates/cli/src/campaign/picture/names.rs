//! Quantiles for each of several names, beneath each other.

use cohaptic_picture::{Axis, Fill, Line, Look, Marker, Panel, Region};

use super::arranged::Along;
use super::scale::Scale;
use super::{SHARE, Sheet};

/// How far the bars of 90 % and 50 %, and the mark of the median, reach to both sides of the middle of their row.
const HALVES: [f64; 3] = [0.12, 0.26, 0.34];

/// Bars of 90 % and 50 % of the runs, and the median.
pub(super) fn quantiles(sheet: &Sheet<'_>, along: &Along, facet: usize, scale: &Scale) -> Panel {
    let rows = along.values.iter().enumerate();
    let known: Vec<_> = rows.filter_map(|(at, y)| Some((*y, sheet.quantiles_of(sheet.combination(facet, &[at]))?))).collect();
    let bars = |half: f64, ends: fn(&cohaptic_campaign::Quantiles) -> (f64, f64)| -> Vec<Vec<(f64, f64)>> {
        let bar = |(y, quantiles): &(f64, _)| {
            let (low, high) = ends(quantiles);
            let (low, high) = (scale.value(low), scale.value(high));
            vec![(low, y - half), (high, y - half), (high, y + half), (low, y + half)]
        };
        known.iter().map(bar).collect()
    };
    let [wide, deep, mark] = HALVES;
    let median = |(y, quantiles): &(f64, cohaptic_campaign::Quantiles)| {
        let x = scale.value(quantiles.median);
        [(x, y - mark), (x, y + mark)]
    };
    let panel = Panel::new(scale.axis(), along.axis());
    let medians = Line::runs(known.iter().map(median), Look::of(0));
    if sheet.plan.runs_of_each() == 1 {
        return panel.with(medians);
    }
    panel
        .with(Region::new(bars(wide, |of| (of.p5, of.p95)), Fill::Tint(0)).named("90 % of the runs"))
        .with(Region::new(bars(deep, |of| (of.p25, of.p75)), Fill::Deep(0)).named("50 % of the runs"))
        .with(medians.named("median"))
}

/// Which share of the runs diverged.
pub(super) fn shares(sheet: &Sheet<'_>, along: &Along, facet: usize) -> Panel {
    let points = along.values.iter().enumerate().map(|(at, y)| (sheet.share(sheet.combination(facet, &[at])), *y));
    Panel::new(Axis::new(SHARE).range(0.0, 1.0), along.axis()).with(Line::new(points, Look::of(1)).marks_only(Marker::Square).named("diverged"))
}
