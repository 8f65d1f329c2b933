//! Samples that reach everybody else at one tick: all links have the same constant delay and lose nothing.
//!
//! Then all hold the same of a sender, and a sample is one thing for all its receivers, on the way and when it is held.

use std::collections::VecDeque;

use cohaptic_scene::Scene;

use cohaptic_units::Instant;

use super::quads::{self, Quad};
use super::{Sample, others};
use crate::arrays::blocks::Blocks;
use crate::arrays::lead::mean_lead;

/// The samples in flight, and those held from each sender.
#[derive(Clone, Debug)]
pub(in crate::arrays) struct Broadcast<const A: usize, const L: usize> {
    delay_ticks: u64,
    on_the_way: VecDeque<Sent<A, L>>,
    peers: usize,
    /// The samples held from each sender but the first, by axis, as the first peer holds it; and from the first.
    held: [Vec<Quad<L>>; A],
    first: Sample<A, L>,
    /// How many samples of each sender have arrived.
    arrived: Vec<u64>,
    changed: bool,
}

#[derive(Clone, Copy, Debug)]
struct Sent<const A: usize, const L: usize> {
    /// The tick at which it is in force.
    due: u64,
    sender: usize,
    sample: Sample<A, L>,
}

impl<const A: usize, const L: usize> Broadcast<A, L> {
    /// Everybody holds the initial states of the others, and nothing is on the way.
    pub(in crate::arrays) fn new(scenes: &[&Scene], delay_ticks: u64) -> Self {
        let peers = scenes[0].peers.len();
        let mut broadcast = Self {
            delay_ticks,
            on_the_way: VecDeque::new(),
            peers,
            held: std::array::from_fn(|_| quads::empty(peers - 1)),
            first: Sample::initial(scenes, 0),
            arrived: vec![0; peers],
            changed: true,
        };
        for sender in 0..peers {
            broadcast.hold(sender, &Sample::initial(scenes, sender));
        }
        broadcast
    }

    /// A peer sends to all others.
    #[inline(always)]
    pub(in crate::arrays) fn send(&mut self, tick: u64, sender: usize, blocks: &Blocks<A>) {
        let due = tick.saturating_add(self.delay_ticks);
        self.on_the_way.push_back(Sent { due, sender, sample: Sample::of(blocks, sender) });
    }

    /// What has arrived is held from now on.
    pub(in crate::arrays) fn deliver(&mut self, tick: u64) {
        while let Some(&Sent { sender, sample, .. }) = self.on_the_way.front().filter(|sent| sent.due <= tick) {
            self.on_the_way.pop_front();
            self.hold(sender, &sample);
            self.arrived[sender] += 1;
            self.changed = true;
        }
    }

    #[inline(always)]
    fn hold(&mut self, sender: usize, sample: &Sample<A, L>) {
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

    /// By how much what a peer holds has moved on since it was sent: along an axis, at a receiver, in a run. `sent` says when a sample of a sender was sent.
    pub(in crate::arrays) fn lead(
        &self,
        (axis, peer, run): (usize, usize, usize),
        now: Instant,
        horizon: f64,
        sent: impl Fn(usize, u64) -> Instant,
    ) -> f64 {
        let moving = |sender: usize| {
            let velocity = match sender.checked_sub(1) {
                Some(place) => quads::velocity(&self.held[axis], place, run),
                None => self.first.velocity[axis][run],
            };
            (self.arrived[sender].checked_sub(1).map_or(Instant::ZERO, |newest| sent(sender, newest)), velocity)
        };
        mean_lead((0..self.peers).filter(|sender| *sender != peer).map(moving), now, horizon, others(self.peers))
    }

    /// The means are those of the samples held.
    #[inline(always)]
    pub(in crate::arrays) fn refresh(&mut self, blocks: &mut Blocks<A>) {
        if !std::mem::take(&mut self.changed) {
            return;
        }
        let count = others(self.peers);
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
}
