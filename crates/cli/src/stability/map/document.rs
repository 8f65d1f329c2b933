//! The JSON document of a map.

use cohaptic_stability::Criterion;
use serde::Serialize;

use super::{Order, VariantMap, share};
use crate::stability::source;

/// What `cohaptic stability map --json` prints.
#[derive(Serialize)]
pub(super) struct MapDocument<'a> {
    title: &'a str,
    x_key: &'a str,
    x_unit: &'a str,
    y_key: &'a str,
    y_unit: &'a str,
    x: &'a [f64],
    y: &'a [f64],
    #[serde(flatten)]
    radii: Radii<'a>,
    stable_fraction: f64,
    /// The maps beside the first.
    curves: Vec<Curve<'a>>,
    pub(super) wall_s: f64,
    pub(super) cells_per_s: f64,
    pub(super) cells_computed: usize,
    notes: Vec<String>,
    pub(super) files: &'a [String],
}

#[derive(Serialize)]
struct Curve<'a> {
    name: &'a str,
    overrides: &'a [String],
    #[serde(flatten)]
    radii: Radii<'a>,
    stable_fraction: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a str>,
}

/// The radii of a map, under the name of its criterion; a row for each value of y.
#[derive(Default, Serialize)]
struct Radii<'a> {
    criterion: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    spectral_radius: Option<&'a [Vec<f64>]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_square_radius: Option<&'a [Vec<f64>]>,
    /// Which cells leave out what their links leave to chance.
    #[serde(skip_serializing_if = "Option::is_none")]
    nominal: Option<&'a [Vec<bool>]>,
    nominal_cells: usize,
}

impl<'a> Radii<'a> {
    fn new(map: &'a VariantMap) -> Self {
        let radii = Some(map.map.radius.as_slice());
        let is_mean_square = map.criterion == Criterion::MeanSquare;
        Self {
            criterion: map.criterion.word(),
            spectral_radius: radii.filter(|_| !is_mean_square),
            mean_square_radius: radii.filter(|_| is_mean_square),
            nominal: Some(map.map.nominal.as_slice()).filter(|_| is_mean_square),
            nominal_cells: map.nominal_cells(),
        }
    }
}

/// What the radii of the maps leave out.
pub(super) fn notes(maps: &[VariantMap]) -> Vec<String> {
    let cells: usize = maps.iter().map(VariantMap::nominal_cells).sum();
    source::nominal(cells, ["cell is", "cells are"]).into_iter().collect()
}

impl<'a> MapDocument<'a> {
    pub(super) fn new(order: &'a Order, maps: &'a [VariantMap], wall_s: f64, cells: usize, files: &'a [String]) -> Self {
        let first = maps.first();
        let (x, y) = (order.x(), order.y());
        Self {
            title: &order.title,
            x_key: &x.key,
            x_unit: &x.unit,
            y_key: &y.key,
            y_unit: &y.unit,
            x: first.map(|map| map.map.x.as_slice()).unwrap_or_default(),
            y: first.map(|map| map.map.y.as_slice()).unwrap_or_default(),
            radii: first.map(Radii::new).unwrap_or_default(),
            stable_fraction: first.map(VariantMap::stable_fraction).unwrap_or_default(),
            curves: maps.iter().skip(1).map(Curve::new).collect(),
            wall_s,
            cells_per_s: share(cells, 1) / wall_s,
            cells_computed: cells,
            notes: notes(maps),
            files,
        }
    }
}

impl<'a> Curve<'a> {
    fn new(map: &'a VariantMap) -> Self {
        Self { name: &map.name, overrides: &map.overrides, radii: Radii::new(map), stable_fraction: map.stable_fraction(), file: map.file.as_deref() }
    }
}
