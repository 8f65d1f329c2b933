//! Received octets: in order and unread, or out of order.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

use bytes::{Buf, Bytes};

use crate::memory;
use crate::ranges::Ranges;
use crate::segment::Payload;
use crate::sequence::Position;

/// Entries up to which an empty queue keeps its memory.
const KEPT: usize = 16;

/// Octets in order, for the program to read, and later pieces that wait for missing octets.
#[derive(Clone, Default, Debug)]
pub(crate) struct Assembler {
    /// Octets in order, not yet read by the program, as they arrived. No piece is empty.
    ready: VecDeque<Piece>,
    /// Number of octets in `ready`.
    unread: usize,
    /// Data out of order, by the position of its first octet.
    pieces: BTreeMap<Position, Bytes>,
    /// Number of octets in `pieces`.
    waiting: usize,
    /// Memory that the pieces take in Linux \[byte\].
    waiting_memory: usize,
    /// Memory that the octets in order take in Linux \[byte\].
    ready_memory: usize,
    /// Greatest length of `ready` since the program last read everything.
    longest: usize,
    /// Value of `longest` when the memory of the queue was last released.
    expected: usize,
    /// Positions of the octets in `pieces`, with neighbouring pieces joined to one range.
    ranges: Ranges,
    /// One position in each of the at most four ranges that changed last, the latest first (RFC 2018, section 4).
    recent: Vec<Position>,
}

/// Unread octets in order, of one segment, or of several segments of one length that follow each other in memory.
#[derive(Clone, Debug)]
struct Piece {
    /// Memory that begins with the octets. Octets that have not arrived may follow.
    memory: Bytes,
    /// Number of unread octets.
    unread: usize,
    /// Octets of each segment. Zero if the segment shares the cost of the piece before.
    size: usize,
    /// Number of segments with unread octets.
    count: usize,
    /// Octets of the first of these segments that were read.
    begun: usize,
    /// Memory in Linux of each segment but the last \[byte\], free once all octets of the segment were read.
    cost: usize,
    /// Memory in Linux of the last segment \[byte\]. Short segments share memory, which counts for the last one of them.
    last_cost: usize,
    /// Octets of later data that the memory of the last segment takes.
    room: usize,
}

impl Piece {
    /// Returns whether `data` is a segment of the same length as the segments of the piece, and follows in the same memory.
    fn goes_on_with(&self, data: &[u8]) -> bool {
        // The piece refers to the memory, so that equal addresses mean the same octets.
        data.len() == self.size
            && self.room < data.len()
            && self.memory.len() - self.unread >= data.len()
            && self.memory[self.unread..].as_ptr() == data.as_ptr()
    }

    /// Removes octets that were read, but not all. Returns the memory in Linux that is free then \[byte\].
    fn advance(&mut self, count: usize) -> usize {
        self.memory.advance(count);
        self.unread -= count;
        self.begun += count;
        if self.count == 1 {
            return 0;
        }
        let whole = self.begun / self.size;
        self.begun -= whole * self.size;
        self.count -= whole;
        whole * self.cost
    }
}

impl Assembler {
    /// Takes in `data`, whose first octet is at `start`. Moves `next`, the position of the first missing octet, over all octets now in order.
    pub(crate) fn insert(&mut self, next: &mut Position, start: Position, mut data: Bytes) {
        let end = start + data.len() as u64;
        if end <= *next {
            return;
        }
        // Index in `data`. Each position that is asked for lies between `start` and `end`.
        let offset = |position: Position| usize::try_from(position - start).unwrap_or(data.len());
        if start > *next {
            let (pieces, waiting, memory) = (&mut self.pieces, &mut self.waiting, &mut self.waiting_memory);
            // Only missing parts are kept, so that an octet that arrives twice counts once.
            self.ranges.insert(start, end, |from, to| {
                let piece = data.slice(offset(from)..offset(to));
                *waiting += piece.len();
                *memory += memory::of_received(piece.len()).0;
                let before = pieces.insert(from, piece);
                debug_assert!(before.is_none(), "only missing parts are inserted");
            });
            self.remember(start);
            return;
        }
        let known = offset(*next);
        data.advance(known);
        let length = data.len();
        self.hold(data, length);
        *next = end;
        if !self.ranges.is_empty() {
            self.join(next);
        }
    }

