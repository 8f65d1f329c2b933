//! The JSON document of maps.

use cohaptic_stability::Criterion;
use serde::Serialize;

use super::{Filled, Speed, VariantMap};
use crate::document;
use crate::parts::judged;

/// Returns the answer of `cohaptic stability map --json`. `files`: paths of the written files.
pub fn document(filled: &Filled<'_>, speed: Speed, files: &[String]) -> impl Serialize {
    let Filled { title, axes: [x, y], maps } = *filled;
    let first = maps.first();
    let curves = maps.iter().skip(1).map(|map| {
        document! {
            name: map.name.as_str(),
            overrides: map.overrides.as_slice(),
            #[serde(flatten)]
            radii: radii(map),
            #[serde(flatten)]
            shares: shares(map),
            #[serde(flatten)]
            file: map.file.as_ref().map(|file| document! { file: file }),
        }
    });
    document! {
        title: title,
        x_key: x.key.as_str(),
        x_unit: x.unit.as_str(),
        y_key: y.key.as_str(),
        y_unit: y.unit.as_str(),
        x: first.map(|map| map.map.x.as_slice()).unwrap_or_default(),
        y: first.map(|map| map.map.y.as_slice()).unwrap_or_default(),
        #[serde(flatten)]
        radii: first.map(radii),
        #[serde(flatten)]
        shares: first.map(shares),
        // The maps of the variants.
        curves: curves.collect::<Vec<_>>(),
        wall_s: speed.wall_s,
        cells_per_s: speed.cells_per_s(),
        cells_computed: speed.cells,
        notes: filled.notes(),
        files: files,
    }
}

/// Returns the radii of a map under the name of its criterion, with one row per value of y.
fn radii(map: &VariantMap) -> impl Serialize {
    let is_mean_square = map.criterion == Criterion::MeanSquare;
    document! {
        criterion: map.criterion.word(),
        #[serde(flatten)]
        spectral: (!is_mean_square).then(|| document! { spectral_radius: map.map.radius.as_slice() }),
        #[serde(flatten)]
        mean_square: is_mean_square.then(|| document! {
            mean_square_radius: map.map.radius.as_slice(),
            // Cells which leave random parts of the links out.
            nominal: map.map.nominal.as_slice(),
        }),
        nominal_cells: map.nominal_cells(),
    }
}

/// Returns the shares of stable cells: among all cells, and among the cells of each kind of verdict.
fn shares(map: &VariantMap) -> impl Serialize + use<> {
    let kinds = map.kinds().present().map(|(kind, count)| judged(kind, count, map.stable_fraction_of(kind)));
    document! {
        stable_fraction: map.stable_fraction(),
        verdicts: kinds.collect::<Vec<_>>(),
        // Random parts of the links left out by nominal cells; empty without nominal cells.
        left_out: if map.nominal_cells() > 0 { map.left_out.clone() } else { Vec::new() },
    }
}
