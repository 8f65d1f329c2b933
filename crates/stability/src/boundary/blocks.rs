//! Blocks of a search shared by several processes. A block has some of the first samples and is searched as if there were no other samples. The search of
//! the whole range comes afterwards: almost all values are known by then, and the search computes the rest, near the ends of blocks.

use rayon::prelude::*;

use super::{Boundary, BoundaryOptions, End, by_value, go_on};
use crate::map::{Scratches, nodes};
use crate::{AnalysisError, Cell, Family, FamilyError, KeyRange, Watch};

/// The largest number of intervals between first samples in a block.
const INTERVALS: usize = 8;

/// A part of the range of a search, given by its first values.
#[derive(Clone, PartialEq, Debug)]
pub struct BoundaryBlock(Vec<f64>);

impl BoundaryBlock {
    /// Returns the values of the first pass, ascending, both ends of the block among them.
    #[must_use]
    pub fn first_values(&self) -> &[f64] {
        &self.0
    }

    /// Returns whether `known` has all values of a search of the block.
    #[must_use]
    pub fn is_known(&self, range: &KeyRange, options: BoundaryOptions, known: &[(f64, Cell)]) -> bool {
        let known = by_value(known);
        // A search without a radius function stops at the first unknown value, so a search that does not stop knows everything.
        let look = |value: f64| Ok::<_, std::convert::Infallible>(known.get(&value.to_bits()).map(|cell| (value, *cell)));
        let Ok((_, end)) = go_on(self.0.clone(), range, options, look);
        end != End::Stopped
    }
}

impl Boundary {
    /// Returns the blocks of the range of a search, ascending. The last value of a block is the first value of the next block.
    #[must_use]
    pub fn blocks(range: &KeyRange, options: BoundaryOptions) -> Vec<BoundaryBlock> {
        let values = nodes(range, options.samples);
        // Neighbouring blocks share a value, so that no interval between first samples lies outside all blocks.
        let block = |place: usize| BoundaryBlock(values[place..values.len().min(place + INTERVALS + 1)].to_vec());
        (0..values.len().saturating_sub(1)).step_by(INTERVALS).map(block).collect()
    }

    /// Searches blocks on all threads of the calling pool. `found` is called with each unknown value and its radius, and `done` with the index of each
    /// completely searched block; the watch has stopped the other searches.
    ///
    /// # Errors
    ///
    /// [`FamilyError`] if a radius cannot be computed, or if the family has not exactly one open key.
    pub fn search_blocks(
        family: &Family,
        options: BoundaryOptions,
        blocks: &[BoundaryBlock],
        known: &[(f64, Cell)],
        found: impl Fn(f64, Cell) + Sync,
        done: impl Fn(usize) + Sync,
        watch: &dyn Watch,
    ) -> Result<(), FamilyError> {
        let [range] = family.keys() else { return Err(FamilyError::Values { given: 1, keys: family.keys().len() }) };
        let (known, pool) = (by_value(known), Scratches::default());
        let look = |value: f64| {
            if watch.stops() {
                return Ok(None);
            }
            if let Some(cell) = known.get(&value.to_bits()) {
                return Ok(Some((value, *cell)));
            }
            match pool.with(|scratch| family.bounded_radius_watched(&[value], scratch, watch)) {
                Ok(cell) => {
                    found(value, cell);
                    Ok(Some((value, cell)))
                }
                Err(FamilyError::Analysis(AnalysisError::Stopped)) => Ok(None),
                Err(error) => Err(error),
            }
        };
        blocks.par_iter().enumerate().try_for_each(|(place, block)| {
            if go_on(block.0.clone(), range, options, look)?.1 != End::Stopped {
                done(place);
            }
            Ok(())
        })
    }
}