    /// Notes that the FIN at `position` has arrived out of order. The FIN takes a position, and is acknowledged selectively with the preceding octets.
    pub(crate) fn insert_fin(&mut self, position: Position) {
        self.ranges.insert(position, position + 1, |_, _| {});
        self.remember(position);
    }

    /// Appends the data of a segment that begins at the first missing octet. No data may wait out of order.
    pub(crate) fn append(&mut self, data: &mut Payload<'_>) {
        let length = data.len();
        if let Some(last) = self.ready.back_mut().filter(|last| last.goes_on_with(data)) {
            last.unread += length;
            last.count += 1;
            self.ready_memory += last.cost;
            self.unread += length;
            return;
        }
        self.hold(data.take_memory(), length);
    }

    /// Appends the first `length` octets of `memory`, which are in order. Short data may fit into the memory of the segment before.
    fn hold(&mut self, memory: Bytes, length: usize) {
        if length == 0 {
            return;
        }
        if self.ready.capacity() == 0 {
            // The next flight mostly has as many pieces as the last flight or twice as many, and growing piece by piece would copy the queue each time.
            self.ready.reserve(self.expected);
        }
        let (size, cost, room) = match self.ready.back_mut().filter(|last| last.room >= length) {
            Some(last) => (0, core::mem::take(&mut last.last_cost), core::mem::take(&mut last.room) - length),
            None => {
                let (cost, room) = memory::of_received(length);
                self.ready_memory += cost;
                (length, cost, room)
            }
        };
        self.unread += length;
        self.ready.push_back(Piece { memory, unread: length, size, count: 1, begun: 0, cost, last_cost: cost, room });
        self.longest = self.longest.max(self.ready.len());
    }

    /// Moves the pieces from `next` up to the first gap to the octets in order.
    fn join(&mut self, next: &mut Position) {
        while let Some(first) = self.pieces.first_entry().filter(|first| first.key() <= next) {
            let (start, mut piece) = first.remove_entry();
            self.waiting -= piece.len();
            self.waiting_memory -= memory::of_received(piece.len()).0;
            // The data in order may have ended inside this piece: its first `known` octets are already there.
            let known = usize::try_from(*next - start).map_or(piece.len(), |known| known.min(piece.len()));
            *next += (piece.len() - known) as u64;
            piece.advance(known);
            let length = piece.len();
            self.hold(piece, length);
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

    pub(crate) const fn unread(&self) -> usize {
        self.unread
    }

    /// Returns the number of octets held, in order or not.
    pub(crate) const fn held(&self) -> usize {
        self.unread + self.waiting
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
        let mut count = 0;
        for Piece { memory, unread, .. } in &self.ready {
            let room = &mut to[count..];
            if room.is_empty() {
                break;
            }
            let taken = room.len().min(*unread);
            room[..taken].copy_from_slice(&memory[..taken]);
            count += taken;
        }
        count
    }

    /// Moves octets in order into `to`. Returns the number of octets.
    pub(crate) fn read(&mut self, to: &mut [u8]) -> usize {
        let count = self.peek(to);
        self.unread -= count;
        let mut left = count;
        while let Some(first) = self.ready.front_mut().filter(|_| left > 0) {
            if left < first.unread {
                self.ready_memory -= first.advance(left);
                break;
            }
            left -= first.unread;
            self.ready_memory -= (first.count - 1) * first.cost + first.last_cost;
            self.ready.pop_front();
        }
        if self.unread == 0 {
            let longest = core::mem::take(&mut self.longest);
            // An empty queue keeps its capacity, and an idle connection is to be small.
            if self.ready.capacity() > KEPT {
                (self.ready, self.expected) = (VecDeque::new(), longest);
            }
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
mod tests;
