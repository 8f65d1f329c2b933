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

use cohaptic_peer::{DeviceConfig, Gains};

/// The control period.
pub const TICK_NANOS: u64 = 1_000_000;
/// Ticks between two samples.
pub const TICKS_A_FRAME: u64 = 8;
/// The delay one way, the mean of it if it varies.
pub const DELAY_NANOS: u64 = 24_000_000;
/// The deviation of the jitter, where there is jitter.
pub const SD_NANOS: f64 = 2e6;
/// The fraction of packets lost, where packets are lost.
pub const LOSS: f64 = 0.01;
/// The seed of all draws.
pub const SEED: u64 = 1;
/// The device of every peer.
pub const DEVICE: DeviceConfig = DeviceConfig { mass: 0.1, damping: 5.0 };
/// The coupling of every peer.
pub const COUPLING: Gains = Gains { stiffness: 3500.0, damping: 5.0 };
/// The mass of the whole object \[kg\]; every copy has its share.
pub const OBJECT_MASS: f64 = 0.45;
/// KT and BT before scaling.
pub const GAINS: Gains = Gains { stiffness: 200.0, damping: 5.0 };
/// The force of the first peer's hand \[N\].
pub const HAND_FORCE: f64 = 1.5;

/// One cell of the table: a number of peers, with or without jitter and loss.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Mesh {
    /// The number of peers, 2 at least.
    pub peers: usize,
    /// 2 ms of normal jitter and 1 % of loss.
    pub impaired: bool,
}

impl Mesh {
    /// The cells of the table.
    pub const ALL: [Self; 6] = [
        Self { peers: 3, impaired: false },
        Self { peers: 3, impaired: true },
        Self { peers: 10, impaired: false },
        Self { peers: 10, impaired: true },
        Self { peers: 50, impaired: false },
        Self { peers: 50, impaired: true },
    ];

    /// How the links are called in a table.
    #[must_use]
    pub const fn links(self) -> &'static str {
        if self.impaired { "24 ms ± 2 ms normal, 1 % loss" } else { "24 ms" }
    }

    /// The packets offered to links in a number of ticks.
    #[must_use]
    pub const fn offered(self, ticks: u64) -> u64 {
        (self.peers * (self.peers - 1)) as u64 * ticks.div_ceil(TICKS_A_FRAME)
    }
}

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
