//! Received octets: in order and unread, or out of order.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

use crate::memory;
use crate::ranges::Ranges;
use crate::send_buffer::KEPT;
use crate::sequence::Position;

/// Octets in order, which the program can read, and pieces that wait for missing octets before them.
#[derive(Clone, Default, Debug)]
pub(crate) struct Assembler {
    /// Octets in order, not yet read by the program.
    ready: VecDeque<u8>,
    /// Data out of order, by the position of its first octet.
    pieces: BTreeMap<Position, Vec<u8>>,
    /// Number of octets in `pieces`.
    waiting: usize,
    /// Memory that the pieces take in Linux \[byte\].
    waiting_memory: usize,
    /// Segments of the octets in order, with their memory.
    segments: VecDeque<Held>,
    /// Memory of `segments` \[byte\].
    ready_memory: usize,
    /// Positions of the octets in `pieces`, with neighbouring pieces joined to one range.
    ranges: Ranges,
    /// One position in each of the at most four ranges that changed last, the latest first (RFC 2018, section 4).
    recent: Vec<Position>,
}

/// Memory of unread octets in order.
#[derive(Clone, Copy, Debug)]
struct Held {
    /// Octets that were not read.
    octets: usize,
    /// Memory that is free once all octets were read \[byte\].
    memory: usize,
    /// Octets of later data that the same memory takes.
    room: usize,
}

impl Assembler {
    /// Takes in `data`, whose first octet is at `start`. Moves `next`, the position of the first missing octet, over all octets now in order.
    pub(crate) fn insert(&mut self, next: &mut Position, start: Position, data: &[u8]) {
        let end = start + data.len() as u64;
        if end <= *next {
            return;
        }
        // Index in `data`. Each position that is asked for lies between `start` and `end`.
        let offset = |position: Position| usize::try_from(position - start).unwrap_or(data.len());
        if start > *next {
            let (pieces, waiting, memory) = (&mut self.pieces, &mut self.waiting, &mut self.waiting_memory);
            // Only missing parts are copied, so that an octet that arrives twice takes memory once.
            self.ranges.insert(start, end, |from, to| {
                let piece = data[offset(from)..offset(to)].to_vec();
                *waiting += piece.len();
                *memory += memory::of_received(piece.len()).0;
                let before = pieces.insert(from, piece);
                debug_assert!(before.is_none(), "only missing parts are inserted");
            });
            self.remember(start);
            return;
        }
        self.hold(&data[offset(*next)..]);
        *next = end;
        if !self.ranges.is_empty() {
            self.join(next);
        }
    }

    /// Notes that the FIN at `position` has arrived out of order. It takes a position, and is acknowledged selectively with the octets before it.
    pub(crate) fn insert_fin(&mut self, position: Position) {
        self.ranges.insert(position, position + 1, |_, _| {});
        self.remember(position);
    }

    /// Appends octets in order. Short data may fit into the memory of the segment before.
    fn hold(&mut self, data: &[u8]) {
        self.ready.extend(data);
        if let Some(last) = self.segments.back_mut().filter(|last| last.room >= data.len()) {
            (last.octets, last.room) = (last.octets + data.len(), last.room - data.len());
            return;
        }
        let (memory, room) = memory::of_received(data.len());
        self.segments.push_back(Held { octets: data.len(), memory, room });
        self.ready_memory += memory;
    }

    /// Moves the pieces from `next` up to the first gap to the octets in order.
    fn join(&mut self, next: &mut Position) {
        while let Some(first) = self.pieces.first_entry().filter(|first| first.key() <= next) {
            let (start, piece) = first.remove_entry();
            self.waiting -= piece.len();
            self.waiting_memory -= memory::of_received(piece.len()).0;
            // The data in order may have ended inside this piece: its first `known` octets are already there.
            let known = usize::try_from(*next - start).map_or(piece.len(), |known| known.min(piece.len()));
            self.hold(&piece[known..]);
            *next += (piece.len() - known) as u64;
        }
        self.ranges.remove_below(*next);
        if self.ranges.is_empty() {
            self.recent = Vec::new();
        }
    }

    /// Notes that the range around `position` has changed last.
    fn remember(&mut self, position: Position) {
        let Some((start, end)) = self.ranges.around(position) else { return };
        // The range may have grown over other noted ranges. One position for each range is enough.
        self.recent.retain(|other| !(start..end).contains(other));
        self.recent.insert(0, position);
        self.recent.truncate(4);
    }

