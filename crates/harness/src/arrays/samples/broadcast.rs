//! Samples that reach everybody else at one tick: all links have the same constant delay and lose nothing.
//!
//! Then all hold the same of a sender, and a sample is one thing for all its receivers, on the way and when it is held.

use std::collections::VecDeque;

use cohaptic_peer::{EXACT_FROM, ExactMeans, Moving, State};
use cohaptic_units::Instant;

use super::quads::{self, Quad};
use super::{Sample, count};
use crate::arrays::blocks::Blocks;
use crate::arrays::bodies::Bodies;

/// The samples in flight, and those held from each sender. Time counts ticks.
#[derive(Clone, Debug)]
pub(in crate::arrays) struct Broadcast<const A: usize, const L: usize> {
    delay: u64,
    on_the_way: VecDeque<Sent<A, L>>,
    peers: usize,
    /// The samples held from each sender but the first, by axis, as the first peer holds it; and from the first.
    held: [Vec<Quad<L>>; A],
    first: Sample<A, L>,
    /// The sums of the samples held from all, if their means are exact.
    sums: Option<ExactMeans<A>>,
    /// How many samples of each sender have arrived.
    arrived: Vec<u64>,
    changed: Changed,
}

/// The senders whose samples have arrived since the means were computed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Changed {
    Nothing,
    From(usize),
    /// Several, or nothing was computed yet.
    More,
}

#[derive(Clone, Copy, Debug)]
struct Sent<const A: usize, const L: usize> {
    /// When it is in force.
    due: u64,
    sender: usize,
    sample: Sample<A, L>,
}

impl<const A: usize, const L: usize> Broadcast<A, L> {
    /// Everybody holds the initial states of the others, and nothing is on the way.
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
        broadcast.sums =
            (peers > EXACT_FROM).then(|| ExactMeans::new((0..peers).map(|sender| broadcast.held_from(sender)).collect::<Vec<_>>().iter()));
        broadcast
    }

    /// A peer sends to all others.
    #[inline(always)]
    pub(in crate::arrays) fn send(&mut self, tick: u64, sender: usize, bodies: &Bodies<A>) {
        let due = tick.saturating_add(self.delay);
        self.on_the_way.push_back(Sent { due, sender, sample: bodies.sample(sender) });
    }

    /// What has arrived is held from now on.
    pub(in crate::arrays) fn deliver(&mut self, tick: u64) {
        while let Some(Sent { sender, sample, .. }) = self.next_due(tick) {
            self.hold(sender, &sample);
            self.arrived[sender] += 1;
            self.changed = if self.changed == Changed::Nothing { Changed::From(sender) } else { Changed::More };
        }
    }

    /// The next sample that has arrived, which is on the way no more.
    #[inline(always)]
    fn next_due(&mut self, tick: u64) -> Option<Sent<A, L>> {
        let sent = *self.on_the_way.front().filter(|sent| sent.due <= tick)?;
        self.on_the_way.pop_front();
        Some(sent)
    }

    /// The sample held from a sender in the first run: with this number of peers there are no others.
    fn held_from(&self, sender: usize) -> State<A> {
        match sender.checked_sub(1) {
            None => self.first.state(0),
            Some(place) => quads::state(&self.held, place, 0),
        }
    }

    #[inline(always)]
    fn hold(&mut self, sender: usize, sample: &Sample<A, L>) {
        if self.sums.is_some() {
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

    /// How what a peer holds in a run moves on, in the order in which the peer holds it. `sent` says when a sample of a sender was sent.
    pub(in crate::arrays) fn moving(&self, (peer, run): (usize, usize), sent: impl Fn(usize, u64) -> Instant) -> impl Iterator<Item = Moving<A>> {
        (0..self.peers).filter(move |sender| *sender != peer).map(move |sender| Moving {
            sent: self.arrived[sender].checked_sub(1).map_or(Instant::ZERO, |newest| sent(sender, newest)),
            velocity: std::array::from_fn(|axis| match sender.checked_sub(1) {
                Some(place) => quads::velocity(&self.held[axis], place, run),
                None => self.first.velocity[axis][run],
            }),
        })
    }

    /// Whether nothing that anybody holds has changed since the means were computed.
    #[inline(always)]
    pub(in crate::arrays) fn is_settled(&self) -> bool {
        self.changed == Changed::Nothing
    }

    /// Whether anything that a peer holds has changed since the means were computed.
    pub(in crate::arrays) fn has_changed(&self, peer: usize) -> bool {
        match self.changed {
            Changed::Nothing => false,
            Changed::From(sender) => sender != peer,
            Changed::More => true,
        }
    }

    /// The means are those of the samples held.
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
            // From one receiver to the next, its own sample is replaced by that of the receiver before.
            let mut own = (self.first.position[axis], self.first.velocity[axis]);
            for peer in 0..self.peers {
                if peer > 0 {
                    quads::swap(held, peer - 1, &mut own);
                }
                let (x, v) = quads::mean(held, count);
                blocks.set_target(axis, peer, x, v);
            }
            // And back.
            for peer in (1..self.peers).rev() {
                quads::swap(held, peer - 1, &mut own);
            }
        }
    }

    /// [`Broadcast::refresh`] of many: what all hold together without the receiver's own.
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
