//! The scenes of the comparison: a full mesh of N peers at 1 kHz, 125 samples a second to each other one, 24 ms one way.
//!
//! Every program but this project's own has the same arithmetic ([`body`]) and the same draws ([`draws`]), and differs in what it is written on: which keeps
//! the time, and which brings a sample from one peer to another. So all end in the same state, to the bit, and a test holds them to it.

pub mod body;
pub mod draws;
pub mod on_bach;
pub mod on_bach_sockets;
pub mod on_cohaptic;
pub mod on_heap;
pub mod on_loop;
pub mod on_nexosim;
pub mod on_turmoil;
pub mod program;

pub use cohaptic_benches_common::mesh::{
    COUPLING, DELAY_NANOS, DEVICE, HAND_FORCE, LOSS, Mesh, OBJECT_MASS, SD_NANOS, SEED, TICK_NANOS, TICKS_A_FRAME,
};

/// What a run ends with.
#[derive(Clone, PartialEq, Debug)]
pub struct Outcome {
    /// Position of each copy after the last tick \[m\].
    pub positions: Vec<f64>,
    /// Packets that have arrived by the last tick, over all links.
    pub delivered: u64,
    /// The largest time between the instant at which a packet arrives, by its draw, and that at which the program has it.
    pub arrival_error_nanos: u64,
}

/// A sample on its way.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Packet {
    /// The sender.
    pub from: usize,
    /// Its number, from 0.
    pub sequence: u64,
    /// When it arrives.
    pub arrival: u64,
    /// Position of the sender's copy \[m\].
    pub x: f64,
    /// Its velocity [m/s].
    pub v: f64,
}
