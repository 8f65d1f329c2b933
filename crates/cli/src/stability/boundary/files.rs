//! The files of a boundary: the crossings, all values looked at, and a picture.

use std::path::Path;

use cohaptic_picture::Size;
use cohaptic_stability::{Boundary, Cell, Criterion, Crossing};
use cohaptic_units::print::csv_field;

use super::Order;
use super::picture::Picture;
use super::words::crossing_in_words;
use crate::failure::Failure;
use crate::file::write_file;
use crate::output;
use crate::stability::quantity::axis_of;
use crate::stability::source;

/// Writes `boundary.csv`, `samples.csv` and `boundary.svg`, and gives their paths.
pub(super) fn write(folder: &Path, order: &Order, found: &Boundary, size: Size) -> Result<Vec<String>, Failure> {
    let files =
        [("boundary.csv", crossings(order, found)), ("samples.csv", samples(order, found)), ("boundary.svg", picture(order, found).size(size).svg())];
    let mut written = Vec::new();
    for (name, content) in files {
        let path = folder.join(name);
        write_file(&path, &content)?;
        written.push(output::path(&path));
    }
    Ok(written)
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
            text.push_str(&format!(",{}", source::judged(Criterion::MeanSquare, *is_nominal)));
        }
        text.push('\n');
    }
    text
}

fn picture(order: &Order, found: &Boundary) -> cohaptic_picture::Picture {
    let samples: Vec<(f64, f64)> = found.known.iter().map(|(value, cell)| (*value, cell.radius.value)).collect();
    let named = |crossing: &Crossing| crossing_in_words(&order.range, &Crossing { value: output::six_digits(crossing.value), ..*crossing });
    let crossings: Vec<(f64, String)> = found.crossings.iter().map(|crossing| (crossing.value, named(crossing))).collect();
    let picture = Picture {
        title: &order.title,
        axis: axis_of(&order.range),
        radius: source::name(order.family.criterion()),
        range: (order.range.low, order.range.high),
        samples: &samples,
        crossings: &crossings,
    };
    picture.drawn()
}
