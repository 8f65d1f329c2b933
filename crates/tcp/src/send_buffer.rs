//! Octets that the program has written and the peer has not acknowledged.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use bytes::{Bytes, BytesMut};

use crate::sequence::Position;

/// Least memory for octets that are written \[byte\], so that short writes share memory.
const LEAST_PIECE: usize = 1024;

/// Octets from the first unacknowledged octet on, sent or not. Segments share the memory of the buffer, so that an octet is copied once on its way from the
/// writer to the buffer, and once more by the reader.
#[derive(Clone, Debug)]
pub(crate) struct SendBuffer {
    /// Octets that segments may share, in the order of positions, with the position of the first octet of each piece.
    pieces: VecDeque<(Position, Bytes)>,
    /// Octets after the pieces. Later writes are appended while memory is left.
    tail: BytesMut,
    /// Position of the first octet in the buffer. The first piece may begin before this position.
    start: Position,
    /// Position after the last octet.
    end: Position,
}

impl SendBuffer {
    pub(crate) fn new(start: Position) -> Self {
        Self { pieces: VecDeque::new(), tail: BytesMut::new(), start, end: start }
    }

    pub(crate) fn write(&mut self, data: &[u8]) {
        if self.tail.capacity() - self.tail.len() < data.len() {
            self.share_tail();
            self.tail = BytesMut::with_capacity(data.len().max(LEAST_PIECE));
        }
        self.tail.extend_from_slice(data);
        self.end += data.len() as u64;
    }

    /// Moves the octets of the tail to the pieces. The tail keeps the rest of its memory.
    fn share_tail(&mut self) {
        if !self.tail.is_empty() {
            let start = self.end - self.tail.len() as u64;
            self.pieces.push_back((start, self.tail.split().freeze()));
        }
    }

    pub(crate) fn len(&self) -> usize {
        usize::try_from(self.end - self.start).unwrap_or(usize::MAX)
    }

    /// Returns the position after the last octet.
    pub(crate) const fn end(&self) -> Position {
        self.end
    }

    /// Returns the octets from `start` to `end` (exclusive), and the number of these octets. Positions outside the buffer are left out. Further octets may
    /// follow in the same memory. Only octets of several writes are copied.
    pub(crate) fn slice(&mut self, start: Position, end: Position) -> (Bytes, usize) {
        let (start, end) = (start.max(self.start), end.min(self.end));
        if start >= end {
            return (Bytes::new(), 0);
        }
        if end > self.end - self.tail.len() as u64 {
            self.share_tail();
        }
        let length = usize::try_from(end - start).unwrap_or(usize::MAX);
        // The pieces follow each other without gaps.
        let index = self.pieces.partition_point(|(at, piece)| at + piece.len() as u64 <= start);
        let offset = |at: Position, position: Position| usize::try_from(position.saturating_sub(at)).unwrap_or(usize::MAX);
        if let Some((at, piece)) = self.pieces.get(index).filter(|(at, piece)| end <= at + piece.len() as u64) {
            return (piece.slice(offset(*at, start)..), length);
        }
        let mut copy = Vec::with_capacity(length);
        for (at, piece) in self.pieces.range(index..).take_while(|(at, _)| *at < end) {
            copy.extend_from_slice(&piece[offset(*at, start)..offset(*at, end).min(piece.len())]);
        }
        (copy.into(), length)
    }

    /// Removes the octets below `position`.
    pub(crate) fn acknowledge(&mut self, position: Position) {
        // `position` may be one above the last octet: the acknowledgement of the FIN, which takes a position but no octet.
        self.start = position.clamp(self.start, self.end);
        if self.start == self.end {
            // An idle connection is to be small.
            (self.pieces, self.tail) = (VecDeque::new(), BytesMut::new());
        }
        while self.pieces.front().is_some_and(|(at, piece)| at + piece.len() as u64 <= self.start) {
            self.pieces.pop_front();
        }
    }

    pub(crate) fn clear(&mut self) {
        self.acknowledge(self.end());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slice(buffer: &mut SendBuffer, start: Position, end: Position) -> Bytes {
        let (octets, length) = buffer.slice(start, end);
        octets.slice(..length)
    }

    #[test]
    fn segments_of_several_writes_are_whole() {
        let mut buffer = SendBuffer::new(100);
        let text: Vec<u8> = (0..=255).collect();
        buffer.write(&text);
        for step in 0..50u64 {
            buffer.acknowledge(100 + (step + 1) * 5);
            let written: Vec<u8> = (0..5).map(|k| u8::try_from((256 + step * 5 + k) % 256).unwrap()).collect();
            buffer.write(&written);
            let start = 105 + step * 5;
            let end = buffer.end();
            let all = slice(&mut buffer, start, end);
            assert_eq!(all.len(), 256);
            assert!((start - 100..).zip(&all).all(|(at, octet)| u64::from(*octet) == at % 256));
            assert_eq!(slice(&mut buffer, start + 3, start + 9), all[3..9]);
        }
        buffer.clear();
        assert_eq!((buffer.len(), slice(&mut buffer, 0, u64::MAX).len()), (0, 0));
    }

    /// Short writes share a piece of memory, and segments within a piece copy nothing.
    #[test]
    fn segments_share_the_memory_of_the_writer() {
        let mut buffer = SendBuffer::new(0);
        for octet in 0..100 {
            buffer.write(&[octet]);
        }
        let whole = slice(&mut buffer, 0, 100);
        let part = slice(&mut buffer, 10, 20);
        assert_eq!((part.as_ptr(), part[0]), (whole[10..].as_ptr(), 10));
        // A later write does not change what was shared.
        buffer.write(&[100]);
        assert_eq!((slice(&mut buffer, 99, 101), whole.len()), (Bytes::from_static(&[99, 100]), 100));
    }
}
