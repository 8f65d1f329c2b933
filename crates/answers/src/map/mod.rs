//! The answers about maps over two keys: document, words and tables.

mod document;
mod glance;
mod page;
mod words;

use cohaptic_stability::{Criterion, KeyRange, Kinds, Map, Verdict, VerdictKind};
use cohaptic_units::print::csv_field;

use crate::legend_name;
use crate::words::nominal;
pub use document::document;
pub use page::html;
pub use words::words;

/// Maps of a scene over the same keys.
#[derive(Clone, Copy, Debug)]
pub struct Filled<'a> {
    /// Title of the scene.
    pub title: &'a str,
    /// The keys along x and y.
    pub axes: [&'a KeyRange; 2],
    /// The map of the scene as it stands, followed by the maps of the variants.
    pub maps: &'a [VariantMap],
}

/// The map of a variant of a scene.
#[derive(Clone, Debug)]
pub struct VariantMap {
    /// Name of the variant in documents: the overrides, or "as it stands" for the scene as it stands.
    pub name: String,
    /// Name of the coordination law, such as `average-position`.
    pub law: String,
    /// Overrides of the variant, on top of the scene.
    pub overrides: Vec<String>,
    /// The radii, indexed by row and column, with the values of both keys.
    pub map: Map,
    /// Radius by which the map is judged.
    pub criterion: Criterion,
    /// Random parts of the links left out by nominal cells, in words.
    pub left_out: Vec<&'static str>,
    /// Verdicts, indexed by row and column.
    pub verdicts: Vec<Vec<Verdict>>,
    /// Path of the written table, if any.
    pub file: Option<String>,
}

/// Speed of the computation of the maps.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Speed {
    /// Wall time \[s\].
    pub wall_s: f64,
    /// Number of cells computed by this call.
    pub cells: usize,
}

impl Speed {
    fn cells_per_s(self) -> f64 {
        share(self.cells, 1) / self.wall_s
    }
}

impl Filled<'_> {
    /// Returns notes on simplifications behind the radii of the maps.
    fn notes(&self) -> Vec<String> {
        let cells: usize = self.maps.iter().map(VariantMap::nominal_cells).sum();
        nominal(cells, ["cell is", "cells are"]).into_iter().collect()
    }
}

impl VariantMap {
    /// Returns the name of the variant in a legend: law and overrides.
    #[must_use]
    pub fn legend(&self) -> String {
        legend_name(&self.law, &self.overrides)
    }

    /// Returns the number of nominal cells, which leave random parts of the links out.
    fn nominal_cells(&self) -> usize {
        self.map.nominal.iter().flatten().filter(|nominal| **nominal).count()
    }

    /// Returns the numbers of cells, by the question answered by their verdicts.
    fn kinds(&self) -> Kinds {
        Kinds::of(self.criterion, self.map.nominal.iter().flatten().copied())
    }

    /// Returns the verdicts of the cells of a kind.
    fn verdicts_of(&self, kind: VerdictKind) -> impl Iterator<Item = Verdict> {
        let all = self.verdicts.iter().flatten().zip(self.map.nominal.iter().flatten());
        all.filter(move |(_, nominal)| self.criterion.kind(**nominal) == kind).map(|(verdict, _)| *verdict)
    }

    /// Returns the share of stable cells among the cells of a kind.
    fn stable_fraction_of(&self, kind: VerdictKind) -> f64 {
        share(self.verdicts_of(kind).filter(|verdict| *verdict == Verdict::Stable).count(), self.verdicts_of(kind).count())
    }

    /// Returns the least finite radius of the cells of a kind, with the values of x and y there; `None` if no radius is finite.
    fn least(&self, kind: VerdictKind) -> Option<[f64; 3]> {
        let rows = self.map.y.iter().zip(self.map.radius.iter().zip(&self.map.nominal));
        let cells = rows.flat_map(|(y, (row, nominal))| self.map.x.iter().zip(row.iter().zip(nominal)).map(move |(x, cell)| (*x, *y, cell)));
        // The radii of an overflow are not finite and have no least.
        let of_kind = cells.filter(|(_, _, (radius, nominal))| radius.is_finite() && self.criterion.kind(**nominal) == kind);
        let least = of_kind.min_by(|(_, _, (one, _)), (_, _, (other, _))| one.total_cmp(other));
        least.map(|(x, y, (radius, _))| [*radius, x, y])
    }

    /// Returns the share of stable cells among all cells.
    fn stable_fraction(&self) -> f64 {
        let cells = || self.verdicts.iter().flatten();
        share(cells().filter(|verdict| **verdict == Verdict::Stable).count(), cells().count())
    }
}

#[expect(clippy::cast_precision_loss, reason = "far fewer cells than 2^52")]
fn share(part: usize, whole: usize) -> f64 {
    // A map without cells has no share: the least divisor keeps NaN out of documents.
    part as f64 / whole.max(1) as f64
}

/// Returns `map.csv`: a row per cell; x varies fastest.
#[must_use]
pub fn csv([x, y]: [&KeyRange; 2], VariantMap { map, criterion, verdicts, .. }: &VariantMap) -> String {
    let keys = format!("{},{}", csv_field(&x.key), csv_field(&y.key));
    let mut text = match criterion {
        Criterion::SpectralRadius => format!("{keys},spectral_radius,verdict\n"),
        // Under the mean square cells are of two kinds, so the column `judged` tells the kind.
        Criterion::MeanSquare => format!("{keys},mean_square_radius,verdict,judged\n"),
    };
    for (((y, row), verdicts), nominal) in map.y.iter().zip(&map.radius).zip(verdicts).zip(&map.nominal) {
        for (((x, radius), verdict), nominal) in map.x.iter().zip(row).zip(verdicts).zip(nominal) {
            // `:?` writes the fewest digits that read back as the same number.
            text.push_str(&format!("{x:?},{y:?},{radius:?},{}", verdict.word()));
            if *criterion == Criterion::MeanSquare {
                text.push_str(&format!(",{}", criterion.kind(*nominal).word()));
            }
            text.push('\n');
        }
    }
    text
}
