//! What must hold for every scene: equivalences, symmetries, conservation, and the meaning of a tick, each against an oracle of its own.
#![allow(clippy::unwrap_used, reason = "helpers of tests may fail as tests do")]
#![allow(clippy::float_cmp, clippy::cast_precision_loss, reason = "oracles that must agree to the bit, and counts far below 2^53")]

mod convergence;
mod edited_scenes;
mod equivalence;
mod growth;
mod held_samples;
mod ideal_network;
mod impedance;
mod local_damping;
mod local_lag;
mod many_peers;
mod measures;
mod own_strategies;
mod parameter_changes;
mod replay;
mod rotation;
mod rotation_laws;
mod slow_devices;
mod switching;
mod symmetry;
mod topologies;
mod tracking;
mod turned_growth;
mod waves;

/// Half the distance from 1 to the next double: the largest relative error of one rounding.
const ROUNDING: f64 = f64::EPSILON / 2.0;

/// A count as a number.
pub(crate) fn count(items: usize) -> f64 {
    items as f64
}
