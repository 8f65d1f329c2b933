//! What a running router says of itself.

use cohaptic_realtime::LatenessSummary;
use cohaptic_units::Instant;

use crate::engine::Counters;
use crate::side::Sent;

/// What was handed to the device of one side.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Written {
    /// Packets that it took.
    pub packets: u64,
    /// Their bytes, with frames.
    pub bytes: u64,
    /// Packets for which it had no room. They are lost: the router never waits for a device.
    pub full: u64,
    /// Packets that were longer than it takes.
    pub too_long: u64,
    /// Packets that it refused for another reason, such as being down.
    pub refused: u64,
}

impl Written {
    pub(super) fn add(&mut self, sent: Sent, length: usize) {
        match sent {
            Sent::Sent => {
                self.packets += 1;
                self.bytes += length as u64;
            }
            Sent::Full => self.full += 1,
            Sent::TooLong => self.too_long += 1,
            Sent::Refused => self.refused += 1,
        }
    }

    /// Packets that the device did not take.
    #[must_use]
    pub const fn lost(&self) -> u64 {
        self.full + self.too_long + self.refused
    }
}

/// Everything that a running router has counted.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Report {
    /// How old the run is.
    pub elapsed: Instant,
    /// Packets, links and rules.
    pub counters: Counters,
    /// By side: left, right.
    pub written: [Written; 2],
    /// How late packets left after their logical departure.
    pub release: LatenessSummary,
}

impl Report {
    /// Packets that came in.
    #[must_use]
    pub fn packets(&self) -> u64 {
        self.counters.received.iter().map(|received| received.all.packets).sum()
    }

    /// Packets that did not come out, for any reason, and will not: packets on the way are not among them.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.counters.dropped() + self.written.iter().map(Written::lost).sum::<u64>()
    }
}
