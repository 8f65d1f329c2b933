//! Number of bytes held by a run, and the limit of the number.

use std::fmt;

/// Default limit of the bytes that a run may hold: a gibibyte.
pub(crate) const BYTE_LIMIT: u64 = 1 << 30;

/// Memory of a packet besides the content \[byte\]: box, allocation, and entries in the queues of events and of sockets, which have up to twice as many entries
/// as packets. Hence packets without content count as well.
pub(crate) const PACKET_COST: u64 = 200;

/// Bytes that a run holds: sent, and neither read nor lost. A packet is added on entering its link, or its own host over loopback, and removed after being
/// read or lost. In between, on the links and in the buffers of sockets and nodes, nothing is counted: only the message of a failure needs the parts.
#[derive(Debug)]
pub(crate) struct Held {
    total: u64,
    /// Part of `total` in TCP streams, at both ends: written and not acknowledged, or arrived and not read.
    streams: u64,
    limit: u64,
}

impl Held {
    pub(super) const fn new(limit: u64) -> Self {
        Self { total: 0, streams: 0, limit }
    }

    /// Returns the bytes counted for a packet with a content of `len` bytes.
    pub(crate) const fn cost(len: usize) -> u64 {
        len as u64 + PACKET_COST
    }

    /// Returns the bytes counted for `packets` packets with a content of `len` bytes together.
    #[cfg(feature = "tcp")]
    pub(crate) const fn cost_of(packets: usize, len: usize) -> u64 {
        len as u64 + packets as u64 * PACKET_COST
    }

    #[inline(always)]
    pub(crate) const fn add(&mut self, bytes: u64) {
        self.total += bytes;
    }

    /// Removes bytes that were [added](Held::add).
    #[inline(always)]
    pub(crate) const fn remove(&mut self, bytes: u64) {
        debug_assert!(self.total >= bytes, "removed bytes were added before");
        self.total -= bytes;
    }

    /// Changes the bytes of a TCP stream from `before` to `now`.
    #[cfg(feature = "tcp")]
    pub(crate) const fn recount_stream(&mut self, before: u64, now: u64) {
        self.total = self.total + now - before;
        self.streams = self.streams + now - before;
    }

    /// Returns whether the run holds more than its limit.
    #[inline(always)]
    pub(crate) const fn is_too_much(&self) -> bool {
        self.total > self.limit
    }

    /// Fails the run, which holds [too much](Held::is_too_much). `sender` is the sender of the last bytes. `buffers` is the part of the bytes in the buffers of
    /// sockets, or handed to a node and not taken yet.
    ///
    /// # Panics
    ///
    /// Always, except while this thread panics already: a value that is dropped during the unwinding may send again.
    #[cold]
    #[expect(clippy::panic, reason = "the run would take all memory; names the sender, and the way out")]
    pub(crate) fn fail(&self, sender: impl fmt::Display, buffers: u64) {
        if std::thread::panicking() {
            return;
        }
        panic!(
            "too many bytes are under way after a send of {sender}: the test bed holds {} bytes that were sent and neither read nor lost, and its limit is {} \
             bytes. {} bytes are on links, {buffers} in buffers of sockets and {} in streams; each packet counts {PACKET_COST} bytes more than its content. \
             Let the sender wait, for an answer or by `sleep(..).await`, and let receivers read. `byte_limit` of the test bed sets another limit",
            self.total,
            self.limit,
            self.total - self.streams - buffers,
            self.streams
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_of_packets_and_streams_together() {
        let mut held = Held::new(1000);
        held.add(Held::cost(100));
        held.add(700);
        assert!(!held.is_too_much());
        held.add(1);
        assert!(held.is_too_much());
        held.remove(1);
        assert!(!held.is_too_much());
    }

    #[cfg(feature = "tcp")]
    #[test]
    fn streams_are_counted_by_their_changes() {
        let mut held = Held::new(1000);
        for (before, now, is_too_much) in [(0, 1001, true), (1001, 3, false), (3, 0, false)] {
            held.recount_stream(before, now);
            assert_eq!((held.is_too_much(), held.total, held.streams), (is_too_much, now, now));
        }
    }
}
