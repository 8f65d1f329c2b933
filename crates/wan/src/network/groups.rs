//! Packets of a broadcast that arrive at one instant, in one entry.
//!
//! Over links of one constant delay, the packets of a broadcast differ in their receivers alone. One entry for all receivers then takes the place of an event
//! for each packet: less is written and read, and thousands of packets in propagation stay within a cache. Packets come out of an entry one by one, each at its
//! turn among the events of the [queue](crate::event_queue).

use cohaptic_units::Instant;

use super::id::{LinkId, NodeId, Path};
use super::pending::{InNetwork, LineId, Pending, SizeAndMarks, Turn};
use crate::event_queue::Event;
use crate::ring::Ring;

/// Packets from one node that leave their links at the same instant with the same number.
#[derive(Clone, Debug)]
pub(super) struct Group<P> {
    pub(super) at: Instant,
    pub(super) offered: Instant,
    /// Number of each packet on its path.
    pub(super) sequence: u64,
    pub(super) from: NodeId,
    /// Receiver of the next packet.
    pub(super) next: NodeId,
    /// First node after the receivers. The sender is no receiver.
    pub(super) end: u16,
    /// First link of the sender: the link to node 0, if there were one.
    pub(super) first: LinkId,
    pub(super) size: SizeAndMarks,
    pub(super) payload: P,
}

/// Groups in the order of their packets: each packet of a group comes before all packets of the next group.
#[derive(Clone, Debug)]
pub(super) struct Groups<P>(Ring<Group<P>>);

impl<P: Clone> Group<P> {
    /// Returns whether the group is a single packet, or no packet.
    pub(super) const fn is_single(&self) -> bool {
        self.next.0 + 1 >= self.end
    }

    /// Returns the receiver after `to` of packets from the node `from`.
    #[inline(always)]
    pub(super) const fn after(from: NodeId, to: u16) -> u16 {
        if to + 1 == from.0 { to + 2 } else { to + 1 }
    }

    const fn link(&self, to: u16) -> LinkId {
        LinkId(self.first.0 + to as u32)
    }

    const fn line(&self, to: u16) -> LineId {
        LineId::Link(self.link(to))
    }

    const fn path(&self) -> Path {
        Path { from: self.from, to: self.next }
    }

    /// Removes and returns the next packet, with its link; `None` after the last packet.
    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<(LinkId, InNetwork<P>)> {
        let Self { offered, sequence, next, size, .. } = *self;
        if next.0 >= self.end {
            return None;
        }
        let packet = InNetwork { sequence, offered, entered: offered, path: self.path(), size, payload: self.payload.clone() };
        self.next = NodeId(Self::after(self.from, next.0));
        Some((self.link(next.0), packet))
    }
}

impl<P: Clone> Groups<P> {
    pub(super) const fn new() -> Self {
        Self(Ring::new())
    }

    /// Returns whether a group may be added: whether its first packet comes after the last packet of all groups.
    pub(super) fn takes(&self, group: &Group<P>) -> bool {
        // Packets of one instant in another order of links are left to the queue.
        let key = |at: Instant, line: LineId| (at, Turn::arrival(line));
        self.0.back().is_none_or(|last| key(last.at, last.line(last.end)) <= key(group.at, group.line(group.next.0)))
    }

    /// Adds a group that the groups [take](Groups::takes).
    pub(super) fn push(&mut self, group: Group<P>) {
        self.0.push(|| group);
    }

    /// Returns the instant of the next packet.
    #[inline(always)]
    pub(super) fn next_at(&self) -> Option<Instant> {
        self.0.front().map(|group| group.at)
    }

    /// Returns the key of the next packet if the packet is due at `now`.
    #[inline(always)]
    pub(super) fn due_key(&self, now: Instant) -> Option<<Pending<P> as Event>::Key> {
        let group = self.0.front().filter(|group| group.at <= now)?;
        Some((group.at, Turn::arrival(group.line(group.next.0)), group.sequence, group.path(), group.size.copy()))
    }

    /// Removes and returns the first group.
    #[inline(always)]
    pub(super) fn take_group(&mut self) -> Option<Group<P>> {
        self.0.pop()
    }

    /// Puts the rest of a group back, which was the first group.
    pub(super) fn put_back(&mut self, group: Group<P>) {
        self.0.push_front(group);
    }

    /// Removes and returns the next packet.
    #[inline(always)]
    pub(super) fn take(&mut self) -> Option<Pending<P>> {
        let group = self.0.front_mut()?;
        let (link, InNetwork { sequence, offered, entered, path, size, payload }) = group.pop()?;
        let (at, turn) = (group.at, Turn::arrival(LineId::Link(link)));
        if group.next.0 >= group.end {
            self.0.drop_front();
        }
        Some(Pending { at, sequence, offered, entered, turn, path, size, payload: Some(payload) })
    }
}
