//! Samples of a process on another machine, which the tests play.

use cohaptic_peer::State;
use cohaptic_peer::rotation::Attitude;
use cohaptic_peer::wire::{Extra, MAX_LEN, Sample};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

pub(crate) fn millis(millis: u64) -> Instant {
    Instant::from_nanos(millis * 1_000_000)
}

/// Returns the datagram with which the process of a peer sends its sample number `sequence`.
pub(crate) fn sample(scene: &Scene, peer: usize, sequence: u64, x: f64, v: f64) -> Vec<u8> {
    let state = State { position: [x, -x, x / 2.0], velocity: [v, v, -v] };
    let sample = Sample { session: scene.seed, sender: u32::try_from(peer).unwrap(), sequence, sent: millis(sequence), state };
    let mut bytes = [0; MAX_LEN];
    let mut attitude = Attitude { rate: [v, x, 1.0], ..Attitude::REST };
    attitude.turn([x, 10.0 * x, -v]);
    let len = sample.encode_as(scene.sample_kind(), &Extra::turned(attitude), scene.axes.count(), &mut bytes);
    bytes[..len].to_vec()
}
