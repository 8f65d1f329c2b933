//! The picture of a boundary: the radius along a key, with marked crossings.

use cohaptic_picture::{Axis, Line, Look, Marker, Panel};
use cohaptic_stability::{Boundary, Criterion, Crossing, KeyRange, Kinds, nominal_head};
use cohaptic_units::print::six_digits;

use super::axis::axis_of;

/// Draws a boundary along a key. `left_out`: the random parts of the links left out by nominal values, in words.
#[must_use]
pub fn boundary_picture(title: &str, range: &KeyRange, criterion: Criterion, left_out: &[&str], found: &Boundary) -> cohaptic_picture::Picture {
    let samples: Vec<(f64, f64)> = found.known.iter().map(|(value, cell)| (*value, cell.radius.value)).collect();
    // Six digits suffice in a legend; `samples.csv` has all digits.
    let named = |crossing: &Crossing| crossing_in_words(range, &Crossing { value: six_digits(crossing.value), ..*crossing });
    let crossings: Vec<(f64, String)> = found.crossings.iter().map(|crossing| (crossing.value, named(crossing))).collect();
    let kinds = Kinds::of(criterion, found.known.iter().map(|(_, cell)| cell.is_nominal));
    let nominal: Vec<(f64, f64)> = found.known.iter().filter(|(_, cell)| cell.is_nominal).map(|(value, cell)| (*value, cell.radius.value)).collect();
    let picture = Picture {
        title,
        axis: axis_of(range),
        // With values of several kinds, marks show the nominal values. With one kind only, the name of the curve tells the kind.
        radius: kinds.only().unwrap_or_else(|| criterion.kind(false)).radius_name(),
        nominal: (&nominal, &nominal_head(left_out)),
        range: (range.low, range.high),
        samples: &samples,
        crossings: &crossings,
    };
    picture.drawn()
}

/// Returns the change at a crossing: `unstable from link.delay=54ms (before: stable)`.
pub(crate) fn crossing_in_words(range: &KeyRange, crossing: &Crossing) -> String {
    format!("{} from {} (before: {})", crossing.to.word(), range.text(crossing.value), crossing.from.word())
}

/// Content of the picture.
struct Picture<'a> {
    title: &'a str,
    /// Axis of the key.
    axis: Axis,
    /// Name of the radius, such as spectral radius or mean-square radius.
    radius: &'a str,
    /// Nominal values of the key with the radii, and the name of the nominal values in the legend.
    nominal: (&'a [(f64, f64)], &'a str),
    /// Lower and upper end of the searched range.
    range: (f64, f64),
    /// Values of the key in rising order, each with the radius.
    samples: &'a [(f64, f64)],
    /// Values of the key at crossings, each with its description.
    crossings: &'a [(f64, String)],
}

/// Largest radius in a picture. Larger radii are cut off, because their size tells nothing about the place of a crossing.
const HIGHEST: f64 = 2.0;

/// Greatest number of crossings named in the legend.
const MOST_NAMED: usize = 20;

impl Picture<'_> {
    /// Draws the picture, without a size.
    fn drawn(&self) -> cohaptic_picture::Picture {
        let finite = || self.samples.iter().map(|(_, radius)| *radius).filter(|radius| radius.is_finite());
        // NaN stands for an overflow, whose radius is beyond the picture in any case.
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
        let panel = match self.nominal {
            ([], _) => panel,
            (points, name) => panel.with(Line::new(points.iter().copied(), Look::of(1)).marks_only(Marker::Diamond).named(name)),
        };
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
        Picture { title: "Two users", axis, radius: "mean-square radius", nominal: (&[], ""), range: (0.0, 5.0), samples, crossings }.drawn().svg()
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
