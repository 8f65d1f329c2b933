//! Proofs that several processes share: the ranges are cut into blocks, and each block is looked at by itself.

use cohaptic_stability::{Family, Unwatched, Watch};
use rayon::prelude::*;

use super::error::ProofError;
use super::followed::Followed;
use super::guarantee::Guarantee;
use super::halving::{Halving, Look, Ranges};
use super::known::KnownPieces;
use super::{line, region};

/// A proof over the ranges of the open keys of a family, in blocks.
#[derive(Clone, Debug)]
pub struct SharedProof {
    /// With which ranges it begins.
    beginnings: Vec<Ranges>,
    halving: Halving,
    /// For which numbers of peers its verdicts hold.
    every: Option<(u64, Option<u64>)>,
    /// How many keys are halved.
    keys: u32,
    /// How often the ranges are halved for a block.
    depth: u32,
}

/// Into how many blocks the ranges are cut with which a proof begins: two to the power of this.
const BLOCKS: u32 = 6;

impl SharedProof {
    /// That of [`ProvenRegion::prove`](super::ProvenRegion::prove).
    ///
    /// # Errors
    ///
    /// Those of the proof.
    pub fn of_region(family: &Family, halvings: u32, every: Option<(u64, Option<u64>)>) -> Result<Self, ProofError> {
        Self::new(family, region::halving(halvings), every)
    }

    /// That of [`ProvenLine::prove`](super::ProvenLine::prove).
    ///
    /// # Errors
    ///
    /// Those of the proof.
    pub fn of_line(family: &Family, tolerance: f64) -> Result<Self, ProofError> {
        Self::new(family, line::halving(tolerance), None)
    }

    fn new(family: &Family, halving: Halving, every: Option<(u64, Option<u64>)>) -> Result<Self, ProofError> {
        let followed = Followed::new(family, every)?;
        let halving = halving.but_for(followed.delay());
        let keys = u32::try_from(halving.halved_keys(family.keys().len()).len()).unwrap_or_default();
        let depth = BLOCKS.checked_div(keys).unwrap_or_default().min(halving.times);
        Ok(Self { beginnings: followed.beginnings(), halving, every, keys, depth })
    }

    /// How many blocks there are: 64 for each stretch of a delay, fewer of ranges that are halved less often.
    #[must_use]
    pub fn blocks(&self) -> u64 {
        (self.beginnings.len() as u64) << (self.depth * self.keys)
    }

    /// Looks at every piece of some blocks that is not known, and at those that they are parts of, on all threads of the pool that it is called in. `done` gets each
    /// block that is whole.
    ///
    /// # Errors
    ///
    /// Those of the proof.
    pub fn look_at(
        &self,
        family: &Family,
        blocks: &[u64],
        pieces: &dyn KnownPieces,
        done: impl Fn(u64) + Sync,
        watch: &dyn Watch,
    ) -> Result<(), ProofError> {
        let followed = Followed::new(family, self.every)?;
        blocks.par_iter().try_for_each(|block| {
            if self.walk(*block, &|ranges| followed.look(ranges, pieces, watch).map(Some), watch)? {
                done(*block);
            }
            Ok(())
        })
    }

    /// Whether every piece of a block is known.
    #[must_use]
    pub fn is_known(&self, block: u64, pieces: &dyn KnownPieces) -> bool {
        self.walk(block, &|ranges| Ok(pieces.known(ranges)), &Unwatched).unwrap_or(false)
    }

    fn walk(&self, block: u64, look: Look<'_>, watch: &dyn Watch) -> Result<bool, ProofError> {
        let beginning = usize::try_from(block >> (self.depth * self.keys)).unwrap_or_default();
        let mut ranges = self.beginnings[beginning].clone();
        for halved in 0..self.depth {
            if watch.stops() {
                return Ok(false);
            }
            match look(&ranges)? {
                None => return Ok(false),
                Some(Guarantee::Stable | Guarantee::Unstable) => return Ok(true),
                Some(Guarantee::Undecided) if !self.halving.may_halve(&ranges) => return Ok(true),
                Some(Guarantee::Undecided) => {}
            }
            let place = block >> (self.keys * (self.depth - 1 - halved)) & ((1 << self.keys) - 1);
            ranges = self.halving.halves(&ranges).swap_remove(usize::try_from(place).unwrap_or_default());
        }
        Ok(self.halving.of(vec![ranges], self.depth, look, watch)?.is_whole)
    }
}
