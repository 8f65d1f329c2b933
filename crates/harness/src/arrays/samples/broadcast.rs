//! Samples that reach everybody else at one tick: all links have the same constant delay and lose nothing.
//!
//! Then all hold the same of a sender, and a sample is one thing for all its receivers, on the way and when it is held.

use std::collections::VecDeque;

use cohaptic_scene::Scene;

use super::{Sample, mean, others};
use crate::arrays::blocks::Blocks;

/// What is on the way, and what is held from each sender.
#[derive(Clone, Debug)]
pub(in crate::arrays) struct Broadcast<const A: usize, const L: usize> {
    delay_ticks: u64,
    on_the_way: VecDeque<Sent<A, L>>,
    peers: usize,
    /// By axis, then sender, then run.
    positions: [Vec<f64>; A],
    velocities: [Vec<f64>; A],
    changed: bool,
    scratch: (Vec<f64>, Vec<f64>),
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
        let initial = |axis: usize, pick: fn(&cohaptic_peer::State<A>) -> &[f64; A]| {
            (0..peers).flat_map(move |peer| scenes.iter().map(move |scene| pick(&scene.initial_state(peer))[axis])).collect()
        };
        Self {
            delay_ticks,
            on_the_way: VecDeque::new(),
            peers,
            positions: std::array::from_fn(|axis| initial(axis, |state| &state.position)),
            velocities: std::array::from_fn(|axis| initial(axis, |state| &state.velocity)),
            changed: true,
            scratch: (vec![0.0; peers * L], vec![0.0; peers * L]),
        }
    }

    /// A peer sends to all others.
    #[inline(always)]
    pub(in crate::arrays) fn send(&mut self, tick: u64, sender: usize, blocks: &Blocks<A>) {
        let due = tick.saturating_add(self.delay_ticks);
        self.on_the_way.push_back(Sent { due, sender, sample: Sample::of(blocks, sender) });
    }

    /// What has arrived is held from now on, and the means are those of what is held.
    #[inline(always)]
    pub(in crate::arrays) fn deliver(&mut self, tick: u64, blocks: &mut Blocks<A>) {
        while let Some(&Sent { sender, sample, .. }) = self.on_the_way.front().filter(|sent| sent.due <= tick) {
            self.on_the_way.pop_front();
            for axis in 0..A {
                self.positions[axis][sender * L..(sender + 1) * L].copy_from_slice(&sample.position[axis]);
                self.velocities[axis][sender * L..(sender + 1) * L].copy_from_slice(&sample.velocity[axis]);
            }
            self.changed = true;
        }
        if self.changed {
            self.changed = false;
            self.refresh(blocks);
        }
    }

    #[inline(always)]
    fn refresh(&mut self, blocks: &mut Blocks<A>) {
        let count = others(self.peers);
        for axis in 0..A {
            // The receiver's own sample comes first and those of the others follow in their order: from one receiver to the next two samples change places.
            self.scratch.0.copy_from_slice(&self.positions[axis]);
            self.scratch.1.copy_from_slice(&self.velocities[axis]);
            let (positions, velocities) = (&mut self.scratch.0[..], &mut self.scratch.1[..]);
            for peer in 0..self.peers {
                for run in (0..L).filter(|_| peer > 0) {
                    positions.swap(run, peer * L + run);
                    velocities.swap(run, peer * L + run);
                }
                blocks.set_target(axis, peer, mean::<L>(&positions[L..], count), mean::<L>(&velocities[L..], count));
            }
        }
    }
}
