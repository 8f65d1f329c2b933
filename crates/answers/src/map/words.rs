//! The text about maps, with small pictures.

use std::fmt::Write as _;

use cohaptic_stability::{KeyRange, Verdict, VerdictKind, nominal_head};
use cohaptic_units::print::Counted;

use super::{Filled, Speed, VariantMap, glance};
use crate::{are, figure, label};

/// Greatest number of pictures in the text, as many as fit on a screen.
const MOST_PICTURES: usize = 4;

/// Returns the text about maps. `pictures`: whether the text contains small pictures of the maps.
#[must_use]
pub fn words(filled: &Filled<'_>, speed: Speed, pictures: bool) -> String {
    let Filled { title, axes, maps } = *filled;
    let mut text = format!("{title}\n");
    for (number, map) in maps.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = match maps.len() {
            1 => writeln!(text),
            _ => writeln!(text, "\n{}", map.legend()),
        };
        if pictures && number < MOST_PICTURES {
            let (x, y) = (label(axes[0]), label(axes[1]));
            let shown = (glance::Axis { label: &x, values: &map.map.x }, glance::Axis { label: &y, values: &map.map.y });
            text.push_str(&glance::draw(&shown.0, &shown.1, |column, row| map.verdicts[row][column] == Verdict::Stable));
            let _ = writeln!(text, "  {} {}: {}", glance::FULL, map.kinds().says("stable"), map.legend());
        }
        headlines(axes, map, |value| value).iter().for_each(|line| text.push_str(&format!("  {line}\n")));
    }
    let _ = writeln!(text, "\n{} computed in {:.3} s: {:.0} per second", Counted(speed.cells, "cell"), speed.wall_s, speed.cells_per_s());
    for note in filled.notes() {
        let _ = writeln!(text, "note: {note}");
    }
    text
}

/// Returns a line with the share of stable cells per kind of verdict. A share over cells of several kinds would answer no question.
/// `rounded` rounds the values of the keys.
pub(super) fn headlines(axes: [&KeyRange; 2], map: &VariantMap, rounded: fn(f64) -> f64) -> Vec<String> {
    let is_mixed = map.kinds().only().is_none();
    let line = |(kind, count): (VerdictKind, usize)| {
        let cells = if is_mixed { format!("{} judged {} {}", Counted(count, "cell"), kind.manner(), verb(count)) } else { are(count, "cell") };
        let head = if kind == VerdictKind::Nominal { format!("{}: ", nominal_head(&map.left_out)) } else { String::new() };
        format!("{head}{:.2} % of {cells} {}{}", 100.0 * map.stable_fraction_of(kind), kind.says("stable"), least(axes, map, kind, rounded))
    };
    map.kinds().present().map(line).collect()
}

const fn verb(count: usize) -> &'static str {
    if count == 1 { "is" } else { "are" }
}

/// Returns the least radius of the cells of a kind and its place, in words; empty if no radius is finite.
fn least([x_range, y_range]: [&KeyRange; 2], map: &VariantMap, kind: VerdictKind, rounded: fn(f64) -> f64) -> String {
    map.least(kind).map_or_else(String::new, |[radius, x, y]| {
        format!("; the least {} is {}, at {} and {}", kind.radius_name(), figure(radius, 6), x_range.text(rounded(x)), y_range.text(rounded(y)))
    })
}
