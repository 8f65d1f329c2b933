//! What was received: in order and unread, or out of order.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

use crate::ranges::Ranges;
use crate::send_buffer::KEPT;
use crate::sequence::Position;

/// Octets in order, which can be read, and pieces that wait for missing ones before them.
#[derive(Clone, Default, Debug)]
pub(crate) struct Assembler {
    ready: VecDeque<u8>,
    pieces: BTreeMap<Position, Vec<u8>>,
    /// Octets in `pieces`.
    waiting: usize,
    ranges: Ranges,
    /// A position in each of the ranges that changed last, the latest first (RFC 2018, section 4).
    recent: Vec<Position>,
}

impl Assembler {
    /// Takes data in whose first octet is at `start`, and moves `next`, the first octet that is missing, on.
    pub(crate) fn insert(&mut self, next: &mut Position, start: Position, data: &[u8]) {
        let end = start + data.len() as u64;
        if end <= *next {
            return;
        }
        let offset = |position: Position| usize::try_from(position - start).unwrap_or(data.len());
        if start > *next {
            let (pieces, waiting) = (&mut self.pieces, &mut self.waiting);
            self.ranges.insert(start, end, |from, to| {
                let piece = data[offset(from)..offset(to)].to_vec();
                *waiting += piece.len();
                let before = pieces.insert(from, piece);
                *waiting -= before.map_or(0, |piece| piece.len());
            });
            self.remember(start);
            return;
        }
        self.ready.extend(&data[offset(*next)..]);
        *next = end;
        if !self.ranges.is_empty() {
            self.join(next);
        }
    }

    /// Appends the pieces that now follow.
    fn join(&mut self, next: &mut Position) {
        while let Some(first) = self.pieces.first_entry().filter(|first| first.key() <= next) {
            let (start, piece) = first.remove_entry();
            self.waiting -= piece.len();
            let known = usize::try_from(*next - start).map_or(piece.len(), |known| known.min(piece.len()));
            self.ready.extend(&piece[known..]);
            *next += (piece.len() - known) as u64;
        }
        self.ranges.remove_below(*next);
        if self.ranges.is_empty() {
            self.recent = Vec::new();
        }
    }

    fn remember(&mut self, position: Position) {
        let Some((start, end)) = self.ranges.around(position) else { return };
        self.recent.retain(|other| !(start..end).contains(other));
        self.recent.insert(0, position);
        self.recent.truncate(4);
    }

    /// The ranges out of order that changed last, the latest first, four at most.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = (Position, Position)> {
        self.recent.iter().filter_map(|position| self.ranges.around(*position))
    }

    /// The range out of order that holds all of this, if one does.
    pub(crate) fn holding(&self, start: Position, end: Position) -> Option<(Position, Position)> {
        self.ranges.around(start).filter(|range| range.1 >= end)
    }

    /// Whether pieces wait for missing ones.
    pub(crate) fn has_gaps(&self) -> bool {
        !self.ranges.is_empty()
    }

    pub(crate) fn unread(&self) -> usize {
        self.ready.len()
    }

    /// Octets that lie here, in order or not.
    pub(crate) fn held(&self) -> usize {
        self.ready.len() + self.waiting
    }

    /// Copies what can be read, without taking it.
    pub(crate) fn peek(&self, to: &mut [u8]) -> usize {
        let (first, second) = self.ready.as_slices();
        let count = to.len().min(self.ready.len());
        let split = count.min(first.len());
        to[..split].copy_from_slice(&first[..split]);
        to[split..count].copy_from_slice(&second[..count - split]);
        count
    }

    pub(crate) fn read(&mut self, to: &mut [u8]) -> usize {
        let count = self.peek(to);
        self.ready.drain(..count);
        if self.ready.is_empty() && self.ready.capacity() > KEPT {
            self.ready = VecDeque::new();
        }
        count
    }

    /// Lets go of the pieces out of order, which nobody will complete.
    pub(crate) fn forget_gaps(&mut self) {
        self.pieces.clear();
        self.waiting = 0;
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
            let mut read = vec![0; 300];
            let count = assembler.read(&mut read);
            prop_assert_eq!(&read[..count], &text[..count]);
        }
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
