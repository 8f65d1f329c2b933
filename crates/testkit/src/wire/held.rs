//! How many bytes a run holds, and how many it may hold.

use std::fmt;

/// How many bytes a run may hold unless the test says another number: a gibibyte.
pub(crate) const BYTE_LIMIT: u64 = 1 << 30;

/// Memory of a packet besides its content \[byte\]: its box, its allocation, and its places in the queues of events and of sockets, which have up to
/// twice as many places as packets. So packets without a byte count too.
pub(crate) const PACKET_COST: u64 = 200;

/// The bytes that a run holds: those that were sent, and were neither read nor lost. Each is counted in one of the three numbers, by the part that holds it.
#[derive(Debug)]
pub(crate) struct Held {
    /// On links, with their queues: counted by the [`Wire`](super::Wire) alone.
    links: u64,
    /// In the buffers of sockets, or handed to a node and not taken yet.
    buffers: u64,
    /// In streams of TCP, at both ends: written and not acknowledged, or arrived and not read.
    streams: u64,
    limit: u64,
}

/// Where bytes lie.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Where {
    Links,
    Buffers,
    #[cfg(feature = "tcp")]
    Streams,
}

impl Held {
    pub(super) const fn new(limit: u64) -> Self {
        Self { links: 0, buffers: 0, streams: 0, limit }
    }

    /// Returns the bytes that a packet with a content of `len` bytes counts.
    #[inline(always)]
    pub(crate) const fn cost(len: usize) -> u64 {
        len as u64 + PACKET_COST
    }

    #[inline(always)]
    pub(crate) const fn add(&mut self, place: Where, bytes: u64) {
        *self.of(place) += bytes;
    }

    #[inline(always)]
    pub(crate) const fn remove(&mut self, place: Where, bytes: u64) {
        let held = self.of(place);
        debug_assert!(*held >= bytes, "what goes was counted when it came");
        *held = held.saturating_sub(bytes);
    }

    #[inline(always)]
    const fn of(&mut self, place: Where) -> &mut u64 {
        match place {
            Where::Links => &mut self.links,
            Where::Buffers => &mut self.buffers,
            #[cfg(feature = "tcp")]
            Where::Streams => &mut self.streams,
        }
    }

    const fn total(&self) -> u64 {
        self.links + self.buffers + self.streams
    }

    /// Whether the run holds more than it may.
    #[inline(always)]
    pub(crate) const fn is_too_much(&self) -> bool {
        self.total() > self.limit
    }

    /// Fails the run, which holds [too much](Held::is_too_much): `sender` has sent last.
    ///
    /// # Panics
    ///
    /// Unless this thread panics already: a value that is dropped while it unwinds may send again.
    #[cold]
    #[inline(never)]
    #[expect(clippy::panic, reason = "the run would take all memory; names the sender, and the way out")]
    pub(crate) fn fail(&self, sender: impl fmt::Display) {
        if std::thread::panicking() {
            return;
        }
        panic!(
            "too many bytes are on their way: {sender} has sent, and the test bed now holds {} bytes that were sent and neither read nor lost, where its limit is {}: {} on \
             links, {} in buffers of sockets, {} in streams, where each packet counts {PACKET_COST} more than its content. Let the sender wait, for an answer or by \
             `sleep(..).await`, and let receivers read; `byte_limit` of the test bed sets another limit",
            self.total(),
            self.limit,
            self.links,
            self.buffers,
            self.streams
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_of_all_parts_together() {
        let mut held = Held::new(1000);
        held.add(Where::Links, Held::cost(100));
        held.add(Where::Buffers, 700);
        assert!(!held.is_too_much());
        held.add(Where::Links, 1);
        assert!(held.is_too_much());
        held.remove(Where::Buffers, 1);
        assert!(!held.is_too_much());
    }
}
