//! What may be moved without a force: everything together, or with waves, which carry no position, each peer by itself.

use cohaptic_peer::coordination::Role;
use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{State, Strategy};
use cohaptic_units::Instant;

use super::{EARLIER, Pusher, state};

/// A displacement by 1 m that a frame leaves as it is.
pub(super) struct Translation {
    /// The peers that are moved, and along which axis.
    peers: Vec<usize>,
    axis: usize,
    /// The position that others are relative to: that of the first copy of them.
    pub(super) reference: usize,
    pub(super) moved: Vec<f64>,
}

impl<const A: usize, S: Strategy<A>> Pusher<A, S> {
    /// All displacements that nothing resists; an arm does, or a strategy of somebody's own that knows where the origin is.
    pub(super) fn free_translations(&mut self, rest: &[f64]) -> Vec<Translation> {
        let all: Vec<usize> = (0..self.members.len()).collect();
        let groups = if self.kind == SampleKind::Wave { all.iter().map(|peer| vec![*peer]).collect() } else { vec![all] };
        let mut free = Vec::new();
        for axis in 0..A {
            for peers in groups.iter().filter(|peers| !peers.iter().any(|peer| self.layout.tied[*peer])).collect::<Vec<_>>() {
                let moved = self.translation(peers, axis);
                let reached = self.pushed(&moved, Instant::ZERO);
                if moved.iter().zip(reached.iter().zip(rest)).all(|(moved, (reached, rest))| (reached - rest - moved).abs() <= 1e-9) {
                    free.push(Translation { peers: peers.clone(), axis, reference: self.layout.first[peers[0]] + 2 * A + axis, moved });
                }
            }
        }
        free
    }

    /// For each peer and axis, whose copy positions are relative to.
    pub(super) fn relative_to(&self, free: &[Translation]) -> Vec<Vec<Option<usize>>> {
        let reference = |peer: usize, axis: usize| {
            let found = free.iter().find(|free| free.axis == axis && free.peers.contains(&peer));
            found.map(|free| free.peers[0])
        };
        (0..self.members.len()).map(|peer| (0..A).map(|axis| reference(peer, axis)).collect()).collect()
    }

    /// These peers moved by 1 m along an axis, but for devices that touch nothing.
    fn translation(&mut self, peers: &[usize], axis: usize) -> Vec<f64> {
        let mut moved = vec![0.0; self.layout.size];
        for place in peers.iter().copied() {
            let first = self.layout.first[place];
            if self.layout.touching[place] {
                moved[first + axis] = 1.0;
            }
            moved[first + 2 * A + axis] = 1.0;
            // Samples of a client are of its device.
            let is_sample_moved = self.layout.touching[place] || matches!(self.members[place].strategy().role(), Role::Copy);
            for age in (0..self.timetable.depth[place]).filter(|_| is_sample_moved) {
                moved[self.layout.samples[place] + age * self.layout.sample_len::<A>() + axis] = 1.0;
            }
        }
        // Strategies may remember positions: after a tick for each number of the memory those have moved as well.
        if self.layout.memory.iter().any(|numbers| *numbers > 0) {
            let (at_rest, displaced) = (self.remembered(&vec![0.0; moved.len()]), self.remembered(&moved));
            for place in 0..self.members.len() {
                for number in self.layout.memory_of::<A>(place) {
                    moved[number] = displaced[number] - at_rest[number];
                }
            }
            self.settle();
        }
        moved
    }

    /// The state `z` with what strategies remember where nothing has moved for as many ticks and samples as they remember numbers.
    fn remembered(&mut self, z: &[f64]) -> Vec<f64> {
        self.restore(z, EARLIER);
        // A frame may begin with nothing held that is used in it; here a sample from every peer is in use.
        let copies: Vec<State<A>> = self.layout.first.iter().map(|first| state(&z[first + 2 * A..], self.time)).collect();
        for (place, member) in self.members.iter_mut().enumerate() {
            let others = copies.iter().enumerate().filter(|(other, _)| *other != place).map(|(_, state)| *state);
            others.enumerate().for_each(|(other, state)| member.hold(other, EARLIER, state));
        }
        let mut z = z.to_vec();
        for (place, member) in self.members.iter_mut().enumerate() {
            let numbers = self.layout.memory_of::<A>(place);
            for _ in numbers.clone() {
                if self.kind != SampleKind::State {
                    (0..self.layout.receivers).for_each(|receiver| {
                        member.extra(receiver);
                    });
                    member.all_sent();
                }
                member.compute(Instant::ZERO);
            }
            for (entry, number) in z[numbers].iter_mut().zip(member.strategy().memory()) {
                *entry = number * self.remembered;
            }
        }
        z
    }

    /// Goes through a frame at rest, so that what strategies count in ticks stands as it does whenever a frame begins: a wave that is in use then has come
    /// in the frame before, which is not shorter than the wave.
    pub(super) fn settle(&mut self) {
        if self.kind != SampleKind::State {
            let rest = vec![0.0; self.layout.size];
            self.pushed(&rest, Instant::ZERO);
        }
    }
}
