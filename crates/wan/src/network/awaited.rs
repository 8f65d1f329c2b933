//! Instants at which packets may reach the receivers that a driver waits for.

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Reverse;

use cohaptic_units::Instant;

use super::id::NodeId;
use super::pending::LineId;

/// Awaited receivers, and the instants at which packets may reach them.
#[derive(Clone, Debug)]
pub(super) struct Awaited {
    /// Whether a node is awaited, indexed by node.
    /// Instants to come, earliest first. An instant may occur several times.
    is_awaited: Vec<bool>,
    instants: BinaryHeap<Reverse<Instant>>,
}

impl Awaited {
    pub(super) fn new(nodes: u16, receivers: impl IntoIterator<Item = NodeId>) -> Self {
        let mut is_awaited = alloc::vec![false; nodes.into()];
        for node in receivers {
            if let Some(is_awaited) = is_awaited.get_mut(node.index()) {
                *is_awaited = true;
            }
        }
        Self { is_awaited, instants: BinaryHeap::new() }
    }

    /// Notes that a packet to node `to` leaves a line at `at`.
    #[inline]
    pub(super) fn schedule(&mut self, at: Instant, to: NodeId) {
        if self.is_awaited[to.index()] {
            self.instants.push(Reverse(at));
        }
    }

    /// Notes that the engine of `line` must be woken at `at`.
    pub(super) fn announce(&mut self, at: Instant, line: LineId) {
        let is_awaited = match line {
            // The packets of an uplink go to any node.
            // In a network with links between all nodes, link numbers are `from * nodes + to`, and the remainder is the receiver. Links of
            // `Paths::Some` are numbered in another way.
            LineId::Uplink(_) => true,
            LineId::Link(link) => self.is_awaited[link.index() % self.is_awaited.len()],
            LineId::Downlink(node) => self.is_awaited[node.index()],
        };
        if is_awaited {
            self.instants.push(Reverse(at));
        }
    }

    pub(super) fn next_at(&self) -> Option<Instant> {
        self.instants.peek().map(|Reverse(at)| *at)
    }

    /// Forgets all instants up to and including `now`: their events have happened.
    #[inline]
    pub(super) fn pass(&mut self, now: Instant) {
        while self.instants.peek().is_some_and(|Reverse(at)| *at <= now) {
            self.instants.pop();
        }
    }
}
