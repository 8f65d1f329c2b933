//! A map in words, with a small picture.

use std::fmt::Write as _;

use cohaptic_stability::{Criterion, Verdict};

use cohaptic_units::print::Counted;

use super::document::{MapDocument, notes};
use super::{Order, VariantMap, glance};
use crate::output::{are, figure};
use crate::stability::quantity::label;
use crate::stability::source;

/// More pictures than this do not fit on a screen.
const MOST_PICTURES: usize = 4;

pub(super) fn describe(order: &Order, maps: &[VariantMap], document: &MapDocument<'_>, pictures: bool) -> String {
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
    let _ =
        writeln!(text, "\n{} computed in {:.3} s: {:.0} a second", Counted(document.cells_computed, "cell"), document.wall_s, document.cells_per_s);
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
        format!("; the least {} is {}, at {} and {}", source::name(*criterion), figure(radius, 6), order.x().text(x), order.y().text(y))
    })
}
