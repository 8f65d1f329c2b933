//! Exchanges between a peer and a device that is slower than the tick of the peer.

use crate::State;

/// Ticks at which a peer reads its device and gives the device a new force.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Exchange {
    /// Number of ticks between two exchanges; 0 counts as 1. Tick 0 has an exchange.
    pub every: u32,
    /// `true` if the coupling uses the reading of the previous exchange, because a reading takes an exchange to arrive.
    pub late: bool,
}

impl Exchange {
    /// An exchange at each tick, with readings of the tick itself.
    pub const EACH_TICK: Self = Self { every: 1, late: false };

    /// Returns whether the device keeps a force for more than one tick.
    #[must_use]
    pub const fn holds(self) -> bool {
        self.every > 1
    }
}

impl Default for Exchange {
    fn default() -> Self {
        Self::EACH_TICK
    }
}

/// Readings and force that a peer and its device keep between two exchanges.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Exchanged<const A: usize> {
    /// Reading r that the coupling uses until the next exchange.
    pub reading: State<A>,
    /// State of the device at the latest exchange. Becomes `reading` at the next exchange if readings are late.
    pub latest: State<A>,
    /// Force G \[N\], which the device keeps until the next exchange. Acts on the device with the opposite sign.
    pub held: [f64; A],
    /// Ticks until the next exchange; 0 if the tick to come has an exchange.
    pub until: u32,
}

impl<const A: usize> Exchanged<A> {
    /// Returns the state before tick 0, whose exchange reads the initial state `device`, also if readings are late.
    pub(crate) const fn new(device: State<A>) -> Self {
        Self { reading: device, latest: device, held: [0.0; A], until: 0 }
    }

    /// Takes the state of the device at a tick. Changes nothing at a tick without an exchange.
    pub(crate) const fn read(&mut self, exchange: Exchange, device: State<A>) {
        if self.until == 0 {
            self.reading = if exchange.late { self.latest } else { device };
            self.latest = device;
        }
    }

    /// Ends the tick and returns the force that the device keeps over the tick \[N\]. `coupling` is FC of the tick; the device takes FC at an exchange.
    pub(crate) const fn hold(&mut self, exchange: Exchange, coupling: [f64; A]) -> [f64; A] {
        if self.until == 0 {
            self.held = coupling;
            self.until = exchange.every;
        }
        self.until = self.until.saturating_sub(1);
        self.held
    }
}
