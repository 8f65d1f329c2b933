//! Displacements that no force resists: of all peers together, or of each peer alone if samples are waves, which carry no position.

use cohaptic_peer::coordination::Role;
use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{State, Strategy};
use cohaptic_units::Instant;

use super::{EARLIER, Pusher, state};

/// A displacement by 1 m that a frame leaves unchanged.
pub(super) struct Translation {
    /// Indices of the displaced peers.
    peers: Vec<usize>,
    /// Axis of the displacement.
    axis: usize,
    /// Index of the state to which the other positions are relative: the position of the copy of the first displaced peer.
    pub(super) reference: usize,
    /// The displacement as a vector of states.
    pub(super) moved: Vec<f64>,
}

impl<const A: usize, S: Strategy<A>> Pusher<A, S> {
    /// Returns all displacements that nothing resists. An arm resists, and so may a caller's own strategy that depends on absolute positions.
    pub(super) fn free_translations(&mut self, rest: &[f64]) -> Vec<Translation> {
        let all: Vec<usize> = (0..self.members.len()).collect();
        let groups = if self.kind == SampleKind::Wave { all.iter().map(|peer| vec![*peer]).collect() } else { vec![all] };
        let mut free = Vec::new();
        for axis in 0..A {
            for peers in groups.iter().filter(|peers| !peers.iter().any(|peer| self.layout.tied[*peer])).collect::<Vec<_>>() {
                let moved = self.translation(peers, axis);
                // The displacement is free if the frame, apart from its motion from rest, returns the vector itself.
                let reached = self.pushed(&moved, Instant::ZERO);
                if moved.iter().zip(reached.iter().zip(rest)).all(|(moved, (reached, rest))| (reached - rest - moved).abs() <= 1e-9) {
                    free.push(Translation { peers: peers.clone(), axis, reference: self.layout.first[peers[0]] + 2 * A + axis, moved });
                }
            }
        }
        free
    }

    /// Returns the peer to whose copy positions are relative, indexed by peer and axis; `None` for absolute positions.
    pub(super) fn relative_to(&self, free: &[Translation]) -> Vec<Vec<Option<usize>>> {
        let reference = |peer: usize, axis: usize| {
            let found = free.iter().find(|free| free.axis == axis && free.peers.contains(&peer));
            found.map(|free| free.peers[0])
        };
        (0..self.members.len()).map(|peer| (0..A).map(|axis| reference(peer, axis)).collect()).collect()
    }

    /// Returns the state in which the given peers are moved by 1 m along an axis. Devices that touch nothing stay where they are.
    fn translation(&mut self, peers: &[usize], axis: usize) -> Vec<f64> {
        let mut moved = vec![0.0; self.layout.size];
        for place in peers.iter().copied() {
            let first = self.layout.first[place];
            if self.layout.touching[place] {
                self.layout.positions_of_device::<A>(place, axis).for_each(|position| moved[position] = 1.0);
            }
            moved[first + 2 * A + axis] = 1.0;
            // The samples of a client are positions of its device, which moves only if the client touches the object.
            let is_sample_moved = self.layout.touching[place] || matches!(self.members[place].strategy().role(), Role::Copy);
            for age in (0..self.timetable.depth[place]).filter(|_| is_sample_moved) {
                moved[self.layout.samples[place] + age * self.layout.sample_len::<A>() + axis] = 1.0;
            }
        }
        // Strategies may remember positions. After as many ticks as the memory has numbers, the remembered positions have moved too.
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

    /// Returns the state `z` with the memory of each strategy replaced by its memory after as many ticks and samples at rest as the memory has numbers.
    fn remembered(&mut self, z: &[f64]) -> Vec<f64> {
        self.restore(z, EARLIER);
        // `restore` holds only samples that the frame uses. The strategies compute here outside a frame, so each holds a sample of every other peer.
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

    /// Runs a frame at rest, so that the strategies' counters of ticks have the values of the beginning of any later frame. A wave in use at that instant
    /// arrived in the frame before, because a frame is not shorter than a wave.
    pub(super) fn settle(&mut self) {
        if self.kind != SampleKind::State {
            let rest = vec![0.0; self.layout.size];
            self.pushed(&rest, Instant::ZERO);
        }
    }
}
