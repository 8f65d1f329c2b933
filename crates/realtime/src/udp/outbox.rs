//! Datagrams waiting to be sent. The bytes are contiguous, so that several datagrams can go in one call of the kernel.

use std::net::SocketAddr;

use super::Ecn;

/// Queue of datagrams. The bytes of the datagrams follow each other in the same order.
#[derive(Debug, Default)]
pub(super) struct Outbox {
    /// Datagrams in the order of the queue; the first `done` have left.
    entries: Vec<Entry>,
    /// Bytes of all datagrams in `entries`.
    bytes: Vec<u8>,
    /// Number of entries at the front, already sent or given up.
    done: usize,
    /// Number of bytes of the first `done` entries.
    bytes_done: usize,
}

/// Datagram without its bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Entry {
    to: SocketAddr,
    ecn: Option<Ecn>,
    len: usize,
}

/// Datagrams for one call. All datagrams are `segment` bytes long; the last datagram can be shorter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Run<'a> {
    /// Receiver of all datagrams.
    pub(super) to: SocketAddr,
    /// Congestion bits of all datagrams.
    pub(super) ecn: Option<Ecn>,
    /// Payloads, one after the other.
    pub(super) bytes: &'a [u8],
    /// Length of every payload \[bytes\], of which only the last payload may be shorter.
    pub(super) segment: usize,
    /// Number of datagrams, at least one.
    pub(super) count: usize,
}

/// Longest datagram that may share a call \[bytes\]. Every IPv6 network takes packets of 1,280 bytes (RFC 8200, section 5), of which 48 are headers, so no
/// segment exceeds the path.
const LONGEST_SEGMENT: usize = 1232;

/// Bytes in one call, at most. The kernel treats the call as one IPv4 datagram before it cuts the datagram.
const MOST_BYTES: usize = 65_000;

impl Outbox {
    /// Appends a datagram.
    pub(super) fn push(&mut self, to: SocketAddr, bytes: &[u8], ecn: Option<Ecn>) {
        self.entries.push(Entry { to, ecn, len: bytes.len() });
        self.bytes.extend_from_slice(bytes);
    }

    /// Returns the number of waiting datagrams.
    pub(super) fn len(&self) -> usize {
        self.entries.len() - self.done
    }

    /// Returns the first waiting datagram with the following datagrams for the same call, at most `most` datagrams, or `None` if no datagram waits.
    pub(super) fn next_run(&self, most: usize) -> Option<Run<'_>> {
        let waiting = &self.entries[self.done..];
        let (first, rest) = waiting.split_first()?;
        // An empty datagram goes alone: the kernel would cut no empty segment.
        let (mut count, mut len, mut open) = (1, first.len, first.len > 0 && first.len <= LONGEST_SEGMENT);
        for next in rest.iter().take(most.saturating_sub(1)) {
            let joins = open && next.to == first.to && next.ecn == first.ecn && (1..=first.len).contains(&next.len) && len + next.len <= MOST_BYTES;
            if !joins {
                break;
            }
            count += 1;
            len += next.len;
            // A shorter datagram ends the run, because the kernel cuts at every multiple of the first datagram's length.
            open = next.len == first.len;
        }
        // The bytes of waiting datagrams follow `bytes_done` without gaps.
        let bytes = &self.bytes[self.bytes_done..self.bytes_done + len];
        Some(Run { to: first.to, ecn: first.ecn, bytes, segment: first.len, count })
    }

    /// Removes the first `count` waiting datagrams. At least `count` datagrams must be waiting.
    pub(super) fn take(&mut self, count: usize) {
        let taken = &self.entries[self.done..self.done + count];
        self.bytes_done += taken.iter().map(|entry| entry.len).sum::<usize>();
        self.done += count;
        if self.done == self.entries.len() {
            // Nothing waits. Both vectors keep their memory.
            self.entries.clear();
            self.bytes.clear();
            (self.done, self.bytes_done) = (0, 0);
        }
    }

    /// Moves the waiting datagrams to the front of the memory. Otherwise a socket with a full buffer would keep the datagrams already sent.
    pub(super) fn close_up(&mut self) {
        self.entries.drain(..self.done);
        self.bytes.drain(..self.bytes_done);
        (self.done, self.bytes_done) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    fn address(port: u16) -> SocketAddr {
        ([127, 0, 0, 1], port).into()
    }

    /// Returns the datagrams made from a run by the kernel.
    fn cut(run: &Run<'_>) -> Vec<Vec<u8>> {
        if run.count == 1 { vec![run.bytes.to_vec()] } else { run.bytes.chunks(run.segment).map(<[u8]>::to_vec).collect() }
    }

    #[test]
    fn alike_datagrams_go_together_and_a_shorter_one_is_the_last() {
        let mut outbox = Outbox::default();
        for (to, len) in [(1, 8), (1, 8), (1, 3), (1, 3), (2, 3), (2, 9), (1, 2000), (1, 2000), (1, 0), (1, 0)] {
            outbox.push(address(to), &vec![7; len], None);
        }
        let mut counts = Vec::new();
        while let Some(run) = outbox.next_run(64) {
            counts.push(run.count);
            let count = run.count;
            outbox.take(count);
        }
        assert_eq!(counts, [3, 1, 1, 1, 1, 1, 1, 1]);
        assert_eq!((outbox.len(), outbox.bytes.len()), (0, 0));
    }

    properties! {
        /// Each queued datagram comes out once, in order, to its receiver, in calls that the kernel takes.
        #[test]
        fn runs_are_the_datagrams_that_were_queued(
            queued in prop::collection::vec((1_u16..3, 0_usize..40, any::<bool>(), 1_usize..30), 0..60), most in 1_usize..70, closes in any::<bool>(),
        ) {
            let mut outbox = Outbox::default();
            let mut expected = Vec::new();
            for (place, (to, len, marked, times)) in queued.iter().enumerate() {
                for _ in 0..*times {
                    let bytes = vec![u8::try_from(place).unwrap(); len * len];
                    let ecn = marked.then_some(Ecn::Ect0);
                    outbox.push(address(*to), &bytes, ecn);
                    expected.push((address(*to), ecn, bytes));
                }
            }
            let mut found = Vec::new();
            while let Some(run) = outbox.next_run(most) {
                prop_assert!(run.count <= most && run.bytes.len() <= MOST_BYTES);
                let datagrams = cut(&run);
                prop_assert_eq!(datagrams.len(), run.count);
                found.extend(datagrams.into_iter().map(|bytes| (run.to, run.ecn, bytes)));
                let count = run.count;
                outbox.take(count);
                if closes {
                    outbox.close_up();
                }
                prop_assert_eq!(outbox.len() + found.len(), expected.len());
            }
            prop_assert_eq!(found, expected);
        }
    }
}
