//! The panels of a campaign's pictures: bands of quantiles over a key of numbers, heat maps over two keys, bars for a key of names, and shares of diverged
//! runs.

use cohaptic_campaign::Quantiles;
use cohaptic_picture::{Axis, Band, Fill, HeatMap, Line, Look, Marker, Panel, Region};

use super::arranged::Along;
use super::scale::Scale;
use super::{SHARE, Sheet};

/// Greatest number of values whose points are marked on a line.
const MOST_MARKED: usize = 60;

/// Draws the median and the bands of quantiles over a key of numbers.
pub(super) fn quantiles_along(sheet: &Sheet<'_>, along: &Along, facet: usize, scale: &Scale) -> Panel {
    let points: Vec<(f64, Option<Quantiles>)> =
        along.values.iter().enumerate().map(|(at, x)| (*x, sheet.quantiles_of(sheet.combination(facet, &[at])))).collect();
    let curve =
        |of: fn(&Quantiles) -> f64| points.iter().map(move |(x, known)| (*x, known.as_ref().map_or(f64::NAN, |known| scale.value(of(known)))));
    // A combination without quantiles gives NaN, which interrupts lines and bands.
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

/// Draws the share of diverged runs over a key of numbers.
pub(super) fn shares_along(sheet: &Sheet<'_>, along: &Along, facet: usize) -> Panel {
    let points = along.values.iter().enumerate().map(|(at, x)| (*x, sheet.share(sheet.combination(facet, &[at]))));
    Panel::new(along.axis(), Axis::new(SHARE).range(0.0, 1.0)).with(marked(Line::new(points, Look::of(1)), along).named("diverged"))
}

/// Marks the points of a line, unless the marks would hide the line.
pub(super) fn marked(line: Line, along: &Along) -> Line {
    if along.values.len() <= MOST_MARKED { line.marked(Marker::Disc) } else { line }
}

/// Draws the median of each combination of two keys of numbers, and hatches the combinations whose runs all diverged.
pub(super) fn medians_of_cells(sheet: &Sheet<'_>, (x, y): (&Along, &Along), facet: usize, scale: &Scale) -> Panel {
    let known = |column: usize, row: usize| sheet.quantiles_of(sheet.combination(facet, &[column, row]));
    let value = |column: usize, row: usize| known(column, row).map_or(f64::NAN, |quantiles| scale.value(quantiles.median));
    let panel = heat_map((x, y), scale.axis_of_medians(), value);
    let is_diverged = |column: usize, row: usize| known(column, row).is_none();
    with_cells(panel, (x, y), Fill::HatchedTint(1), "all runs diverged", is_diverged)
}

/// Draws the share of diverged runs of each combination of two keys of numbers.
pub(super) fn shares_of_cells(sheet: &Sheet<'_>, (x, y): (&Along, &Along), facet: usize) -> Panel {
    heat_map((x, y), Axis::new(SHARE).range(0.0, 1.0), |column, row| sheet.share(sheet.combination(facet, &[column, row])))
}

fn heat_map((x, y): (&Along, &Along), axis: Axis, value: impl Fn(usize, usize) -> f64) -> Panel {
    let values = (0..y.values.len()).map(|row| (0..x.values.len()).map(|column| value(column, row)).collect()).collect();
    Panel::new(x.axis(), y.axis()).with(HeatMap::between(x.edges(), y.edges(), values, axis))
}

/// Fills the cells for which `holds` is true, and names the filling in the legend. Adds nothing if there are no such cells.
pub(super) fn with_cells(panel: Panel, (x, y): (&Along, &Along), fill: Fill, name: &str, holds: impl Fn(usize, usize) -> bool) -> Panel {
    let any = (0..x.values.len()).any(|column| (0..y.values.len()).any(|row| holds(column, row)));
    // An empty region would still appear in the legend.
    if any { panel.with(Region::between(&x.edges(), &y.edges(), fill, holds).named(name)) } else { panel }
}

/// Half heights, in rows, of the bar of 90 %, the bar of 50 % and the mark of the median.
const HALVES: [f64; 3] = [0.12, 0.26, 0.34];

/// Draws, for each name, the bars of 90 % and 50 % of the runs and the median.
pub(super) fn quantiles_by_name(sheet: &Sheet<'_>, along: &Along, facet: usize, scale: &Scale) -> Panel {
    let rows = along.values.iter().enumerate();
    // A combination whose runs all diverged has no bar.
    let known: Vec<_> = rows.filter_map(|(at, y)| Some((*y, sheet.quantiles_of(sheet.combination(facet, &[at]))?))).collect();
    let bars = |half: f64, ends: fn(&Quantiles) -> (f64, f64)| -> Vec<Vec<(f64, f64)>> {
        let bar = |(y, quantiles): &(f64, _)| {
            let (low, high) = ends(quantiles);
            let (low, high) = (scale.value(low), scale.value(high));
            vec![(low, y - half), (high, y - half), (high, y + half), (low, y + half)]
        };
        known.iter().map(bar).collect()
    };
    let [wide, deep, mark] = HALVES;
    let median = |(y, quantiles): &(f64, Quantiles)| {
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

/// Draws the share of diverged runs for each name.
pub(super) fn shares_by_name(sheet: &Sheet<'_>, along: &Along, facet: usize) -> Panel {
    let points = along.values.iter().enumerate().map(|(at, y)| (sheet.share(sheet.combination(facet, &[at])), *y));
    Panel::new(Axis::new(SHARE).range(0.0, 1.0), along.axis()).with(Line::new(points, Look::of(1)).marks_only(Marker::Square).named("diverged"))
}
