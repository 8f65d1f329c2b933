//! Samples between peers: those in flight, and those that each peer holds of the others.

use cohaptic_peer::State;
use cohaptic_scene::Scene;

use super::blocks::Blocks;

pub(super) use broadcast::Broadcast;
pub(super) use per_packet::PerPacket;

mod broadcast;
mod per_packet;
mod quads;

/// A sample of every run, along all axes.
#[derive(Clone, Copy, Debug)]
struct Sample<const A: usize, const L: usize> {
    position: [[f64; L]; A],
    velocity: [[f64; L]; A],
}

impl<const A: usize, const L: usize> Sample<A, L> {
    /// Where a peer begins.
    fn initial(scenes: &[&Scene], peer: usize) -> Self {
        let states: Vec<State<A>> = scenes.iter().map(|scene| scene.initial_state(peer)).collect();
        Self {
            position: std::array::from_fn(|axis| std::array::from_fn(|run| states[run].position[axis])),
            velocity: std::array::from_fn(|axis| std::array::from_fn(|run| states[run].velocity[axis])),
        }
    }

    /// That of a run.
    fn state(&self, run: usize) -> State<A> {
        State { position: self.position.map(|runs| runs[run]), velocity: self.velocity.map(|runs| runs[run]) }
    }

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

/// How many others there are, as a number to divide by.
#[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
fn others(peers: usize) -> f64 {
    (peers - 1) as f64
}
