//! Packets in the order of their times to leave, and of arrival for equal times.

use alloc::collections::BTreeMap;

/// The packets in propagation. Keys are the time to leave \[ns\] and the number of the arrival.
#[derive(Clone, Debug)]
pub(super) struct TimeFifo<P> {
    packets: BTreeMap<(i64, u64), P>,
    arrivals: u64,
}

impl<P> TimeFifo<P> {
    pub(super) const fn new() -> Self {
        Self { packets: BTreeMap::new(), arrivals: 0 }
    }

    pub(super) fn len(&self) -> usize {
        self.packets.len()
    }

    pub(super) fn push(&mut self, time: i64, packet: P) {
        self.packets.insert((time, self.arrivals), packet);
        self.arrivals += 1;
    }

    /// Returns the earliest time to leave \[ns\], or `None` if no packet is held.
    pub(super) fn first_time(&self) -> Option<i64> {
        self.packets.first_key_value().map(|((time, _), _)| *time)
    }

    /// Returns the latest time to leave \[ns\], or `None` if no packet is held.
    pub(super) fn last_time(&self) -> Option<i64> {
        self.packets.last_key_value().map(|((time, _), _)| *time)
    }

    pub(super) fn pop(&mut self) -> Option<P> {
        self.packets.pop_first().map(|(_, packet)| packet)
    }
}
