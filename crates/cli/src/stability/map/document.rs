//! The JSON document of a map.

use cohaptic_stability::Criterion;
use serde::Serialize;

use super::{Order, Speed, VariantMap};
use crate::document_schema::document;
use crate::stability::source;

/// The answer of `cohaptic stability map --json`.
pub(super) fn of(order: &Order, maps: &[VariantMap], speed: Speed, files: &[String]) -> impl Serialize {
    let first = maps.first();
    let (x, y) = (order.x(), order.y());
    let curves = maps.iter().skip(1).map(|map| {
        document! {
            name: map.name.as_str(),
            overrides: map.overrides.as_slice(),
            #[serde(flatten)]
            radii: radii(map),
            stable_fraction: map.stable_fraction(),
            #[serde(flatten)]
            file: map.file.as_ref().map(|file| document! { file: file }),
        }
    });
    document! {
        title: order.title.as_str(),
        x_key: x.key.as_str(),
        x_unit: x.unit.as_str(),
        y_key: y.key.as_str(),
        y_unit: y.unit.as_str(),
        x: first.map(|map| map.map.x.as_slice()).unwrap_or_default(),
        y: first.map(|map| map.map.y.as_slice()).unwrap_or_default(),
        #[serde(flatten)]
        radii: first.map(radii),
        stable_fraction: first.map(VariantMap::stable_fraction).unwrap_or_default(),
        // The maps beside the first.
        curves: curves.collect::<Vec<_>>(),
        wall_s: speed.wall_s,
        cells_per_s: speed.cells_per_s(),
        cells_computed: speed.cells,
        notes: notes(maps),
        files: files,
    }
}

/// The radii of a map, under the name of its criterion; a row for each value of y.
fn radii(map: &VariantMap) -> impl Serialize {
    let is_mean_square = map.criterion == Criterion::MeanSquare;
    document! {
        criterion: map.criterion.word(),
        #[serde(flatten)]
        spectral: (!is_mean_square).then(|| document! { spectral_radius: map.map.radius.as_slice() }),
        #[serde(flatten)]
        mean_square: is_mean_square.then(|| document! {
            mean_square_radius: map.map.radius.as_slice(),
            // Which cells leave out what their links leave to chance.
            nominal: map.map.nominal.as_slice(),
        }),
        nominal_cells: map.nominal_cells(),
    }
}

/// The omissions of the radii of the maps.
pub(super) fn notes(maps: &[VariantMap]) -> Vec<String> {
    let cells: usize = maps.iter().map(VariantMap::nominal_cells).sum();
    source::nominal(cells, ["cell is", "cells are"]).into_iter().collect()
}
