//! View of all peers at one instant of a run in arrays.

use cohaptic_units::Instant;

use super::blocks::Block;
use super::lanes::WIDTH;
use crate::rows::TickRow;

/// All peers of a scene without rotation, at an instant of a tick of all peers, with the forces of the instant and before any peer moves.
///
/// Positions are read from the arrays. The rest of a row is computed when [`Ticks::each`] is called.
#[derive(Clone, Copy)]
pub struct Ticks<'a> {
    at: Instant,
    peers: usize,
    blocks: &'a [Block],
    source: &'a dyn Source,
}

/// Source of the rows of [`Ticks::each`].
pub(super) trait Source {
    /// Calls `on` with each row in the order of the peers, until `on` returns `false`.
    fn each(&self, on: &mut dyn FnMut(&TickRow<'_>) -> bool);
}

impl<'a> Ticks<'a> {
    pub(super) fn new(at: Instant, peers: usize, blocks: &'a [Block], source: &'a dyn Source) -> Self {
        Self { at, peers, blocks, source }
    }

    /// Returns the instant.
    #[must_use]
    pub const fn at(&self) -> Instant {
        self.at
    }

    /// Returns the position of each copy of the object along an axis \[m\], in the order of the peers.
    ///
    /// # Panics
    ///
    /// If the scene has no such axis.
    #[inline]
    pub fn positions(&self, axis: usize) -> impl Iterator<Item = f64> {
        // The last block may be padded: its lanes beyond the last peer are left out.
        self.blocks_of_positions(axis).zip(0..).flat_map(move |(positions, place)| positions[..WIDTH.min(self.peers - place * WIDTH)].iter().copied())
    }

    /// Like [`Ticks::positions`], eight positions at a time. Numbers beyond the last peer are arbitrary.
    pub(crate) fn blocks_of_positions(&self, axis: usize) -> impl Iterator<Item = &[f64; WIDTH]> {
        let blocks = self.peers.div_ceil(WIDTH);
        self.blocks[axis * blocks..(axis + 1) * blocks].iter().map(Block::positions)
    }

    /// Returns the position of a peer's copy along an axis \[m\].
    ///
    /// # Panics
    ///
    /// If the scene has no such peer or axis.
    #[must_use]
    #[inline]
    pub fn position(&self, peer: usize, axis: usize) -> f64 {
        assert!(peer < self.peers, "there are {} peers", self.peers);
        // Blocks are ordered by axis, and eight peers share a block.
        self.blocks[axis * self.peers.div_ceil(WIDTH) + peer / WIDTH].positions()[peer % WIDTH]
    }

    /// Calls `on` with each peer's row, in the order of the peers.
    ///
    /// # Errors
    ///
    /// The first error of `on`. After an error `on` is not called again.
    pub fn each<E>(&self, mut on: impl FnMut(&TickRow<'_>) -> Result<(), E>) -> Result<(), E> {
        let mut result = Ok(());
        self.source.each(&mut |row| {
            result = on(row);
            result.is_ok()
        });
        result
    }
}

impl std::fmt::Debug for Ticks<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Ticks").field("at", &self.at).field("peers", &self.peers).finish_non_exhaustive()
    }
}
