//! Flag PSH of new data. Linux sorts what the program writes into buffers, and marks the buffer at which a call ends, or at which more than half of the peer's
//! largest window was written since the last mark (`tcp_sendmsg_locked`, `tcp_push`, `forced_push`).

use alloc::collections::VecDeque;

use super::Connection;
use crate::pace::LONGEST_BURST;
use crate::sequence::Position;

/// Ends of marked buffers whose octets were not sent.
#[derive(Clone, Debug)]
pub(super) struct Pushes {
    /// `true` from a write of the program until `poll_transmit` has returned all segments that may leave: Linux sends these segments within the call.
    pub(super) is_writing: bool,
    /// Position of the beginning of the last buffer. Sent octets have left the buffer.
    begin: Position,
    /// Ends of the marked buffers, in ascending order. A segment that ends at or beyond a mark has the flag PSH.
    marks: VecDeque<Position>,
    /// End of the octets that were written when a mark was set last (`pushed_seq`).
    pushed: Position,
}

impl Pushes {
    /// Returns no marks. The first octet of data will have the position `start`.
    pub(super) const fn new(start: Position) -> Self {
        Self { is_writing: false, begin: start, marks: VecDeque::new(), pushed: start }
    }

    /// Sorts the octets from `start` to `end` (exclusive), at least one, into buffers of `full` octets. All octets below `next` were sent. A full buffer is
    /// marked if more than `most` octets were written since the last mark.
    fn write(&mut self, [start, end]: [Position; 2], next: Position, full: u64, most: u64) {
        self.begin = self.begin.max(next);
        // The last buffer grows beyond the end of the earlier call, unless the buffer is full.
        if start - self.begin < full && self.marks.back() == Some(&start) {
            self.marks.pop_back();
        }
        let mut at = start;
        while at < end {
            if at - self.begin >= full {
                self.begin = at;
            }
            at = end.min(self.begin + full);
            if at == end || at > self.pushed + most {
                self.marks.push_back(at);
                self.pushed = at;
            }
        }
    }

    /// Lets the first buffer take octets of the next buffers up to the position `to`, before the buffer is cut to what may leave (`tcp_grow_skb`). `end` is the
    /// end of all octets. A mark moves to the new end of its buffer.
    pub(super) fn grow(&mut self, to: Position, end: Position) {
        if self.take(to) {
            self.marks.push_front(to.min(end));
        }
    }

    /// Returns whether the segment of new data that ends at `end` has the flag PSH.
    pub(super) fn take(&mut self, end: Position) -> bool {
        let before = self.marks.len();
        while self.marks.front().is_some_and(|mark| *mark <= end) {
            self.marks.pop_front();
        }
        self.marks.len() < before
    }
}

impl Connection {
    /// Notes that the program writes `count` octets after the end of the send buffer.
    pub(super) fn note_write(&mut self, count: usize) {
        if count == 0 {
            return;
        }
        let (start, size, half) = (self.send.buffer.end(), self.segment_size().max(1) as u64, self.half_window());
        // As in Linux, a buffer has whole segments, and fits into half of the peer's largest window (`tcp_xmit_size_goal`).
        let full = (half.min(LONGEST_BURST) / size).max(1) * size;
        self.send.pushes.is_writing = true;
        self.send.pushes.write([start, start + count as u64], self.send.next, full, self.send.max_window / 2);
    }
}
