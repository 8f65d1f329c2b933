//! The picture of a campaign's verdicts: the radius over a key, stable and unstable regions over two keys.

use cohaptic_campaign::Judgement;
use cohaptic_picture::{Axis, Fill, Line, Look, Marker, Panel, Picture};
use cohaptic_stability::{Criterion, Kinds, Verdict};

use super::Sheet;
use super::arranged::{Along, Keys};
use super::panels::{marked, with_cells};
use crate::campaign::judge::{is_nominal, is_spectral};

/// Largest radius in a picture. Larger radii are cut off, because their size tells nothing about the place of a crossing.
const HIGHEST: f64 = 2.0;
/// Legend of radii without the random parts of the links.
const NOMINAL: &str = "nominal: nothing is left to chance";

/// The radii of a campaign, converted to the criterion of the picture. As in a map, a scene without random links counts with the square of the spectral radius
/// among mean-square radii.
struct Radii {
    criterion: Criterion,
    /// Name of the radius; the name of a nominal radius if every verdict is nominal.
    name: &'static str,
    /// Lower and upper end of the axis.
    range: (f64, f64),
    is_cut: bool,
}

/// Draws the picture, without a size.
pub(super) fn picture(sheet: &Sheet<'_>) -> Picture {
    let radii = Radii::of(&sheet.report.judgements);
    let panel = |facet: usize| {
        let panel = match &sheet.arranged.keys {
            Keys::Names(along) => radii.by_name(sheet, along, facet),
            Keys::Line(along) => radii.line(sheet, along, facet),
            Keys::Grid(both) => regions(sheet, (&both.0, &both.1), facet, radii.criterion),
        };
        panel.titled(sheet.arranged.title(sheet.plan, facet, ""))
    };
    let mut picture = sheet.picture();
    if radii.is_cut && !matches!(sheet.arranged.keys, Keys::Grid(..)) {
        picture = picture.note("What goes far beyond 1 is cut off.");
    }
    picture.panels((0..sheet.arranged.facets()).map(panel))
}

impl Radii {
    fn of(judgements: &[Judgement]) -> Self {
        let mean_square = judgements.iter().any(|judgement| judgement.verdict().is_some() && !is_spectral(judgement));
        let criterion = if mean_square { Criterion::MeanSquare } else { Criterion::SpectralRadius };
        let kinds = Kinds::of(criterion, judgements.iter().filter(|judgement| judgement.verdict().is_some()).map(is_nominal));
        let name = kinds.only().unwrap_or_else(|| criterion.kind(false)).radius_name();
        let mut radii = Self { criterion, name, range: (1.0, 1.0), is_cut: false };
        for radius in judgements.iter().filter_map(|judgement| radii.radius(judgement)).collect::<Vec<f64>>() {
            // A radius of NaN stands for an overflow, which is also not drawn.
            radii.is_cut |= radius.is_nan() || radius > HIGHEST;
            if radius.is_finite() {
                radii.range = (radii.range.0.min(radius), radii.range.1.max(radius.min(HIGHEST)));
            }
        }
        // The range always contains 1, because it begins as 1 to 1.
        let margin = (0.05 * (radii.range.1 - radii.range.0)).max(1e-3);
        radii.range = ((radii.range.0 - margin).max(0.0), radii.range.1 + margin);
        radii
    }

    /// Returns the radius by the criterion of the picture; `None` without a verdict.
    fn radius(&self, judgement: &Judgement) -> Option<f64> {
        // The mean-square radius of a scene without random parts is the square of the spectral radius.
        let squared = self.criterion == Criterion::MeanSquare && is_spectral(judgement);
        judgement.verdict().map(|verdict| if squared { verdict.radius * verdict.radius } else { verdict.radius })
    }

    fn axis(&self) -> Axis {
        let (first, rest) = self.name.split_at(1);
        Axis::new(format!("{}{rest}", first.to_uppercase())).range(self.range.0, self.range.1)
    }

