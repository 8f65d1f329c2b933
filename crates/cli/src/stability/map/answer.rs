//! Maps as a JSON document and in words, with small pictures.

use std::fmt::Write as _;

use cohaptic_answers::label;
use cohaptic_stability::{Criterion, Verdict, VerdictKind, nominal_head};
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
            #[serde(flatten)]
            shares: shares(map),
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
        #[serde(flatten)]
        shares: first.map(shares),
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

/// The shares of stable cells: of all, and of those whose verdicts answer the same question.
fn shares(map: &VariantMap) -> impl Serialize + use<> {
    let kinds = map.kinds().present().map(|(kind, count)| source::judged(kind, count, map.stable_fraction_of(kind)));
    document! {
        stable_fraction: map.stable_fraction(),
        verdicts: kinds.collect::<Vec<_>>(),
        // Random parts of the links that nominal cells leave out; empty where there are none.
        left_out: if map.nominal_cells() > 0 { map.left_out.clone() } else { Vec::new() },
    }
}

/// The omissions of the radii of the maps.
pub(super) fn notes(maps: &[VariantMap]) -> Vec<String> {
    let cells: usize = maps.iter().map(VariantMap::nominal_cells).sum();
    cohaptic_answers::nominal(cells, ["cell is", "cells are"]).into_iter().collect()
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
        text.push_str(&headline(order, map));
    }
    let _ = writeln!(text, "\n{} computed in {:.3} s: {:.0} a second", Counted(speed.cells, "cell"), speed.wall_s, speed.cells_per_s());
    for note in notes(maps) {
        let _ = writeln!(text, "note: {note}");
    }
    text
}

/// The share of stable cells, a line for each question that verdicts answer: a share over cells of several kinds would answer none.
fn headline(order: &Order, map: &VariantMap) -> String {
    let is_mixed = map.kinds().only().is_none();
    let line = |(kind, count): (VerdictKind, usize)| {
        let cells = if is_mixed { format!("{} judged {} {}", Counted(count, "cell"), kind.manner(), verb(count)) } else { are(count, "cell") };
        let head = if kind == VerdictKind::Nominal { format!("{}: ", nominal_head(&map.left_out)) } else { String::new() };
        format!("  {head}{:.2} % of {cells} {}{}\n", 100.0 * map.stable_fraction_of(kind), kind.says("stable"), least(order, map, kind))
    };
    map.kinds().present().map(line).collect()
}

const fn verb(count: usize) -> &'static str {
    if count == 1 { "is" } else { "are" }
}

/// The least radius of the cells of a kind, and where it is.
fn least(order: &Order, VariantMap { map, criterion, .. }: &VariantMap, kind: VerdictKind) -> String {
    let rows = map.y.iter().zip(map.radius.iter().zip(&map.nominal));
    let cells =
        rows.flat_map(|(y, (row, nominal))| map.x.iter().zip(row.iter().zip(nominal)).map(move |(x, (radius, nominal))| (*radius, *x, *y, *nominal)));
    let of_kind = cells.filter(|(radius, _, _, nominal)| radius.is_finite() && criterion.kind(*nominal) == kind);
    let least = of_kind.min_by(|one, other| one.0.total_cmp(&other.0));
    least.map_or_else(String::new, |(radius, x, y, _)| {
        format!("; the least {} is {}, at {} and {}", kind.radius_name(), figure(radius, 6), order.x().text(x), order.y().text(y))
    })
}
