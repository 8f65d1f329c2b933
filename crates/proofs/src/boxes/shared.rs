//! Proofs shared by several processes: the ranges are cut into blocks, and each block is decided independently of all other blocks.

use cohaptic_stability::{Family, Unwatched, Watch};
use rayon::prelude::*;

use super::error::ProofError;
use super::followed::Followed;
use super::guarantee::Guarantee;
use super::halving::{Halving, KnownPieces, Look, Ranges};
use super::{line, region};

/// Proof over the ranges of the open keys of a family, divided into blocks.
#[derive(Clone, Debug)]
pub struct SharedProof {
    /// First ranges of the proof: one entry per stretch of a delay, otherwise a single entry.
    beginnings: Vec<Ranges>,
    halving: Halving,
    /// First and last number of peers of the verdicts (`None` as the last: without end); `None`: the number of the scene.
    every: Option<(u64, Option<u64>)>,
    /// Number of keys with halved ranges.
    keys: u32,
    /// Number of halvings from the ranges of a beginning to the ranges of a block.
    depth: u32,
}

/// Base-two logarithm of the number of blocks of each beginning.
const BLOCKS: u32 = 6;

impl SharedProof {
    /// Returns the blocks of the proof of [`ProvenRegion::prove`](super::ProvenRegion::prove) with the same arguments.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if the proof fails.
    pub fn of_region(family: &Family, halvings: u32, every: Option<(u64, Option<u64>)>) -> Result<Self, ProofError> {
        Self::new(family, region::halving(halvings), every)
    }

    /// Returns the blocks of the proof of [`ProvenLine::prove`](super::ProvenLine::prove) with the same arguments.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if the proof fails.
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

    /// Returns the number of blocks: 64 for each stretch of a delay, fewer if the ranges are halved less often.
    #[must_use]
    pub fn blocks(&self) -> u64 {
        (self.beginnings.len() as u64) << (self.depth * self.keys)
    }

    /// Decides every unknown piece of the given blocks, and every larger piece around such a block. Runs on all threads of the current thread pool. `done` is
    /// called with each completely known block.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if the proof fails.
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

    /// Returns whether every piece of a block is known. Nothing of the block then needs a decision.
    #[must_use]
    pub fn is_known(&self, block: u64, pieces: &dyn KnownPieces) -> bool {
        self.walk(block, &|ranges| Ok(pieces.known(ranges)), &Unwatched).unwrap_or(false)
    }

    /// Looks at the ranges from a beginning down to a block, and then at all pieces of the block. Returns `true` if every piece was looked at.
    fn walk(&self, block: u64, look: Look<'_>, watch: &dyn Watch) -> Result<bool, ProofError> {
        // The upper bits of a block number are the place of its beginning. Each group of `keys` bits below is the place of the part taken by one halving, with
        // the first halving in the highest group.
        let beginning = usize::try_from(block >> (self.depth * self.keys)).unwrap_or_default();
        let mut ranges = self.beginnings[beginning].clone();
        for halved in 0..self.depth {
            if watch.stops() {
                return Ok(false);
            }
            match look(&ranges)? {
                None => return Ok(false),
                // A decided larger piece decides the block.
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
