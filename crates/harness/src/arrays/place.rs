//! Indices of the numbers of a body in blocks of eight lanes.

use super::lanes::WIDTH;

/// Index of a block and of a lane in this block.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Spot {
    pub(super) block: usize,
    pub(super) lane: usize,
}

/// Layout of the bodies of some or all peers of a scene, counted from 0: by axis, then peer, then run. Each axis begins a new block, so work along an axis is
/// work on whole blocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places {
    /// Index in the scene of the first of these peers.
    pub(super) first: usize,
    pub(super) peers: usize,
    pub(super) runs: usize,
}

impl Places {
    /// Returns the number of blocks of an axis.
    pub(super) const fn blocks(self) -> usize {
        (self.peers * self.runs).div_ceil(WIDTH)
    }

    #[inline(always)]
    pub(super) const fn spot(self, axis: usize, peer: usize, run: usize) -> Spot {
        let number = peer * self.runs + run;
        Spot { block: axis * self.blocks() + number / WIDTH, lane: number % WIDTH }
    }

    /// Returns every spot of an axis with its peer and run. Spots beyond the last run of the last peer repeat this run and move alike, so whole blocks can be
    /// computed and compared.
    pub(super) fn all(self, axis: usize) -> impl Iterator<Item = (Spot, usize, usize)> {
        let last = self.peers * self.runs - 1;
        (0..self.blocks() * WIDTH).map(move |number| {
            let spot = Spot { block: axis * self.blocks() + number / WIDTH, lane: number % WIDTH };
            let number = number.min(last);
            (spot, number / self.runs, number % self.runs)
        })
    }
}
