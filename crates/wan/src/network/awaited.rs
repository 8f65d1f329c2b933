//! Instants of possible arrivals at the receivers awaited by a driver.

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Reverse;

use cohaptic_units::Instant;

use super::id::NodeId;
use super::paths::Paths;
use super::pending::LineId;

/// Awaited receivers, and the instants of possible arrivals there.
#[derive(Clone, Debug)]
pub(super) struct Awaited {
    /// `true` if a node is awaited, indexed by node.
    is_awaited: Vec<bool>,
    /// `true` if the receiver of a link is awaited, indexed by link. Empty in a network with links between all nodes: there the link number gives the receiver.
    is_receiver_awaited: Vec<bool>,
    /// Instants to come, earliest first. An instant may occur several times.
    instants: BinaryHeap<Reverse<Instant>>,
}

impl Awaited {
    pub(super) fn new(paths: &Paths, receivers: impl IntoIterator<Item = NodeId>) -> Self {
        let mut is_awaited = alloc::vec![false; paths.nodes().into()];
        for node in receivers {
            // Missing nodes are ignored.
            if let Some(is_awaited) = is_awaited.get_mut(node.index()) {
                *is_awaited = true;
            }
        }
        let is_receiver_awaited = match paths {
            Paths::All { .. } => Vec::new(),
            Paths::Some(some) => some.receivers().iter().map(|to| is_awaited[to.index()]).collect(),
        };
        Self { is_awaited, is_receiver_awaited, instants: BinaryHeap::new() }
    }

    /// Notes the departure of a packet to node `to` from a line at `at`. Not inlined, because most networks await no receiver.
    #[inline(never)]
    pub(super) fn schedule(&mut self, at: Instant, to: NodeId) {
        if self.is_awaited[to.index()] {
            self.instants.push(Reverse(at));
        }
    }

    /// Notes a wake of the engine of `line` at `at`.
    pub(super) fn announce(&mut self, at: Instant, line: LineId) {
        let is_awaited = match line {
            // The packets of an uplink go to any node.
            LineId::Uplink(_) => true,
            // In a network with links between all nodes, link numbers are `from * nodes + to`, and the remainder is the receiver.
            LineId::Link(link) if self.is_receiver_awaited.is_empty() => self.is_awaited[link.index() % self.is_awaited.len()],
            LineId::Link(link) => self.is_receiver_awaited[link.index()],
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
