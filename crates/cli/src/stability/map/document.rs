//! The JSON document of a map.

use serde::Serialize;

use super::{Order, VariantMap, share};

/// What `cohaptic stability map --json` prints.
#[derive(Serialize)]
pub(super) struct Document<'a> {
    title: &'a str,
    x_key: &'a str,
    x_unit: &'a str,
    y_key: &'a str,
    y_unit: &'a str,
    x: &'a [f64],
    y: &'a [f64],
    /// A row for each value of y.
    spectral_radius: &'a [Vec<f64>],
    stable_fraction: f64,
    /// The maps beside the first.
    curves: Vec<Curve<'a>>,
    pub(super) wall_s: f64,
    pub(super) cells_per_s: f64,
    pub(super) cells_computed: usize,
    notes: &'a [&'static str],
    pub(super) files: &'a [String],
}

#[derive(Serialize)]
struct Curve<'a> {
    name: &'a str,
    overrides: &'a [String],
    spectral_radius: &'a [Vec<f64>],
    stable_fraction: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a str>,
}

impl<'a> Document<'a> {
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
            spectral_radius: first.map(|map| map.map.radius.as_slice()).unwrap_or_default(),
            stable_fraction: first.map(VariantMap::stable_fraction).unwrap_or_default(),
            curves: maps.iter().skip(1).map(Curve::new).collect(),
            wall_s,
            cells_per_s: share(cells, 1) / wall_s,
            cells_computed: cells,
            notes: &order.notes,
            files,
        }
    }
}

impl<'a> Curve<'a> {
    fn new(map: &'a VariantMap) -> Self {
        Self {
            name: &map.name,
            overrides: &map.overrides,
            spectral_radius: &map.map.radius,
            stable_fraction: map.stable_fraction(),
            file: map.file.as_deref(),
        }
    }
}
