//! Counters of a running router.

use cohaptic_realtime::LatenessSummary;
use cohaptic_units::Instant;

use crate::engine::Counters;
use crate::side::Sent;

/// Packets handed to the device of one side.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Written {
    /// Packets taken by the device.
    pub packets: u64,
    /// Bytes of the taken packets, with frames.
    pub bytes: u64,
    /// Packets for which the device had no room. Such packets are lost, because the router never waits for a device.
    pub full: u64,
    /// Packets longer than the device takes.
    pub too_long: u64,
    /// Packets refused for another reason, such as a device that is down.
    pub refused: u64,
}

impl Written {
    /// Counts a packet of `length` bytes.
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

    /// Returns the number of packets not taken by the device.
    #[must_use]
    pub const fn lost(&self) -> u64 {
        self.full + self.too_long + self.refused
    }
}

/// All counters of a running router.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Report {
    /// Time since the run began.
    pub elapsed: Instant,
    /// Counters of packets, links and rules.
    pub counters: Counters,
    /// Packets handed to the devices, indexed by side: left, right.
    pub written: [Written; 2],
    /// Release error: time from the logical departure of a packet to the call of the device.
    pub release: LatenessSummary,
}

impl Report {
    /// Returns the number of arrived packets.
    #[must_use]
    pub fn packets(&self) -> u64 {
        self.counters.received.iter().map(|received| received.all.packets).sum()
    }

    /// Returns the number of packets lost for any reason. Packets inside links are not counted.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.counters.dropped() + self.written.iter().map(Written::lost).sum::<u64>()
    }
}
