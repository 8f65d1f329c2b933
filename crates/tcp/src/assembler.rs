//! Received octets: in order and unread, or out of order.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

use bytes::{Buf, Bytes};

use crate::memory;
use crate::ranges::Ranges;
use crate::sequence::Position;

/// Entries up to which an empty queue keeps its memory.
const KEPT: usize = 16;

/// Octets in order, for the program to read, and later pieces that wait for missing octets.
#[derive(Clone, Default, Debug)]
pub(crate) struct Assembler {
    /// Octets in order, not yet read by the program, as they arrived. No piece is empty.
    ready: VecDeque<Bytes>,
    /// Number of octets in `ready`.
    unread: usize,
    /// Data out of order, by the position of its first octet.
    pieces: BTreeMap<Position, Bytes>,
    /// Number of octets in `pieces`.
    waiting: usize,
    /// Memory that the pieces take in Linux \[byte\].
    waiting_memory: usize,
    /// Segments of the octets in order, with their memory.
    segments: VecDeque<Held>,
    /// Memory of `segments` \[byte\].
    ready_memory: usize,
    /// Greatest length of `ready` since the program last read everything.
    longest: usize,
    /// Value of `longest` when the memory of the queues was last released.
    expected: usize,
    /// Positions of the octets in `pieces`, with neighbouring pieces joined to one range.
    ranges: Ranges,
    /// One position in each of the at most four ranges that changed last, the latest first (RFC 2018, section 4).
    recent: Vec<Position>,
}

/// Memory of unread octets in order.
#[derive(Clone, Copy, Debug)]
struct Held {
    /// Number of unread octets.
    octets: usize,
    /// Memory that is free once all octets were read \[byte\].
    memory: usize,
    /// Octets of later data that the same memory takes.
    room: usize,
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
        self.hold(data);
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

    /// Appends octets in order. Short data may fit into the memory of the segment before.
    fn hold(&mut self, data: Bytes) {
        let octets = data.len();
        if self.ready.capacity() == 0 {
            // The next flight mostly has as many segments as the last flight or twice as many, and growing piece by piece would copy the queues each time.
            self.ready.reserve(self.expected);
            self.segments.reserve(self.expected);
        }
        if let Some(last) = self.segments.back_mut().filter(|last| last.room >= octets) {
            (last.octets, last.room) = (last.octets + octets, last.room - octets);
        } else {
            let (memory, room) = memory::of_received(octets);
            self.segments.push_back(Held { octets, memory, room });
            self.ready_memory += memory;
        }
        if octets > 0 {
            self.unread += octets;
            self.ready.push_back(data);
            self.longest = self.longest.max(self.ready.len());
        }
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
            self.hold(piece);
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
        for piece in &self.ready {
            let room = &mut to[count..];
            if room.is_empty() {
                break;
            }
            let taken = piece.len().min(room.len());
            room[..taken].copy_from_slice(&piece[..taken]);
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
            let taken = left.min(first.len());
            left -= taken;
            if taken == first.len() {
                self.ready.pop_front();
            } else {
                first.advance(taken);
            }
        }
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
        if self.unread == 0 {
            let longest = core::mem::take(&mut self.longest);
            // An empty queue keeps its capacity, and an idle connection is to be small.
            if self.ready.capacity().max(self.segments.capacity()) > KEPT {
                (self.ready, self.segments, self.expected) = (VecDeque::new(), VecDeque::new(), longest);
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