    /// Returns the ranges out of order that changed last, at most four, the latest first.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = (Position, Position)> {
        self.recent.iter().filter_map(|position| self.ranges.around(*position))
    }

    /// Returns the first range out of order that has positions from `start` to `end` (exclusive).
    pub(crate) fn first_within(&self, start: Position, end: Position) -> Option<(Position, Position)> {
        self.ranges.first_within(start, end)
    }

    /// Returns whether data out of order waits for missing octets.
    pub(crate) fn has_gaps(&self) -> bool {
        !self.ranges.is_empty()
    }

    pub(crate) fn unread(&self) -> usize {
        self.ready.len()
    }

    /// Returns the number of octets held, in order or not.
    pub(crate) fn held(&self) -> usize {
        self.ready.len() + self.waiting
    }

    /// Returns the memory that Linux counts for all octets held \[byte\].
    pub(crate) const fn memory(&self) -> usize {
        self.ready_memory + self.waiting_memory
    }

    /// Returns the end (exclusive) of the data out of order.
    pub(crate) fn end(&self) -> Option<Position> {
        self.ranges.end()
    }

    /// Copies octets in order into `to` and keeps the octets. Returns the number of octets.
    pub(crate) fn peek(&self, to: &mut [u8]) -> usize {
        // The ring has at most two contiguous parts.
        let (first, second) = self.ready.as_slices();
        let count = to.len().min(self.ready.len());
        let split = count.min(first.len());
        to[..split].copy_from_slice(&first[..split]);
        to[split..count].copy_from_slice(&second[..count - split]);
        count
    }

    /// Moves octets in order into `to`. Returns the number of octets.
    pub(crate) fn read(&mut self, to: &mut [u8]) -> usize {
        let count = self.peek(to);
        self.ready.drain(..count);
        let mut left = count;
        while let Some(first) = self.segments.front_mut().filter(|first| left > 0 || first.octets == 0) {
            let taken = left.min(first.octets);
            (first.octets, left) = (first.octets - taken, left - taken);
            // The memory of a segment is free once all of its octets were read.
            if first.octets == 0 {
                self.ready_memory -= first.memory;
                self.segments.pop_front();
            }
        }
        // An empty ring keeps its capacity, and an idle connection is to be small.
        if self.ready.is_empty() && self.ready.capacity() > KEPT {
            self.ready = VecDeque::new();
        }
        if self.segments.is_empty() {
            self.segments = VecDeque::new();
        }
        count
    }

    /// Drops the data out of order, because the missing octets will not arrive any more.
    pub(crate) fn forget_gaps(&mut self) {
        self.pieces.clear();
        (self.waiting, self.waiting_memory) = (0, 0);
        self.ranges.clear();
        self.recent = Vec::new();
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn pieces_in_any_order_make_the_text(starts in prop::collection::vec((0usize..200, 1usize..60), 0..80)) {
            let text: Vec<u8> = (0..=255).collect();
            let (mut assembler, mut next, mut covered) = (Assembler::default(), 1000, [false; 256]);
            for (start, length) in starts {
                let end = (start + length).min(256);
                assembler.insert(&mut next, 1000 + start as u64, &text[start..end]);
                covered[start..end].fill(true);
                let expected = covered.iter().position(|is_there| !is_there).unwrap_or(256);
                prop_assert_eq!((next, assembler.unread()), (1000 + expected as u64, expected));
                for (from, to) in assembler.blocks() {
                    let span = usize::try_from(from - 1000).unwrap()..usize::try_from(to - 1000).unwrap();
                    prop_assert!(span.start > expected && covered[span].iter().all(|is_there| *is_there));
                }
                prop_assert_eq!(assembler.has_gaps(), covered[expected..].contains(&true));
                prop_assert_eq!(assembler.held(), assembler.unread() + assembler.pieces.values().map(Vec::len).sum::<usize>());
            }
            let memory = |octets: usize| memory::of_received(octets).0;
            prop_assert_eq!(assembler.waiting_memory, assembler.pieces.values().map(|piece| memory(piece.len())).sum::<usize>());
            prop_assert_eq!(assembler.ready_memory, assembler.segments.iter().map(|held| held.memory).sum::<usize>());
            prop_assert_eq!(assembler.unread(), assembler.segments.iter().map(|held| held.octets).sum::<usize>());
            let mut read = vec![0; 300];
            let count = assembler.read(&mut read);
            prop_assert_eq!(&read[..count], &text[..count]);
            prop_assert_eq!(assembler.ready_memory, 0);
        }
    }

    /// A segment of 1448 octets takes 2304 octets of memory until its last octet is read. A segment of 50 octets takes 832, which have room for 147 octets more.
    #[test]
    fn memory_is_free_when_the_last_octet_of_a_segment_is_read() {
        let (mut assembler, mut next) = (Assembler::default(), 0);
        let insert = |assembler: &mut Assembler, next: &mut u64, octets: usize| {
            assembler.insert(next, *next, &vec![0; octets]);
            assembler.memory()
        };
        assert_eq!([1448, 1448].map(|octets| insert(&mut assembler, &mut next, octets)), [2304, 4608]);
        assert_eq!([1000, 447, 1, 1448].map(|octets| (assembler.read(&mut vec![0; octets]), assembler.memory()).1), [4608, 4608, 2304, 0]);
        assert_eq!([50, 147, 1].map(|octets| insert(&mut assembler, &mut next, octets)), [832, 832, 1664]);
        let gap = next + 10;
        assembler.insert(&mut next, gap, &[0; 10]);
        assert_eq!(assembler.memory(), 2496);
        assembler.forget_gaps();
        assert_eq!(assembler.memory(), 1664);
    }

    #[test]
    fn the_block_that_changed_last_comes_first() {
        let (mut assembler, mut next) = (Assembler::default(), 0);
        for start in [10, 30, 50, 70, 90, 31] {
            assembler.insert(&mut next, start, &[0; 5]);
        }
        let blocks: Vec<_> = assembler.blocks().collect();
        assert_eq!(blocks, [(30, 36), (90, 95), (70, 75), (50, 55)]);
    }
}
