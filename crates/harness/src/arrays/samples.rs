//! Samples between peers: samples in flight, and samples that each peer holds of other peers. A sample is a position and a velocity along each axis.

pub(super) use broadcast::Broadcast;
pub(super) use per_packet::PerPacket;

use cohaptic_peer::State;

mod broadcast;
mod in_flight;
mod per_packet;
mod quads;
mod rows;

/// One sample for each of L runs: positions \[m\] and velocities \[m/s\], indexed by axis, then run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample<const A: usize, const L: usize> {
    pub(super) position: [[f64; L]; A],
    pub(super) velocity: [[f64; L]; A],
}

impl<const A: usize, const L: usize> Sample<A, L> {
    pub(super) const ZERO: Self = Self { position: [[0.0; L]; A], velocity: [[0.0; L]; A] };

    /// Returns the sample of the run at index `run`.
    fn state(&self, run: usize) -> State<A> {
        State { position: self.position.map(|runs| runs[run]), velocity: self.velocity.map(|runs| runs[run]) }
    }
}

/// Converts a number of peers to a divisor of means.
#[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
fn count(peers: usize) -> f64 {
    peers as f64
}
