//! Segments of one connection that travel as one event.

use cohaptic_tcp::{Connection, Payload, Segment};
use cohaptic_units::Instant;
use cohaptic_wan::Path;

use super::{HasFlow, Held, Parcel, Wire};

/// Segments that travel with the segment of a parcel, in the order of sending: together they are a train. All have the addresses of the parcel.
///
/// The list has the segments themselves, one after the other in memory. A parcel for each segment would take an allocation and three times the memory.
#[derive(Clone, Default, Debug)]
pub(crate) struct Followers {
    /// The segments, and after them former segments without data, over which further segments are written.
    segments: Vec<Segment<'static>>,
    /// Number of segments.
    count: usize,
    /// Bytes that [`Held`] counts for the packets of the segments on a link.
    cost: u64,
}

impl Followers {
    /// Capacity of a new list \[segments\].
    const FIRST: usize = 16;
    /// Largest capacity of a list that is kept \[segments\], about 40 kB.
    const SHORT: usize = 256;

    pub(crate) fn push(&mut self, segment: Segment<'static>) {
        if let Some(former) = self.segments.get_mut(self.count) {
            *former = segment;
        } else {
            if self.segments.capacity() == 0 {
                self.segments.reserve(Self::FIRST);
            }
            self.segments.push(segment);
        }
        self.count += 1;
    }

    /// Appends all segments that the connection may send now.
    #[inline]
    pub(crate) fn extend(&mut self, now: Instant, connection: &mut Connection) {
        while let Some(former) = self.segments.get_mut(self.count) {
            if !connection.poll_transmit_into(now, former) {
                return;
            }
            self.count += 1;
        }
        while let Some(segment) = connection.poll_transmit(now) {
            self.push(segment);
        }
    }

    /// Returns whether the memory of the list is worth keeping: a burst must not occupy memory for the rest of the run.
    pub(crate) const fn is_short(&self) -> bool {
        self.segments.capacity() <= Self::SHORT
    }

    /// Returns the bytes that [`Held`] counts for the packets of a train that has arrived.
    pub(crate) const fn cost(&self) -> u64 {
        self.cost
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Segment<'static>> {
        self.segments[..self.count].iter_mut()
    }

    /// Takes the segments out of the list.
    pub(crate) fn drain(&mut self) -> impl Iterator<Item = Segment<'static>> {
        self.cost = 0;
        self.segments.drain(..std::mem::take(&mut self.count))
    }

    pub(crate) fn clear(&mut self) {
        // The memory of the writer is not kept.
        self.iter_mut().for_each(|segment| segment.payload = Payload::default());
        (self.count, self.cost) = (0, 0);
    }
}

impl<A: HasFlow + Clone> Wire<A> {
    /// Hands the segment of a parcel and its followers to their path, as one event. The run must not be [watched](Wire::is_watched), because a watched run
    /// reports single packets. Returns the parcel if the path takes no trains: see [`Network::handle_train`](cohaptic_wan::Network::handle_train).
    pub(crate) fn offer_train(&mut self, path: Path, mut first: Box<Parcel<A>>) -> Result<(), Box<Parcel<A>>> {
        let Some(followers) = &mut first.followers else { return Err(first) };
        // The network refuses a number above that of its longest train.
        let packets = u32::try_from(followers.count + 1).unwrap_or(u32::MAX);
        followers.cost = followers.iter_mut().map(|segment| Held::cost(segment.packet_length())).sum();
        let cost = Held::cost(first.bytes.len()) + followers.cost;
        self.network.handle_train(self.now, path, packets, first)?;
        self.held.add(cost);
        Ok(())
    }
}
