//! Samples between peers: those in flight, and those that each peer holds of the others. A sample is P pairs of numbers.

pub(super) use broadcast::Broadcast;
pub(super) use per_packet::PerPacket;

use cohaptic_peer::State;

mod broadcast;
mod in_flight;
mod per_packet;
mod quads;
mod rows;

/// A sample of every run: pairs of numbers, of which those of the axes are positions and velocities.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample<const P: usize, const L: usize> {
    pub(super) position: [[f64; L]; P],
    pub(super) velocity: [[f64; L]; P],
}

impl<const P: usize, const L: usize> Sample<P, L> {
    pub(super) const ZERO: Self = Self { position: [[0.0; L]; P], velocity: [[0.0; L]; P] };

    /// That of a run.
    fn state(&self, run: usize) -> State<P> {
        State { position: self.position.map(|runs| runs[run]), velocity: self.velocity.map(|runs| runs[run]) }
    }
}

/// A number of peers to divide by.
#[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
fn count(peers: usize) -> f64 {
    peers as f64
}
