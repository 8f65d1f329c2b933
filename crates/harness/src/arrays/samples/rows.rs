//! Heard senders of each receiver, and the indices of the receiver's links and held samples.
//!
//! A row has a column for each link to its receiver. A place is an index into the arrays of held samples; each receiver has whole quads of places.

use std::ops::Range;
use std::sync::Arc;

use cohaptic_peer::State;
use cohaptic_scene::Topology;
use cohaptic_units::Instant;

use super::in_flight::Packet;

/// Rows of some receivers, counted from 0. Each row has a link from each sender, in the order of the senders.
#[derive(Clone, Debug)]
pub(super) enum Rows {
    /// Every peer hears all other peers. An unused link from each receiver to itself makes indices products.
    All {
        /// Number of peers of the scene.
        peers: usize,
        /// Index in the scene of the first receiver.
        first: usize,
    },
    /// Every peer hears its neighbours only.
    Some(SomeRows),
}

/// Rows of receivers in a topology: receivers hear their neighbours only.
#[derive(Clone, Debug)]
pub(super) struct SomeRows {
    topology: Arc<Topology>,
    receivers: Range<usize>,
    /// First place of each receiver, indexed by receiver; the last entry is the end of all places.
    places: Vec<usize>,
    /// Relative weight of a sample, indexed by link. Empty if all samples have the same weight.
    weights: Vec<f64>,
}

/// Returns the number of places for the given number of senders: whole quads.
const fn whole(senders: usize) -> usize {
    senders.next_multiple_of(4)
}

impl Rows {
    /// Returns the rows of the given receivers among `peers` peers. Every peer hears all other peers if `topology` is `None`.
    pub(super) fn new(peers: usize, topology: Option<&Arc<Topology>>, receivers: Range<usize>) -> Self {
        let Some(topology) = topology else { return Self::All { peers, first: receivers.start } };
        let mut places = vec![0];
        for peer in receivers.clone() {
            // Whole quads for each receiver, so a mean never mixes samples of two receivers.
            places.push(places[places.len() - 1] + whole(topology.neighbours(peer).len()));
        }
        // If every receiver weighs its neighbours alike, no weights are stored, and `packet` multiplies nothing.
        let relative: Vec<Option<Vec<f64>>> = receivers.clone().map(|peer| topology.relative_weights(peer)).collect();
        let weights = if relative.iter().all(Option::is_none) {
            Vec::new()
        } else {
            let row = |(peer, weights): (usize, Option<Vec<f64>>)| weights.unwrap_or_else(|| vec![1.0; topology.neighbours(peer).len()]);
            receivers.clone().zip(relative).flat_map(row).collect()
        };
        Self::Some(SomeRows { topology: Arc::clone(topology), receivers, places, weights })
    }

    /// Returns the number of places of the given number of receivers.
    pub(super) fn places(&self, receivers: usize) -> usize {
        match self {
            Self::All { peers, .. } => receivers * whole(peers - 1),
            Self::Some(rows) => rows.places[receivers],
        }
    }

    /// Returns the number of links to a receiver.
    pub(super) fn columns(&self, receiver: usize) -> usize {
        match self {
            Self::All { peers, .. } => *peers,
            Self::Some(rows) => rows.of(receiver).len(),
        }
    }

    /// Returns the sender of a link, by index in the scene. With [`Rows::All`] this may be the receiver itself.
    pub(super) fn sender(&self, receiver: usize, column: usize) -> usize {
        match self {
            Self::All { .. } => column,
            Self::Some(rows) => rows.of(receiver)[column] as usize,
        }
    }

    /// Returns the column of a sender; `None` if there is no link.
    pub(super) fn column(&self, receiver: usize, sender: usize) -> Option<usize> {
        match self {
            Self::All { first, .. } => (sender != first + receiver).then_some(sender),
            Self::Some(rows) => rows.topology.place(rows.receivers.start + receiver, sender),
        }
    }

    /// Returns the index of the link in a column.
    pub(super) fn link(&self, receiver: usize, column: usize) -> usize {
        match self {
            Self::All { peers, .. } => receiver * peers + column,
            Self::Some(rows) => rows.first_link(receiver) + column,
        }
    }

    /// Returns the place of the samples from the link in a column.
    pub(super) fn place(&self, receiver: usize, column: usize) -> usize {
        match self {
            // The receiver holds no sample of itself: the places of later senders are lower by one.
            Self::All { peers, first } => receiver * whole(peers - 1) + column - usize::from(column > first + receiver),
            Self::Some(rows) => rows.places[receiver] + column,
        }
    }

    /// Returns the column of the held samples in a place of a receiver. Inverse of [`Rows::place`].
    pub(super) fn column_of(&self, receiver: usize, place: usize) -> usize {
        match self {
            Self::All { peers, first } => {
                let place = place - receiver * whole(peers - 1);
                place + usize::from(place >= first + receiver)
            }
            Self::Some(rows) => place - rows.places[receiver],
        }
    }

    /// Returns the places of a receiver with samples. The padding up to whole quads is left out.
    #[inline(always)]
    pub(super) fn held(&self, receiver: usize) -> Range<usize> {
        match self {
            Self::All { peers, .. } => receiver * whole(peers - 1)..receiver * whole(peers - 1) + peers - 1,
            Self::Some(rows) => rows.places[receiver]..rows.places[receiver] + rows.of(receiver).len(),
        }
    }

    /// Returns the packet to a receiver over the link in a column, in one of L runs. Multiplies the sample by the weight of the link.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "peers are counted in 16 bits, what they hold in 32")]
    pub(super) fn packet<const A: usize, const L: usize>(
        &self,
        (receiver, column, run): (usize, usize, usize),
        state: &State<A>,
        arrival: Instant,
        sequence: u64,
    ) -> Packet<A> {
        let weight = self.weight(receiver, column);
        let weighed = |number: f64| weight.map_or(number, |weight| number * weight);
        Packet {
            arrival,
            sequence,
            place: (self.place(receiver, column) * L + run) as u32,
            receiver: receiver as u16,
            stands_for: 0,
            position: state.position.map(weighed),
            velocity: state.velocity.map(weighed),
        }
    }

    /// Returns the factor of samples over the link in a column; `None` if samples are not weighted.
    pub(super) fn weight(&self, receiver: usize, column: usize) -> Option<f64> {
        match self {
            Self::All { .. } => None,
            Self::Some(rows) => rows.weights.get(rows.first_link(receiver) + column).copied(),
        }
    }
}

impl SomeRows {
    fn of(&self, receiver: usize) -> &[u32] {
        self.topology.neighbours(self.receivers.start + receiver)
    }

    fn first_link(&self, receiver: usize) -> usize {
        // The topology counts links from the first peer of the scene, these rows from the first receiver.
        self.topology.places(self.receivers.start + receiver).start - self.topology.places(self.receivers.start).start
    }
}
