//! What searches along a key answer: the document, the words and the tables of a boundary.

mod document;
mod tables;
mod words;

use cohaptic_stability::{Boundary, BoundaryOptions, Cell, Family, KeyRange, Kinds, Verdict, VerdictKind};

use crate::nominal;
pub use document::document;
pub use tables::{crossings_csv, samples_csv};
pub use words::words;

/// A key of a scene that was searched for crossings.
#[derive(Clone, Copy, Debug)]
pub struct Searched<'a> {
    /// The title of the scene.
    pub title: &'a str,
    /// The key, and from where to where it was searched.
    pub range: &'a KeyRange,
    /// How closely it was searched.
    pub options: BoundaryOptions,
    /// The scene with the key left open.
    pub family: &'a Family,
    /// The crossings, and all values that were looked at.
    pub found: &'a Boundary,
}

impl Searched<'_> {
    /// Returns what the radii leave out.
    fn notes(&self) -> Vec<String> {
        nominal(self.found.nominal(), ["of the values looked at is", "of the values looked at are"]).into_iter().collect()
    }

    /// Returns the numbers of values looked at, by the question that their verdicts answer.
    fn kinds(&self) -> Kinds {
        Kinds::of(self.family.criterion(), self.found.known.iter().map(|(_, cell)| cell.is_nominal))
    }

    /// Returns the share of stable values among those of a kind.
    #[expect(clippy::cast_precision_loss, reason = "far fewer values than 2^52")]
    fn stable_fraction(&self, kind: VerdictKind) -> f64 {
        let criterion = self.family.criterion();
        let of_kind: Vec<&Cell> = self.found.known.iter().map(|(_, cell)| cell).filter(|cell| criterion.kind(cell.is_nominal) == kind).collect();
        of_kind.iter().filter(|cell| cell.radius.verdict() == Verdict::Stable).count() as f64 / of_kind.len().max(1) as f64
    }
}
