//! The files of a boundary: the crossings, all values looked at, and a picture of the radius along the key with the crossings marked.

use std::path::Path;

use cohaptic_answers::boundary_picture;
use cohaptic_picture::Size;
use cohaptic_stability::{Boundary, Cell, Criterion};
use cohaptic_units::print::csv_field;

use super::Order;
use crate::failure::Failure;
use crate::file::write_into;

/// Writes `boundary.csv`, `samples.csv` and `boundary.svg`, and gives their paths.
pub(super) fn write(folder: &Path, order: &Order, found: &Boundary, size: Size) -> Result<Vec<String>, Failure> {
    let picture = boundary_picture(&order.title, &order.range, order.family.criterion(), order.family.left_out(), found);
    let files = [("boundary.csv", crossings(order, found)), ("samples.csv", samples(order, found)), ("boundary.svg", picture.size(size).svg())];
    files.into_iter().map(|(name, content)| write_into(folder, name, content)).collect()
}

fn crossings(order: &Order, found: &Boundary) -> String {
    let mut text = format!("{},from,to\n", csv_field(&order.range.key));
    for crossing in &found.crossings {
        text.push_str(&format!("{:?},{},{}\n", crossing.value, crossing.from.word(), crossing.to.word()));
    }
    text
}

fn samples(order: &Order, found: &Boundary) -> String {
    let is_mean_square = order.family.criterion() == Criterion::MeanSquare;
    let columns = if is_mean_square { "mean_square_radius,error_bound,verdict,judged" } else { "spectral_radius,error_bound,verdict" };
    let mut text = format!("{},{columns}\n", csv_field(&order.range.key));
    for (value, Cell { radius, is_nominal }) in &found.known {
        text.push_str(&format!("{value:?},{:?},{:?},{}", radius.value, radius.error, radius.verdict().word()));
        if is_mean_square {
            text.push_str(&format!(",{}", Criterion::MeanSquare.kind(*is_nominal).word()));
        }
        text.push('\n');
    }
    text
}
