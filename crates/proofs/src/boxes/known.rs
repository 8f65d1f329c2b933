//! The pieces of a proof that are known before it begins.

use cohaptic_stability::Watch;

use super::error::ProofError;
use super::followed::Followed;
use super::guarantee::Guarantee;

/// The pieces of a proof that were looked at, in this process or in others.
pub trait KnownPieces: Sync {
    /// The verdict on the scenes between these values of each key; `None` if it is not known.
    fn known(&self, ranges: &[[f64; 2]]) -> Option<Guarantee>;

    /// This verdict was found.
    fn found(&self, ranges: &[[f64; 2]], guarantee: Guarantee);
}

/// Nothing is known before, and nothing kept.
pub(super) struct NothingKnown;

impl KnownPieces for NothingKnown {
    fn known(&self, _ranges: &[[f64; 2]]) -> Option<Guarantee> {
        None
    }

    fn found(&self, _ranges: &[[f64; 2]], _guarantee: Guarantee) {}
}

impl Followed<'_> {
    /// The verdict on ranges: the known one, or it is found.
    pub(super) fn look(&self, ranges: &[[f64; 2]], pieces: &dyn KnownPieces, watch: &dyn Watch) -> Result<Guarantee, ProofError> {
        let guarantee = match pieces.known(ranges) {
            Some(known) => known,
            None => {
                let found = self.decide(ranges)?.map_or(Guarantee::Undecided, Guarantee::from);
                pieces.found(ranges, found);
                found
            }
        };
        watch.done(1.0);
        Ok(guarantee)
    }
}
