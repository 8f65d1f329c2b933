//! Samples between peers: what is on the way, and what each peer holds of the others.

use super::blocks::Blocks;

pub(super) use broadcast::Broadcast;
pub(super) use single::Single;

mod broadcast;
mod single;

/// A sample of every run, along all axes.
#[derive(Clone, Copy, Debug)]
struct Sample<const A: usize, const L: usize> {
    position: [[f64; L]; A],
    velocity: [[f64; L]; A],
}

impl<const A: usize, const L: usize> Sample<A, L> {
    /// What a peer sends now.
    #[inline(always)]
    fn of(blocks: &Blocks<A>, peer: usize) -> Self {
        let mut sample = Self { position: [[0.0; L]; A], velocity: [[0.0; L]; A] };
        for axis in 0..A {
            for run in 0..L {
                (sample.position[axis][run], sample.velocity[axis][run]) = blocks.object(axis, peer, run);
            }
        }
        sample
    }
}

/// The mean of samples of each run, which lie one after the other, in the order in which [`cohaptic_peer::Held::refresh`] adds them.
#[inline(always)]
fn mean<const L: usize>(values: &[f64], count: f64) -> [f64; L] {
    let mut sums = [[0.0; L]; 4];
    let mut quads = values.chunks_exact(4 * L);
    for quad in &mut quads {
        for place in 0..4 {
            for run in 0..L {
                sums[place][run] += quad[place * L + run];
            }
        }
    }
    for (place, values) in quads.remainder().chunks_exact(L).enumerate() {
        for run in 0..L {
            sums[place][run] += values[run];
        }
    }
    let [a, b, c, d] = sums;
    std::array::from_fn(|run| ((a[run] + b[run]) + (c[run] + d[run])) / count)
}

/// How many others there are, as a number to divide by.
#[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
fn others(peers: usize) -> f64 {
    (peers - 1) as f64
}
