//! Heat maps over two keys of numbers.

use cohaptic_picture::{Axis, Fill, HeatMap, Panel, Region};

use super::arranged::Along;
use super::scale::Scale;
use super::{SHARE, Sheet};

/// The median of each cell.
pub(super) fn medians(sheet: &Sheet<'_>, (x, y): (&Along, &Along), facet: usize, scale: &Scale) -> Panel {
    let known = |column: usize, row: usize| sheet.quantiles_of(sheet.combination(facet, &[column, row]));
    let value = |column: usize, row: usize| known(column, row).map_or(f64::NAN, |quantiles| scale.value(quantiles.median));
    let panel = heat_map((x, y), scale.axis_of_medians(), value);
    let is_diverged = |column: usize, row: usize| known(column, row).is_none();
    with_cells(panel, (x, y), Fill::BackHatch, "all runs diverged", is_diverged)
}

/// Which share of the runs of each cell diverged.
pub(super) fn shares(sheet: &Sheet<'_>, (x, y): (&Along, &Along), facet: usize) -> Panel {
    heat_map((x, y), Axis::new(SHARE).range(0.0, 1.0), |column, row| sheet.share(sheet.combination(facet, &[column, row])))
}

fn heat_map((x, y): (&Along, &Along), axis: Axis, value: impl Fn(usize, usize) -> f64) -> Panel {
    let values = (0..y.values.len()).map(|row| (0..x.values.len()).map(|column| value(column, row)).collect()).collect();
    Panel::new(x.axis(), y.axis()).with(HeatMap::between(x.edges(), y.edges(), values, axis))
}

/// With those cells filled for which something holds, if there are any.
pub(super) fn with_cells(panel: Panel, (x, y): (&Along, &Along), fill: Fill, name: &str, holds: impl Fn(usize, usize) -> bool) -> Panel {
    let any = (0..x.values.len()).any(|column| (0..y.values.len()).any(|row| holds(column, row)));
    if any { panel.with(Region::between(&x.edges(), &y.edges(), fill, holds).named(name)) } else { panel }
}
