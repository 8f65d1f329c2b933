//! Where the numbers of a body lie.

use super::lanes::WIDTH;

/// Which of the eight numbers of which block.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Spot {
    pub(super) block: usize,
    pub(super) lane: usize,
}

/// Some or all peers of a scene, counted from 0: bodies by axis, then peer, then run; each axis begins a block of its own, so that work along an axis is work on whole blocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places {
    /// The peer of the scene that is the first here: others may be elsewhere.
    pub(super) first: usize,
    pub(super) peers: usize,
    pub(super) runs: usize,
}

impl Places {
    /// Blocks an axis.
    pub(super) const fn blocks(self) -> usize {
        (self.peers * self.runs).div_ceil(WIDTH)
    }

    #[inline(always)]
    pub(super) const fn spot(self, axis: usize, peer: usize, run: usize) -> Spot {
        let number = peer * self.runs + run;
        Spot { block: axis * self.blocks() + number / WIDTH, lane: number % WIDTH }
    }

    /// Every spot of an axis with the peer that lies there. Those beyond the last peer of the last run repeat it: they move as it does, so that whole blocks can be
    /// looked at.
    pub(super) fn all(self, axis: usize) -> impl Iterator<Item = (Spot, usize, usize)> {
        let last = self.peers * self.runs - 1;
        (0..self.blocks() * WIDTH).map(move |number| {
            let spot = Spot { block: axis * self.blocks() + number / WIDTH, lane: number % WIDTH };
            let number = number.min(last);
            (spot, number / self.runs, number % self.runs)
        })
    }
}
