//! Events to come on lines, with one entry for all packets of a broadcast.
//!
//! Packets of a broadcast over links with jitter arrive one by one, but differ in receiver and arrival alone. An entry of the store has the rest, and a place
//! names the entry and the receiver. The events of thousands of packets in propagation then stay within a cache.

use cohaptic_units::Instant;

use super::broadcast::Sent;
use super::id::{LinkId, NodeId, Path};
use super::pending::{LineId, Pending, SizeAndMarks, Turn};
use crate::event_queue::slab::Slab;
use crate::event_queue::{Event, Place, Store};

/// Store of events. The lower [`RECEIVER_BITS`] bits of a place are the receiver of a packet of a broadcast, and 0 for every other event. The upper bits are
/// the index of the entry.
#[derive(Clone, Debug)]
pub(super) struct Sendings<P>(Slab<Sending<P>>);

/// What the packets of a broadcast have in common, or a single event.
#[derive(Clone, Debug)]
struct Sending<P> {
    sequence: u64,
    offered: Instant,
    entered: Instant,
    /// Turn of the packet to the receiver 0.
    turn: Turn,
    /// Path of the packet to the receiver 0.
    path: Path,
    size: SizeAndMarks,
    /// Number of events to come.
    left: u32,
    payload: Option<P>,
}

/// Number of bits for the receiver, enough for every node.
const RECEIVER_BITS: u32 = u16::BITS;

/// An entry to which the packets of a broadcast are added.
#[derive(Debug)]
pub(super) struct Open {
    /// Place of the packet to the receiver 0.
    place: Place,
    /// Number of packets so far.
    packets: u32,
    /// Sequence number of all packets.
    pub(super) sequence: u64,
}

impl Open {
    /// Adds the packet to a receiver, and returns the place of its arrival.
    #[inline(always)]
    pub(super) fn add(&mut self, to: NodeId) -> Place {
        self.packets += 1;
        self.place | Place::from(to.0)
    }
}

impl<P: Clone> Sendings<P> {
    pub(super) const fn new() -> Self {
        Self(Slab::new())
    }

    /// Makes an entry for packets of a broadcast with the number `sequence`. `first` is the link from the sender to node 0, if there were one.
    /// [`Sendings::close`] must follow.
    pub(super) fn open(&mut self, sent: &Sent<'_, P>, first: LinkId, sequence: u64) -> Open {
        let Sent { now, from, size, payload } = *sent;
        let (turn, path) = (Turn::arrival(LineId::Link(first)), Path { from, to: NodeId(0) });
        let sending = || Sending { sequence, offered: now, entered: now, turn, path, size, left: 0, payload: Some(payload.clone()) };
        Open { place: place(self.0.insert(sending)), packets: 0, sequence }
    }

    /// Ends the additions to an entry. An entry without packets is removed.
    pub(super) fn close(&mut self, open: &Open) {
        let (index, _) = parts(open.place);
        if open.packets == 0 {
            self.0.remove(index);
        } else if let Some(sending) = self.0.get_mut(index) {
            sending.left = open.packets;
        }
    }
}

impl<P: Clone> Store<Pending<P>> for Sendings<P> {
    #[inline(always)]
    fn store(&mut self, make: impl FnOnce() -> Pending<P>) -> Place {
        let index = self.0.insert(|| {
            let Pending { at: _, sequence, offered, entered, turn, path, size, payload } = make();
            Sending { sequence, offered, entered, turn, path, size, left: 1, payload }
        });
        place(index)
    }

    #[inline(always)]
    fn take(&mut self, at: Instant, place: Place) -> Option<Pending<P>> {
        let (index, to) = parts(place);
        let sending = self.0.get_mut(index)?;
        let Sending { sequence, offered, entered, turn, path, size, left, .. } = *sending;
        // The last event takes the payload itself, so that the payload of a single packet is never copied.
        let payload = if left > 1 {
            sending.left = left - 1;
            sending.payload.clone()
        } else {
            self.0.remove(index)?.payload
        };
        Some(Pending { at, sequence, offered, entered, turn: turn.to_receiver(to), path: to_receiver(path, to), size, payload })
    }

    fn key(&self, at: Instant, place: Place) -> Option<<Pending<P> as Event>::Key> {
        let (index, to) = parts(place);
        let Sending { sequence, turn, path, size, .. } = self.0.get(index)?;
        Some((at, turn.to_receiver(to), *sequence, to_receiver(*path, to), size.copy()))
    }
}

/// Returns the path from the same sender to a receiver, given the path to the receiver 0. Leaves the path of any other event as it is, with `to` 0.
#[inline(always)]
const fn to_receiver(path: Path, to: NodeId) -> Path {
    Path { from: path.from, to: NodeId(path.to.0 + to.0) }
}

/// Returns the place of an entry, for the receiver 0.
#[inline(always)]
fn place(index: u32) -> Place {
    Place::from(index) << RECEIVER_BITS
}

/// Returns the index of the entry and the receiver.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the parts of which the place was made")]
const fn parts(place: Place) -> (u32, NodeId) {
    ((place >> RECEIVER_BITS) as u32, NodeId(place as u16))
}

#[cfg(test)]
mod tests {
    use alloc::rc::Rc;
    use alloc::vec::Vec;

    use super::*;

    /// An entry lives until its last packet, and an entry without packets until it is closed: nothing of a broadcast stays behind.
    #[test]
    fn an_entry_ends_with_its_last_packet() {
        let payload = Rc::new(());
        let sent = Sent { now: Instant::ZERO, from: NodeId(1), size: SizeAndMarks::NOTHING, payload: &payload };
        let mut sendings = Sendings::new();
        let empty = sendings.open(&sent, LinkId::new(4), 7);
        sendings.close(&empty);
        assert_eq!(Rc::strong_count(&payload), 1);
        let mut open = sendings.open(&sent, LinkId::new(4), 8);
        let places: Vec<_> = [0, 2, 3].map(|to| open.add(NodeId(to))).into();
        sendings.close(&open);
        for (place, to) in places.iter().zip([0, 2, 3]) {
            let taken = sendings.take(Instant::ZERO, *place).unwrap();
            assert_eq!(
                (taken.path, taken.turn.link(), taken.sequence),
                (Path { from: NodeId(1), to: NodeId(to) }, LinkId::new(4 + usize::from(to)), 8)
            );
        }
        assert_eq!(Rc::strong_count(&payload), 1);
        assert!(sendings.take(Instant::ZERO, places[0]).is_none());
    }
}
