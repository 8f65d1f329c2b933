//! Pieces of a proof whose verdicts are known before the proof begins.

use cohaptic_stability::Watch;

use super::error::ProofError;
use super::followed::Followed;
use super::guarantee::Guarantee;

/// Store of the pieces of a proof that were decided or left undecided, in this process or in another.
pub trait KnownPieces: Sync {
    /// Returns the verdict on the scenes within a range \[low, high\] of each key, in the order of the keys; `None` if the verdict is not known.
    fn known(&self, ranges: &[[f64; 2]]) -> Option<Guarantee>;

    /// Stores the verdict on a piece. Called once the piece was looked at, also with [`Guarantee::Undecided`].
    fn found(&self, ranges: &[[f64; 2]], guarantee: Guarantee);
}

/// A store that knows no piece and keeps none.
pub(super) struct NothingKnown;

impl KnownPieces for NothingKnown {
    fn known(&self, _ranges: &[[f64; 2]]) -> Option<Guarantee> {
        None
    }

    fn found(&self, _ranges: &[[f64; 2]], _guarantee: Guarantee) {}
}

impl Followed<'_> {
    /// Returns the verdict on the ranges: the known verdict, or else the verdict that is computed here and then stored in `pieces`. Counts as one operation of
    /// the watch.
    pub(super) fn look(&self, ranges: &[[f64; 2]], pieces: &dyn KnownPieces, watch: &dyn Watch) -> Result<Guarantee, ProofError> {
        let guarantee = match pieces.known(ranges) {
            Some(known) => known,
            None => {
                // An undecided piece is stored too: a later process then halves the piece without deciding it again.
                let found = self.decide(ranges)?.map_or(Guarantee::Undecided, Guarantee::from);
                pieces.found(ranges, found);
                found
            }
        };
        watch.done(1.0);
        Ok(guarantee)
    }
}
