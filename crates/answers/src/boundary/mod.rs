//! The answers of a search along a key: document, words and tables of a boundary of stability.

mod document;
mod page;
mod tables;
mod words;

use cohaptic_stability::{Boundary, BoundaryOptions, Cell, Family, KeyRange, Kinds, Verdict, VerdictKind};

use crate::words::nominal;
pub use document::document;
pub use page::html;
pub use tables::{crossings_csv, samples_csv};
pub use words::words;

/// A key of a scene, searched for crossings.
#[derive(Clone, Copy, Debug)]
pub struct Searched<'a> {
    /// Title of the scene.
    pub title: &'a str,
    /// The key and the searched range.
    pub range: &'a KeyRange,
    /// Tolerance and limits of the search.
    pub options: BoundaryOptions,
    /// The scene with the key left open.
    pub family: &'a Family,
    /// The crossings and all sampled values.
    pub found: &'a Boundary,
}

impl Searched<'_> {
    /// Returns notes on simplifications behind the radii.
    fn notes(&self) -> Vec<String> {
        nominal(self.found.nominal(), ["of the values looked at is", "of the values looked at are"]).into_iter().collect()
    }

    /// Returns the numbers of sampled values, by the question answered by their verdicts.
    fn kinds(&self) -> Kinds {
        Kinds::of(self.family.criterion(), self.found.known.iter().map(|(_, cell)| cell.is_nominal))
    }

    /// Returns the share of stable values among the sampled values of a kind.
    #[expect(clippy::cast_precision_loss, reason = "far fewer values than 2^52")]
    fn stable_fraction(&self, kind: VerdictKind) -> f64 {
        let criterion = self.family.criterion();
        let of_kind: Vec<&Cell> = self.found.known.iter().map(|(_, cell)| cell).filter(|cell| criterion.kind(cell.is_nominal) == kind).collect();
        // A kind without values has the share 0, and not NaN.
        of_kind.iter().filter(|cell| cell.radius.verdict() == Verdict::Stable).count() as f64 / of_kind.len().max(1) as f64
    }
}
