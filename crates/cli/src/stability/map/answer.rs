//! Maps as a JSON document and in words, with small pictures.

use std::fmt::Write as _;

use cohaptic_answers::{label, radius_name};
use cohaptic_stability::{Criterion, Verdict};
use cohaptic_units::print::Counted;
use serde::Serialize;

use super::{Order, Speed, VariantMap, glance};
use crate::document_schema::document;
use crate::output::{are, figure};
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

/// More pictures than this do not fit on a screen.
const MOST_PICTURES: usize = 4;

pub(super) fn describe(order: &Order, maps: &[VariantMap], speed: Speed, pictures: bool) -> String {
    let mut text = format!("{}\n", order.title);
    for (number, map) in maps.iter().enumerate() {
        // Writing to a string does not fail.
        let _ = match maps.len() {
            1 => writeln!(text),
            _ => writeln!(text, "\n{}", map.name),
        };
        if pictures && number < MOST_PICTURES {
            let (x, y) = (label(order.x()), label(order.y()));
            let axes = (glance::Axis { label: &x, values: &map.map.x }, glance::Axis { label: &y, values: &map.map.y });
            text.push_str(&glance::draw(&axes.0, &axes.1, |column, row| map.verdicts[row][column] == Verdict::Stable));
        }
        let _ = writeln!(
            text,
            "  {:.2} % of {} stable{}{}",
            100.0 * map.stable_fraction(),
            are(order.grid.columns() * order.grid.rows(), "cell"),
            if map.criterion == Criterion::MeanSquare { " in the mean square" } else { "" },
            least(order, map)
        );
    }
    let _ = writeln!(text, "\n{} computed in {:.3} s: {:.0} a second", Counted(speed.cells, "cell"), speed.wall_s, speed.cells_per_s());
    for note in notes(maps) {
        let _ = writeln!(text, "note: {note}");
    }
    text
}

/// The least radius, and where it is.
fn least(order: &Order, VariantMap { map, criterion, .. }: &VariantMap) -> String {
    let cells = map.y.iter().zip(&map.radius).flat_map(|(y, row)| map.x.iter().zip(row).map(move |(x, radius)| (*radius, *x, *y)));
    let least = cells.filter(|(radius, ..)| radius.is_finite()).min_by(|one, other| one.0.total_cmp(&other.0));
    least.map_or_else(String::new, |(radius, x, y)| {
        format!("; the least {} is {}, at {} and {}", radius_name(*criterion), figure(radius, 6), order.x().text(x), order.y().text(y))
    })
}
