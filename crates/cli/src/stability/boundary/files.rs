//! The files of a boundary: the crossings, all values looked at, and a picture of the radius along the key with the crossings marked.

use std::path::Path;

use cohaptic_picture::{Axis, Line, Look, Panel, Size};
use cohaptic_stability::{Boundary, Cell, Criterion, Crossing};
use cohaptic_units::print::csv_field;

use super::Order;
use super::answer::crossing_in_words;
use crate::failure::Failure;
use crate::file::write_into;
use crate::output;
use crate::stability::source;
use crate::stability::source::axis_of;

/// Writes `boundary.csv`, `samples.csv` and `boundary.svg`, and gives their paths.
pub(super) fn write(folder: &Path, order: &Order, found: &Boundary, size: Size) -> Result<Vec<String>, Failure> {
    let files =
        [("boundary.csv", crossings(order, found)), ("samples.csv", samples(order, found)), ("boundary.svg", picture(order, found).size(size).svg())];
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

/// The content of the picture.
struct Picture<'a> {
    title: &'a str,
    /// The axis of the key.
    axis: Axis,
    /// The name of the radius: spectral radius, or mean-square radius.
    radius: &'a str,
    /// From where to where the key was searched.
    range: (f64, f64),
    /// Values of the key, rising, and the radius at each.
    samples: &'a [(f64, f64)],
    /// Where the verdict changes, and in words to what.
    crossings: &'a [(f64, String)],
}

/// A radius above this is cut off: how far beyond 1 it is says nothing about where it crosses.
const HIGHEST: f64 = 2.0;

/// The legend names this many crossings at most.
const MOST_NAMED: usize = 20;

impl Picture<'_> {
    /// The picture, of no size yet.
    fn drawn(&self) -> cohaptic_picture::Picture {
        let finite = || self.samples.iter().map(|(_, radius)| *radius).filter(|radius| radius.is_finite());
        let cut = self.samples.iter().any(|(_, radius)| radius.is_nan() || *radius > HIGHEST);
        let (low, high) = finite().fold((1.0_f64, 1.0_f64), |(low, high), radius| (low.min(radius), high.max(radius)));
        let high = high.min(HIGHEST);
        let margin = (0.05 * (high - low)).max(1e-3);
        let up = Axis::new(begun_large(self.radius)).range((low - margin).max(0.0), high + margin);
        let crossings = self.crossings.iter().enumerate().map(|(number, (value, words))| {
            let line = Line::upright(*value).look(Look::of(1 + number).thin());
            if number < MOST_NAMED { line.named(words) } else { line }
        });
        let panel = Panel::new(self.axis.clone().range(self.range.0, self.range.1), up)
            .with(Line::level(1.0).named("1"))
            .with_all(crossings)
            .with(Line::new(self.samples.iter().copied(), Look::of(0)).named(self.radius));
        let mut picture = cohaptic_picture::Picture::new(self.title).aspect(0.45).panel(panel);
        if cut {
            picture = picture.note("What goes far beyond 1 is cut off.");
        }
        if let Some(more @ 1..) = self.crossings.len().checked_sub(MOST_NAMED) {
            picture = picture.note(format!("Crossings are named up to the {MOST_NAMED}th, {more} more are shown without a name."));
        }
        picture
    }
}

fn begun_large(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use cohaptic_picture::testing::faults;

    use super::*;

    fn picture(samples: &[(f64, f64)], crossings: &[(f64, String)]) -> String {
        let axis = Axis::new("Delay of links").symbol("T_d").unit("ms");
        Picture { title: "Two users", axis, radius: "mean-square radius", range: (0.0, 5.0), samples, crossings }.drawn().svg()
    }

    #[test]
    fn what_lies_above_the_picture_is_cut_off_and_parts_the_curve() {
        let svg = picture(&[(0.0, 0.5), (1.0, 0.9), (2.0, 3.0), (3.0, f64::NAN), (4.0, f64::INFINITY), (4.5, 0.8), (5.0, 0.9)], &[]);
        assert_eq!(faults(&svg), [""; 0]);
        assert!(svg.contains("<desc>What goes far beyond 1 is cut off. Mean-square radius over Delay of links\u{a0}Td [ms].</desc>"), "{svg}");
        let curve = svg.lines().find(|line| line.starts_with("<path class=\"line s0\"") && line.matches('M').count() > 1);
        assert!(curve.is_some_and(|curve| curve.matches('M').count() == 2), "{svg}");
    }

    #[test]
    fn a_picture_with_many_crossings_says_how_many_have_no_name() {
        let crossings: Vec<(f64, String)> = (0..25).map(|n| (0.2 * f64::from(n), format!("stable from link.delay={n}ms"))).collect();
        let svg = picture(&[(0.0, 0.9), (5.0, 1.1)], &crossings);
        assert_eq!(faults(&svg), [""; 0]);
        assert!(svg.contains("5 more are shown without a name") && !svg.contains("cut off"), "{svg}");
        assert!(svg.contains("delay=19ms") && !svg.contains("delay=20ms"));
    }
}
