//! Samples with an arrival at all other peers at the same tick: all links have the same constant delay and lose nothing.
//!
//! All receivers then hold the same sample of a sender, so a sample is stored once for all receivers, both in flight and when held.

use std::collections::VecDeque;

use cohaptic_peer::{EXACT_FROM, ExactMeans, Moving, State};
use cohaptic_units::Instant;

use super::quads::{self, Quad};
use super::{Sample, count};
use crate::arrays::blocks::Blocks;
use crate::arrays::bodies::Bodies;

/// Samples in flight, and samples held from each sender. Time is counted in ticks.
#[derive(Clone, Debug)]
pub(in crate::arrays) struct Broadcast<const A: usize, const L: usize> {
    /// Ticks from sending to arrival.
    delay: u64,
    /// Samples in flight, in the order of their arrival: with one delay, the order of sending.
    on_the_way: VecDeque<Sent<A, L>>,
    peers: usize,
    /// Samples held from each sender but the first, indexed by axis, then by sender − 1: the order of the first peer.
    held: [Vec<Quad<L>>; A],
    /// Sample held from the first sender.
    first: Sample<A, L>,
    /// Sums of the samples held from all senders. `None` if means are not computed exactly.
    sums: Option<ExactMeans<A>>,
    /// Number of samples that have arrived, indexed by sender.
    arrived: Vec<u64>,
    changed: Changed,
}

/// Senders with an arrival since the means were computed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Changed {
    Nothing,
    From(usize),
    /// Samples of several senders have arrived, or the means were never computed.
    More,
}

#[derive(Clone, Copy, Debug)]
struct Sent<const A: usize, const L: usize> {
    /// Tick of the arrival.
    due: u64,
    sender: usize,
    sample: Sample<A, L>,
}

impl<const A: usize, const L: usize> Broadcast<A, L> {
    /// Returns the state before the first tick: all peers hold the initial states of the other peers, and nothing is in flight.
    pub(in crate::arrays) fn new(initial: &[Sample<A, L>], delay: u64) -> Self {
        let peers = initial.len();
        let mut broadcast = Self {
            delay,
            on_the_way: VecDeque::new(),
            peers,
            held: std::array::from_fn(|_| quads::empty(peers - 1)),
            first: initial[0],
            sums: None,
            arrived: vec![0; peers],
            changed: Changed::More,
        };
        for (sender, sample) in initial.iter().enumerate() {
            broadcast.hold(sender, sample);
        }
        // Exact sums are over all senders. The own sample of a receiver is subtracted later, see `refresh_exactly`.
        broadcast.sums =
            (peers > EXACT_FROM).then(|| ExactMeans::new((0..peers).map(|sender| broadcast.held_from(sender)).collect::<Vec<_>>().iter()));
        broadcast
    }

    /// Sends the sample of a peer to all other peers.
    #[inline(always)]
    pub(in crate::arrays) fn send(&mut self, tick: u64, sender: usize, bodies: &Bodies<A>) {
        let due = tick.saturating_add(self.delay);
        self.on_the_way.push_back(Sent { due, sender, sample: bodies.sample(sender) });
    }

    /// Holds the samples arrived by `tick`.
    pub(in crate::arrays) fn deliver(&mut self, tick: u64) {
        while let Some(Sent { sender, sample, .. }) = self.next_due(tick) {
            self.hold(sender, &sample);
            self.arrived[sender] += 1;
            // After a single new sample, the mean of its sender stays: no peer holds its own sample.
            self.changed = if self.changed == Changed::Nothing { Changed::From(sender) } else { Changed::More };
        }
    }

    /// Removes and returns the next sample in flight, if the sample has arrived by `tick`.
    #[inline(always)]
    fn next_due(&mut self, tick: u64) -> Option<Sent<A, L>> {
        let sent = *self.on_the_way.front().filter(|sent| sent.due <= tick)?;
        self.on_the_way.pop_front();
        Some(sent)
    }

    /// Returns the sample held from a sender in the first run. Exact means are used in single runs only.
    fn held_from(&self, sender: usize) -> State<A> {
        match sender.checked_sub(1) {
            None => self.first.state(0),
            Some(place) => quads::state(&self.held, place, 0),
        }
    }

    #[inline(always)]
    fn hold(&mut self, sender: usize, sample: &Sample<A, L>) {
        if self.sums.is_some() {
            // Exact sums allow a replacement without adding all samples again.
            let before = self.held_from(sender);
            self.sums.iter_mut().for_each(|sums| sums.replace(&before, &sample.state(0)));
        }
        let Some(place) = sender.checked_sub(1) else {
            self.first = *sample;
            return;
        };
        for axis in 0..A {
            for run in 0..L {
                quads::set(&mut self.held[axis], place, run, sample.position[axis][run], sample.velocity[axis][run]);
            }
        }
    }

    /// Returns the instant and the velocity of each held sample of a peer in a run, in the order of the peer. `sent` returns the instant of sending of the
    /// sample with a sequence number of a sender.
    pub(in crate::arrays) fn moving(&self, (peer, run): (usize, usize), sent: impl Fn(usize, u64) -> Instant) -> impl Iterator<Item = Moving<A>> {
        (0..self.peers).filter(move |sender| *sender != peer).map(move |sender| Moving {
            sent: self.arrived[sender].checked_sub(1).map_or(Instant::ZERO, |newest| sent(sender, newest)),
            velocity: std::array::from_fn(|axis| match sender.checked_sub(1) {
                Some(place) => quads::velocity(&self.held[axis], place, run),
                None => self.first.velocity[axis][run],
            }),
        })
    }

    /// Returns whether no held sample has changed since the means were computed.
    pub(in crate::arrays) fn is_settled(&self) -> bool {
        self.changed == Changed::Nothing
    }

    /// Returns whether any held sample of `peer` has changed since the means were computed.
    pub(in crate::arrays) fn has_changed(&self, peer: usize) -> bool {
        match self.changed {
            Changed::Nothing => false,
            Changed::From(sender) => sender != peer,
            Changed::More => true,
        }
    }

    /// Computes the mean of the held samples of each peer.
    #[inline(always)]
    pub(in crate::arrays) fn refresh(&mut self, blocks: &mut Blocks) {
        self.changed = Changed::Nothing;
        if self.sums.is_some() {
            self.refresh_exactly(blocks);
            return;
        }
        let count = count(self.peers - 1);
        for axis in 0..A {
            let held = &mut self.held[axis];
            // Each receiver holds the samples of all senders but itself. From one receiver to the next only one place changes: the receiver's own sample gives
            // way to the sample of the receiver before.
            let mut own = (self.first.position[axis], self.first.velocity[axis]);
            for peer in 0..self.peers {
                if peer > 0 {
                    quads::swap(held, peer - 1, &mut own);
                }
                let (x, v) = quads::mean(held, count);
                blocks.set_target(axis, peer, x, v);
            }
            // Swap back to the places of the first peer.
            for peer in (1..self.peers).rev() {
                quads::swap(held, peer - 1, &mut own);
            }
        }
    }

    /// Like [`Broadcast::refresh`], for many peers: subtracts the receiver's own sample from the exact sums of all samples.
    #[cold]
    fn refresh_exactly(&self, blocks: &mut Blocks) {
        let Some(sums) = &self.sums else { return };
        for peer in 0..self.peers {
            let mean = sums.mean_without(&self.held_from(peer), self.peers - 1);
            for axis in 0..A {
                blocks.set_target(axis, peer, [mean.position[axis]; L], [mean.velocity[axis]; L]);
            }
        }
    }
}
