//! Octets that the program has written and the peer has not acknowledged.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use crate::sequence::Position;

/// Capacity above which an empty buffer releases its memory, so that an idle connection is small \[byte\].
pub(crate) const KEPT: usize = 1024;

/// Octets from the first unacknowledged octet on, sent or not.
#[derive(Clone, Debug)]
pub(crate) struct SendBuffer {
    /// The octet at index `i` has the position `start + i`.
    octets: VecDeque<u8>,
    /// Position of the first octet in the buffer.
    start: Position,
}

impl SendBuffer {
    pub(crate) const fn new(start: Position) -> Self {
        Self { octets: VecDeque::new(), start }
    }

    pub(crate) fn write(&mut self, data: &[u8]) {
        self.octets.extend(data);
    }

    pub(crate) fn len(&self) -> usize {
        self.octets.len()
    }

    /// Returns the position after the last octet.
    pub(crate) fn end(&self) -> Position {
        self.start + self.octets.len() as u64
    }

    /// Returns a copy of the octets from `start` to `end` (exclusive). Positions outside the buffer are left out.
    pub(crate) fn copy(&self, start: Position, end: Position) -> Vec<u8> {
        // Index of a position, cut to the buffer: 0 below the first octet, the length above the last octet.
        let at = |position: Position| usize::try_from(position.saturating_sub(self.start)).map_or(self.octets.len(), |at| at.min(self.octets.len()));
        let (from, to) = (at(start), at(end));
        // The ring has at most two contiguous parts.
        let (first, second) = self.octets.as_slices();
        let mut copy = Vec::with_capacity(to.saturating_sub(from));
        if from < first.len() {
            copy.extend_from_slice(&first[from..to.min(first.len())]);
        }
        if to > first.len() {
            copy.extend_from_slice(&second[from.saturating_sub(first.len())..to - first.len()]);
        }
        copy
    }

    /// Removes the octets below `position`.
    pub(crate) fn acknowledge(&mut self, position: Position) {
        // `position` may be one above the last octet: the acknowledgement of the FIN, which takes a position but no octet.
        let count = usize::try_from(position.saturating_sub(self.start)).map_or(self.octets.len(), |count| count.min(self.octets.len()));
        self.octets.drain(..count);
        self.start += count as u64;
        if self.octets.is_empty() && self.octets.capacity() > KEPT {
            self.octets = VecDeque::new();
        }
    }

    pub(crate) fn clear(&mut self) {
        self.acknowledge(self.end());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_across_the_seam_of_the_ring() {
        let mut buffer = SendBuffer::new(100);
        let text: Vec<u8> = (0..=255).collect();
        buffer.write(&text);
        for step in 0..50u64 {
            buffer.acknowledge(100 + (step + 1) * 5);
            let written: Vec<u8> = (0..5).map(|k| u8::try_from((256 + step * 5 + k) % 256).unwrap()).collect();
            buffer.write(&written);
            let start = 105 + step * 5;
            let all = buffer.copy(start, buffer.end());
            assert_eq!(all.len(), 256);
            assert!((start - 100..).zip(&all).all(|(at, octet)| u64::from(*octet) == at % 256));
            assert_eq!(buffer.copy(start + 3, start + 9), all[3..9]);
        }
        buffer.clear();
        assert_eq!((buffer.len(), buffer.copy(0, u64::MAX).len()), (0, 0));
    }
}