    /// Returns, for each value of a key: the value, its radius (NaN without a verdict), and whether the verdict is nominal.
    fn points(&self, sheet: &Sheet<'_>, along: &Along, facet: usize) -> Vec<(f64, f64, bool)> {
        let point = |(at, value): (usize, &f64)| {
            let judgement = sheet.report.judgements.get(sheet.combination(facet, &[at]));
            let radius = judgement.and_then(|judgement| self.radius(judgement)).unwrap_or(f64::NAN);
            (*value, radius, judgement.is_some_and(is_nominal))
        };
        along.values.iter().enumerate().map(point).collect()
    }

    /// Draws the radius over a key of numbers.
    fn line(&self, sheet: &Sheet<'_>, along: &Along, facet: usize) -> Panel {
        let points = self.points(sheet, along, facet);
        let radius = Line::new(points.iter().map(|(x, radius, _)| (*x, *radius)), Look::of(0));
        let panel = Panel::new(along.axis(), self.axis()).with(Line::level(1.0).named("1")).with(marked(radius, along).named(self.name));
        with_nominal(panel, points.iter().filter(|point| point.2).map(|(x, radius, _)| (*x, *radius)).collect())
    }

    /// Draws the radius as a mark per name.
    fn by_name(&self, sheet: &Sheet<'_>, along: &Along, facet: usize) -> Panel {
        let points = self.points(sheet, along, facet);
        let of = |nominal: bool| points.iter().filter(move |point| point.2 == nominal).map(|(y, radius, _)| (*radius, *y)).collect::<Vec<_>>();
        let panel = Panel::new(self.axis(), along.axis()).with(Line::upright(1.0).named("1"));
        with_nominal(panel.with(Line::new(of(false), Look::of(0)).marks_only(Marker::Disc).named(self.name)), of(true))
    }
}

/// Marks the nominal points, if there are any.
fn with_nominal(panel: Panel, points: Vec<(f64, f64)>) -> Panel {
    if points.is_empty() { panel } else { panel.with(Line::new(points, Look::of(1)).marks_only(Marker::Diamond).named(NOMINAL)) }
}

/// Draws the stable and unstable regions over two keys, and the cells without a clear verdict.
fn regions(sheet: &Sheet<'_>, along: (&Along, &Along), facet: usize, criterion: Criterion) -> Panel {
    let judgement = |column: usize, row: usize| sheet.report.judgements.get(sheet.combination(facet, &[column, row]));
    let word = |column: usize, row: usize| judgement(column, row).and_then(Judgement::verdict).map(|verdict| &*verdict.word);
    let is = |verdict: Verdict| move |column: usize, row: usize| word(column, row) == Some(verdict.word());
    // In the mean square, a scene without random links counts with the square of the spectral radius: the mean-square radius of such a scene.
    let verdicts = sheet.report.judgements.iter().filter(|judgement| judgement.verdict().is_some());
    let kinds = Kinds::of(criterion, verdicts.map(is_nominal));
    let panel = Panel::new(along.0.axis(), along.1.axis());
    let stable = kinds.says(Verdict::Stable.word());
    let stable = sheet.law().map_or_else(|| stable.clone(), |law| format!("{stable}: {law}"));
    let panel = with_cells(panel, along, Fill::Tint(0), &stable, is(Verdict::Stable));
    let panel = with_cells(panel, along, Fill::Tint(1), &kinds.says(Verdict::Unstable.word()), is(Verdict::Unstable));
    let unknown = |column: usize, row: usize| is(Verdict::Marginal)(column, row) || is(Verdict::Overflow)(column, row);
    let panel = with_cells(panel, along, Fill::Grey, "cannot be told", unknown);
    let panel = with_cells(panel, along, Fill::BackHatch, "no verdict", |column, row| word(column, row).is_none());
    // This hatching comes last, because it lies over the colour of the verdict.
    with_cells(panel, along, Fill::Hatch, NOMINAL, |column, row| judgement(column, row).is_some_and(is_nominal))
}
