//! Segments of one connection that leave at one instant, kept in runs, so that most segments take no memory of their own.

use alloc::vec::Vec;
use core::net::{IpAddr, Ipv4Addr, SocketAddr};

use crate::segment::{Ecn, Flags, Options, Payload, Segment};

/// Segments of one connection that leave at one instant, in the order of sending.
///
/// [`Connection::transmit`](crate::Connection::transmit) appends segments, and
/// [`Connection::handle_next`](crate::Connection::handle_next) or [`pop_front`](Self::pop_front) takes the next segment out. Full segments that follow
/// each other differ in their sequence numbers only, so that a flight has one header and one piece of data for a run of such segments.
#[derive(Clone, Default, Debug)]
pub struct Flight {
    /// Runs in use, and after them former runs without data, over which further runs are written.
    runs: Vec<Run>,
    /// Number of runs in use.
    used: usize,
    /// Number of runs, from the first one on, whose segments were all taken.
    taken: usize,
}

/// Segments whose headers are equal but for the sequence number and PSH, and whose data is one piece of memory.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// Segment that was taken last, or the first segment before. The data of the next segments follows in the memory of the data.
    pub(crate) segment: Segment<'static>,
    /// The first segment was taken.
    is_begun: bool,
    /// Number of octets of data of the segments that were not taken.
    octets: usize,
    /// Octets of data of each segment but the last, which may have fewer.
    size: usize,
    /// Number of segments that were not taken.
    count: u32,
    /// Bit k says that the segment k of those that were not taken has the flag PSH.
    pushes: u64,
}

impl Flight {
    /// Capacity of a new flight \[runs\].
    const FIRST: usize = 8;

    /// Appends a segment.
    pub fn push(&mut self, segment: Segment<'static>) {
        let run = self.begin();
        run.segment = segment;
        run.begin();
    }

    /// Returns the memory of a new run, with some former segment.
    pub(crate) fn begin(&mut self) -> &mut Run {
        if self.used == self.runs.len() {
            if self.runs.capacity() == 0 {
                self.runs.reserve(Self::FIRST);
            }
            self.runs.push(Run::blank());
        }
        self.used += 1;
        &mut self.runs[self.used - 1]
    }

    /// Returns the last run, unless all of its segments were taken.
    pub(crate) fn last(&mut self) -> Option<&mut Run> {
        self.runs[self.taken..self.used].last_mut()
    }

    /// Takes the next segment out.
    pub fn pop_front(&mut self) -> Option<Segment<'static>> {
        self.take_next().cloned()
    }

    /// Takes the next segment out. The memory of the segment belongs to the flight, and so does the memory of the data if data of later segments follows.
    pub(crate) fn take_next(&mut self) -> Option<&mut Segment<'static>> {
        if self.taken == self.used {
            return None;
        }
        let run = &mut self.runs[self.taken];
        self.taken += usize::from(run.count == 1);
        Some(run.take_next())
    }

    /// Returns the number of segments that were not taken.
    #[must_use]
    pub fn len(&self) -> usize {
        self.left().map(|run| run.count as usize).sum()
    }

    /// Returns whether all segments were taken.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.taken == self.used
    }

    /// Returns the sum of the lengths of the IP packets of the segments that were not taken \[byte\].
    #[must_use]
    pub fn packet_lengths(&self) -> usize {
        self.left().map(|run| run.count as usize * (run.segment.packet_length() - run.segment.payload.len()) + run.octets).sum()
    }

    fn left(&self) -> impl Iterator<Item = &Run> {
        self.runs[self.taken..self.used].iter()
    }

    /// Removes all segments. The memory of the flight is kept, the data of the segments is not.
    pub fn clear(&mut self) {
        self.runs[..self.used].iter_mut().for_each(|run| run.segment.payload = Payload::default());
        (self.used, self.taken) = (0, 0);
    }

    /// Returns the number of runs for which the flight has memory.
    #[must_use]
    pub const fn capacity(&self) -> usize {
        self.runs.capacity()
    }
}

impl Run {
    /// Greatest number of segments: one for each bit of `pushes`.
    const MOST: u32 = u64::BITS;

    /// Returns a run without content.
    fn blank() -> Self {
        let nobody = SocketAddr::new(IpAddr::V4(Ipv4Addr::UNSPECIFIED), 0);
        let segment = Segment {
            source: nobody,
            destination: nobody,
            sequence: 0,
            acknowledgement: 0,
            flags: Flags::NONE,
            window: 0,
            options: Options::default(),
            ecn: Ecn::NotCapable,
            ttl: 0,
            payload: Payload::default(),
        };
        Self { segment, is_begun: false, octets: 0, size: 0, count: 0, pushes: 0 }
    }

    /// Begins the run with the segment that was written to `segment`.
    pub(crate) fn begin(&mut self) {
        let size = self.segment.payload.len();
        (self.is_begun, self.octets, self.size) = (false, size, size);
        (self.count, self.pushes) = (1, u64::from(self.segment.flags.has(Flags::PSH)));
    }

    /// Returns whether a segment with `size` octets of data from the sequence number `sequence` on may be [appended](Self::append): the run has room and no
    /// short segment, and the data follows the data of the run in the same memory.
    pub(crate) fn may_append(&self, sequence: u32, size: usize) -> bool {
        let is_whole = self.octets == self.size * self.count as usize && !self.is_begun;
        let follows = sequence.wrapping_sub(self.segment.sequence) as usize == self.octets;
        is_whole
            && follows
            && self.count < Self::MOST
            && (1..=self.size).contains(&size)
            && self.octets + size <= self.segment.payload.memory_length()
    }

    /// Appends a segment with the header of the run and the next `size` octets of data, and with PSH if `pushes` is set.
    pub(crate) fn append(&mut self, size: usize, pushes: bool) {
        self.octets += size;
        self.pushes |= u64::from(pushes) << self.count;
        self.count += 1;
    }

    /// Takes the next segment out. There must be one.
    fn take_next(&mut self) -> &mut Segment<'static> {
        let length = self.size.min(self.octets);
        let segment = &mut self.segment;
        if self.is_begun {
            segment.sequence = segment.sequence.wrapping_add(u32::try_from(self.size).unwrap_or(0));
            segment.payload.advance(length);
        }
        self.is_begun = true;
        segment.flags = segment.flags.without(Flags::PSH).with_if(Flags::PSH, self.pushes & 1 == 1);
        self.octets -= length;
        self.count -= 1;
        self.pushes >>= 1;
        segment
    }
}

#[cfg(test)]
mod tests;
