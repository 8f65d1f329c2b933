//! The senders that each receiver hears, and the places of its links and of the samples that it holds.

use std::ops::Range;
use std::sync::Arc;

use cohaptic_peer::State;
use cohaptic_scene::Topology;
use cohaptic_units::Instant;

use super::in_flight::Packet;

/// The rows of some receivers, which are counted from 0: a link from each sender, in order, and a place for the sample held from each.
#[derive(Clone, Debug)]
pub(super) enum Rows {
    /// Each hears all others. There is a link from itself too, over which nothing is sent, so that a place is found by multiplying.
    All {
        /// Of the scene.
        peers: usize,
        /// The first receiver among them.
        first: usize,
    },
    /// Each hears its neighbours.
    Some(SomeRows),
}

/// The rows of receivers that hear their neighbours.
#[derive(Clone, Debug)]
pub(super) struct SomeRows {
    topology: Arc<Topology>,
    receivers: Range<usize>,
    /// By receiver where its places begin, and at last where they end.
    places: Vec<usize>,
    /// By link what a sample weighs; empty if all weigh as much.
    weights: Vec<f64>,
}

/// How many places that number of senders has: whole quads.
const fn whole(senders: usize) -> usize {
    senders.next_multiple_of(4)
}

impl Rows {
    /// Those of these receivers out of that number of peers.
    pub(super) fn new(peers: usize, topology: Option<&Arc<Topology>>, receivers: Range<usize>) -> Self {
        let Some(topology) = topology else { return Self::All { peers, first: receivers.start } };
        let mut places = vec![0];
        for peer in receivers.clone() {
            places.push(places[places.len() - 1] + whole(topology.neighbours(peer).len()));
        }
        let relative: Vec<Option<Vec<f64>>> = receivers.clone().map(|peer| topology.relative_weights(peer)).collect();
        let weights = if relative.iter().all(Option::is_none) {
            Vec::new()
        } else {
            let row = |(peer, weights): (usize, Option<Vec<f64>>)| weights.unwrap_or_else(|| vec![1.0; topology.neighbours(peer).len()]);
            receivers.clone().zip(relative).flat_map(row).collect()
        };
        Self::Some(SomeRows { topology: Arc::clone(topology), receivers, places, weights })
    }

    /// How many places there are.
    pub(super) fn places(&self, receivers: usize) -> usize {
        match self {
            Self::All { peers, .. } => receivers * whole(peers - 1),
            Self::Some(rows) => rows.places[receivers],
        }
    }

    /// How many links lead to a receiver.
    #[inline]
    pub(super) fn columns(&self, receiver: usize) -> usize {
        match self {
            Self::All { peers, .. } => *peers,
            Self::Some(rows) => rows.of(receiver).len(),
        }
    }

    /// The sender of one of them, which may be the receiver itself.
    #[inline]
    pub(super) fn sender(&self, receiver: usize, column: usize) -> usize {
        match self {
            Self::All { .. } => column,
            Self::Some(rows) => rows.of(receiver)[column] as usize,
        }
    }

    /// The column of a sender; `None` if there is no link.
    pub(super) fn column(&self, receiver: usize, sender: usize) -> Option<usize> {
        match self {
            Self::All { first, .. } => (sender != first + receiver).then_some(sender),
            Self::Some(rows) => rows.topology.place(rows.receivers.start + receiver, sender),
        }
    }

    /// The link in a column.
    #[inline]
    pub(super) fn link(&self, receiver: usize, column: usize) -> usize {
        match self {
            Self::All { peers, .. } => receiver * peers + column,
            Self::Some(rows) => rows.first_link(receiver) + column,
        }
    }

    /// The place in which what comes over the link in a column is held.
    #[inline]
    pub(super) fn place(&self, receiver: usize, column: usize) -> usize {
        match self {
            Self::All { peers, first } => receiver * whole(peers - 1) + column - usize::from(column > first + receiver),
            Self::Some(rows) => rows.places[receiver] + column,
        }
    }

    /// The column whose samples are held in a place of a receiver.
    #[inline]
    pub(super) fn column_of(&self, receiver: usize, place: usize) -> usize {
        match self {
            Self::All { peers, first } => {
                let place = place - receiver * whole(peers - 1);
                place + usize::from(place >= first + receiver)
            }
            Self::Some(rows) => place - rows.places[receiver],
        }
    }

    /// The places of a receiver that hold something.
    #[inline(always)]
    pub(super) fn held(&self, receiver: usize) -> Range<usize> {
        match self {
            Self::All { peers, .. } => receiver * whole(peers - 1)..receiver * whole(peers - 1) + peers - 1,
            Self::Some(rows) => rows.places[receiver]..rows.places[receiver] + rows.of(receiver).len(),
        }
    }

    /// The packet to a receiver over the link in a column, in one of L runs.
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
            position: state.position.map(weighed),
            velocity: state.velocity.map(weighed),
        }
    }

    /// By what a sample over the link in a column is multiplied, if by anything.
    #[inline]
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
        self.topology.places(self.receivers.start + receiver).start - self.topology.places(self.receivers.start).start
    }
}
