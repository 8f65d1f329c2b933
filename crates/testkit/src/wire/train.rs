//! Segments of one connection that travel as one event.

use cohaptic_tcp::Flight;
use cohaptic_wan::Path;

use super::{HasFlow, Held, Parcel, Wire};

/// Segments that travel with the segment of a parcel: together they are a train. All have the addresses of the parcel.
#[derive(Clone, Default, Debug)]
pub(crate) struct Followers {
    pub(crate) flight: Flight,
    /// Bytes that [`Held`] counts for the packets of the segments on a link.
    cost: u64,
}

impl Followers {
    /// Largest capacity of a list that is kept \[runs of segments\], about 60 kB.
    const SHORT: usize = 256;

    /// Returns whether the memory of the list is worth keeping: a burst must not occupy memory for the rest of the run.
    pub(crate) const fn is_short(&self) -> bool {
        self.flight.capacity() <= Self::SHORT
    }

    /// Returns the bytes that [`Held`] counts for the packets of a train that has arrived.
    pub(crate) const fn cost(&self) -> u64 {
        self.cost
    }

    pub(crate) fn clear(&mut self) {
        self.flight.clear();
        self.cost = 0;
    }
}

impl<A: HasFlow + Clone> Wire<A> {
    /// Hands the segment of a parcel and its followers to their path, as one event. The run must not be [watched](Wire::is_watched), because a watched run
    /// reports single packets. Returns the parcel if the path takes no trains: see [`Network::handle_train`](cohaptic_wan::Network::handle_train).
    pub(crate) fn offer_train(&mut self, path: Path, mut first: Box<Parcel<A>>) -> Result<(), Box<Parcel<A>>> {
        let Some(followers) = &mut first.followers else { return Err(first) };
        let further = followers.flight.len();
        followers.cost = Held::cost_of(further, followers.flight.packet_lengths());
        // The network refuses a number above that of its longest train.
        let packets = u32::try_from(further + 1).unwrap_or(u32::MAX);
        let cost = Held::cost(first.bytes.len()) + followers.cost;
        self.network.handle_train(self.now, path, packets, first)?;
        self.held.add(cost);
        Ok(())
    }
}
