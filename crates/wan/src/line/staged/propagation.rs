//! Packets in propagation between two stages.

use alloc::collections::BinaryHeap;
use core::cmp::Ordering;

use cohaptic_units::Instant;

use super::Carried;

/// Packets in propagation, released in the order of their instants and, at one instant, in the order of their beginnings.
#[derive(Clone, Debug)]
pub(super) struct Propagation<T> {
    packets: BinaryHeap<Propagating<T>>,
    /// Packets pushed so far. Orders packets with the same instant of release.
    count: u64,
}

impl<T> Propagation<T> {
    pub(super) const fn new() -> Self {
        Self { packets: BinaryHeap::new(), count: 0 }
    }

    /// Adds a packet, to be released at `until`.
    pub(super) fn push(&mut self, until: Instant, packet: Carried<T>) {
        self.count += 1;
        self.packets.push(Propagating { until, order: self.count, packet });
    }

    /// Returns the instant of the next release.
    pub(super) fn next_at(&self) -> Option<Instant> {
        self.packets.peek().map(|first| first.until)
    }

    /// Removes and returns the first packet if the packet is released by `now`.
    pub(super) fn take_due(&mut self, now: Instant) -> Option<Carried<T>> {
        self.next_at().filter(|until| *until <= now)?;
        self.packets.pop().map(|first| first.packet)
    }
}

/// A packet in propagation. The order is reversed, so the heap gives the earliest packet first.
#[derive(Clone, Debug)]
struct Propagating<T> {
    until: Instant,
    order: u64,
    packet: Carried<T>,
}

impl<T> PartialEq for Propagating<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<T> Eq for Propagating<T> {}

impl<T> PartialOrd for Propagating<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> Ord for Propagating<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        (other.until, other.order).cmp(&(self.until, self.order))
    }
}
