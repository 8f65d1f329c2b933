//! Number of bytes held by a run, and the limit of the number.

use std::fmt;

/// Default limit of the bytes that a run may hold: a gibibyte.
pub(crate) const BYTE_LIMIT: u64 = 1 << 30;

/// Memory of a packet besides the content \[byte\]: box, allocation, and entries in the queues of events and of sockets, which have up to twice as many entries
/// as packets. Hence packets without content count as well.
pub(crate) const PACKET_COST: u64 = 200;

/// Bytes that a run holds: sent, and neither read nor lost. Each byte is counted in exactly one of the three parts.
#[derive(Debug)]
pub(crate) struct Held {
    /// Bytes on links, with the queues of the links. Counted by the [`Wire`](super::Wire) only.
    links: u64,
    /// Bytes in the buffers of sockets, or handed to a node and not taken yet.
    buffers: u64,
    /// Bytes in TCP streams, at both ends: written and not acknowledged, or arrived and not read.
    streams: u64,
    limit: u64,
}

/// Part of a run that holds bytes.
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

    /// Returns the bytes counted for a packet with a content of `len` bytes.
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
        debug_assert!(*held >= bytes, "removed bytes were added before");
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

    /// Returns whether the run holds more than its limit.
    #[inline(always)]
    pub(crate) const fn is_too_much(&self) -> bool {
        self.total() > self.limit
    }

    /// Fails the run, which holds [too much](Held::is_too_much). `sender` is the sender of the last bytes.
    ///
    /// # Panics
    ///
    /// Always, except while this thread panics already: a value that is dropped during the unwinding may send again.
    #[cold]
    #[expect(clippy::panic, reason = "the run would take all memory; names the sender, and the way out")]
    pub(crate) fn fail(&self, sender: impl fmt::Display) {
        if std::thread::panicking() {
            return;
        }
        panic!(
            "too many bytes are under way after a send of {sender}: the test bed holds {} bytes that were sent and neither read nor lost, and its limit is {} \
             bytes. {} bytes are on links, {} in buffers of sockets and {} in streams; each packet counts {PACKET_COST} bytes more than its content. Let the \
             sender wait, for an answer or by `sleep(..).await`, and let receivers read. `byte_limit` of the test bed sets another limit",
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
