//! Datagrams that are to be sent, in one piece of memory, so that several can go in one call.

use std::net::SocketAddr;

use super::Ecn;

/// Datagrams in the order in which they were queued, their bytes one after the other.
#[derive(Debug, Default)]
pub(super) struct Outbox {
    entries: Vec<Entry>,
    bytes: Vec<u8>,
    /// Those before have been sent or given up.
    done: usize,
    /// The bytes of those before.
    bytes_done: usize,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Entry {
    to: SocketAddr,
    ecn: Option<Ecn>,
    len: usize,
}

/// Datagrams that can go in one call: all as long as `segment`, but for the last, which may be shorter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Run<'a> {
    pub(super) to: SocketAddr,
    pub(super) ecn: Option<Ecn>,
    pub(super) bytes: &'a [u8],
    pub(super) segment: usize,
    pub(super) count: usize,
}

/// Longer ones go alone. Every IPv6 network takes 1,280 bytes (RFC 8200, section 5), 48 of them headers: no segment is too long for the way.
const LONGEST_SEGMENT: usize = 1232;

/// The bytes of a call: what fits into one IPv4 datagram, for before it is cut the kernel sees it as one.
const MOST_BYTES: usize = 65_000;

impl Outbox {
    pub(super) fn push(&mut self, to: SocketAddr, bytes: &[u8], ecn: Option<Ecn>) {
        self.entries.push(Entry { to, ecn, len: bytes.len() });
        self.bytes.extend_from_slice(bytes);
    }

    /// How many wait.
    pub(super) fn len(&self) -> usize {
        self.entries.len() - self.done
    }

    /// The first of those that wait, with those after it that can go in the same call, at most `most`.
    pub(super) fn next_run(&self, most: usize) -> Option<Run<'_>> {
        let waiting = &self.entries[self.done..];
        let (first, rest) = waiting.split_first()?;
        let (mut count, mut len, mut open) = (1, first.len, first.len > 0 && first.len <= LONGEST_SEGMENT);
        for next in rest.iter().take(most.saturating_sub(1)) {
            let joins = open && next.to == first.to && next.ecn == first.ecn && (1..=first.len).contains(&next.len) && len + next.len <= MOST_BYTES;
            if !joins {
                break;
            }
            count += 1;
            len += next.len;
            // A shorter one ends the run: the kernel cuts at every multiple of the length of the first.
            open = next.len == first.len;
        }
        let bytes = &self.bytes[self.bytes_done..self.bytes_done + len];
        Some(Run { to: first.to, ecn: first.ecn, bytes, segment: first.len, count })
    }

    /// The first `count` that wait need not wait any more.
    pub(super) fn take(&mut self, count: usize) {
        let taken = &self.entries[self.done..self.done + count];
        self.bytes_done += taken.iter().map(|entry| entry.len).sum::<usize>();
        self.done += count;
        if self.done == self.entries.len() {
            // The memory is kept.
            self.entries.clear();
            self.bytes.clear();
            (self.done, self.bytes_done) = (0, 0);
        }
    }

    /// Moves those that wait to the front of the memory.
    pub(super) fn close_up(&mut self) {
        self.entries.drain(..self.done);
        self.bytes.drain(..self.bytes_done);
        (self.done, self.bytes_done) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn address(port: u16) -> SocketAddr {
        ([127, 0, 0, 1], port).into()
    }

    /// The lengths of the datagrams that the kernel makes of a run.
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

    proptest! {
        /// Whatever is queued comes out once, in order, to whom it was meant, in calls that the kernel takes.
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
