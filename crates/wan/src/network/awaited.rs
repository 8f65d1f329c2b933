//! When something happens for receivers that somebody waits for.

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Reverse;

use cohaptic_units::Instant;

use super::id::NodeId;
use super::pending::LineId;

/// The receivers, and the instants to come of the packets on the way to them.
#[derive(Clone, Debug)]
pub(super) struct Awaited {
    /// By node.
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

    /// A packet to that node comes out of a line.
    #[inline]
    pub(super) fn schedule(&mut self, at: Instant, to: NodeId) {
        if self.is_awaited[to.index()] {
            self.instants.push(Reverse(at));
        }
    }

    /// The engine of a line must be woken.
    pub(super) fn announce(&mut self, at: Instant, line: LineId) {
        let is_awaited = match line {
            // Its packets go to any node.
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

    /// All that was due up to and including `now` has happened.
    #[inline]
    pub(super) fn pass(&mut self, now: Instant) {
        while self.instants.peek().is_some_and(|Reverse(at)| *at <= now) {
            self.instants.pop();
        }
    }
}
