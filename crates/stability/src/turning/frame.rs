//! Linear frame of turning copies, and its matrix, computed unit vector by unit vector.

use cohaptic_peer::Motion;

use super::algebra::apply;
use super::node::Node;
use super::rigid::Displacement;
use crate::cost::{PartCost, pushed_operations};
use crate::rounding::real;

use crate::timetable::{Event, Instants, Timetable};
use crate::{Matrix, Watch};

/// Number of states of a sample: six components of the copy and their velocities.
pub(super) const SAMPLE: usize = 12;

/// System of nodes coupled through samples.
///
/// A state has, for each node, the components of the copy, their velocities, the components of the device, their velocities, and the forces applied a
/// tick late. The samples of earlier frames follow for each node, the newest sample first.
#[derive(Clone, Debug)]
pub(crate) struct Turning<'a> {
    pub(super) nodes: &'a [Node],
    /// Weight of each node's samples (column) in the target of each node (row).
    pub(super) weights: &'a Matrix,
    pub(super) timetable: &'a Timetable,
    /// Time by which velocities are multiplied to become lengths \[s\].
    pub(super) time: f64,
    /// Displacements of everything without a resisting force, removed from the matrix.
    pub(super) free: Vec<Displacement>,
}

/// Function called at each tick with the node, the instant in the frame \[ns\] and the device before its motion. Returns a component of the device and the
/// force on that component, or `None`.
pub(crate) type Hand<'h> = dyn FnMut(usize, u64, &[Motion]) -> Option<(usize, f64)> + 'h;

impl Turning<'_> {
    /// Returns the cost of the matrix and of its eigenvalues.
    pub(crate) fn cost(&self) -> PartCost {
        PartCost::of_full(self.size(), self.timetable.events.len(), 6)
    }

    /// Returns the matrix of a frame without the free displacements, and a bound of the error of its entries; `None` if the watcher ends the computation.
    pub(super) fn monodromy(&self, watch: &dyn Watch) -> Option<(Matrix, f64)> {
        self.monodromy_under(&mut |_, _, _| None, watch)
    }

    /// Like [`Turning::monodromy`], with a hand called in the frame of each unit vector, in the order of [`Turning::kept`].
    pub(crate) fn monodromy_under(&self, hand: &mut Hand<'_>, watch: &dyn Watch) -> Option<(Matrix, f64)> {
        let (size, events) = (self.size(), self.timetable.events.len());
        let moved: Vec<Vec<f64>> = self.free.iter().map(|free| self.displaced(free)).collect();
        let kept = self.kept();
        let mut matrix = Matrix::zeros(kept.len(), kept.len());
        let (mut unit, mut growth) = (vec![0.0; size], 1.0_f64);
        for (column, state) in kept.iter().enumerate() {
            if watch.stops() {
                return None;
            }
            // The unit vector is reset after its push, so that one buffer serves all columns.
            unit[*state] = 1.0;
            let reached = self.pushed_under(&unit, &mut growth, hand);
            unit[*state] = 0.0;
            for (row, entry) in self.relative(&reached, &kept, &moved).enumerate() {
                matrix[(row, column)] = entry;
            }
            watch.done(pushed_operations(events, 6));
        }
        let ticks = self.timetable.events.iter().filter(|event| matches!(event, Event::Tick { .. })).count();
        // As for objects without turns: each tick rounds, and the rest of the frame magnifies the rounding by at most about the growth.
        let error = 10.0 * f64::EPSILON * real(ticks) * growth * growth * real(kept.len()).sqrt();
        Some((matrix, error))
    }

    /// Returns the state after a frame from rest under the forces of a hand, in the coordinates of [`Turning::monodromy`].
    pub(crate) fn forced(&self, hand: &mut Hand<'_>) -> Vec<f64> {
        let moved: Vec<Vec<f64>> = self.free.iter().map(|free| self.displaced(free)).collect();
        let reached = self.pushed_under(&vec![0.0; self.size()], &mut 0.0, hand);
        self.relative(&reached, &self.kept(), &moved).collect()
    }

    /// Returns the kept states of `reached`, minus the motion of the references along the free displacements. `moved` are the states of these displacements.
    fn relative<'r>(&'r self, reached: &'r [f64], kept: &'r [usize], moved: &'r [Vec<f64>]) -> impl Iterator<Item = f64> + 'r {
        kept.iter().map(move |target| {
            let along: f64 = self.free.iter().zip(moved).map(|(free, moved)| reached[free.reference] * moved[*target]).sum();
            reached[*target] - along
        })
    }

    /// Returns whether a free displacement moves the component `component` of a node's device, or no force depends on the component's position.
    pub(crate) fn moves_freely(&self, node: usize, component: usize) -> bool {
        let displaced = self.free.iter().any(|free| free.nodes[node].1[component] != 0.0);
        displaced || self.nodes[node].loose().any(|loose| loose == component)
    }

    /// Returns the indices of the kept states: all but the references of free displacements and the positions without an effect on forces.
    pub(super) fn kept(&self) -> Vec<usize> {
        let firsts = self.firsts();
        let mut left_out: Vec<usize> = self.free.iter().map(|free| free.reference).collect();
        for (node, first) in self.nodes.iter().zip(&firsts) {
            left_out.extend(node.loose().map(|component| first + 12 + component));
        }
        (0..self.size()).filter(|state| !left_out.contains(state)).collect()
    }

    /// Returns the index of the first state of each node.
    fn firsts(&self) -> Vec<usize> {
        self.nodes.iter().scan(0, |next, node| Some(std::mem::replace(next, *next + node.states()))).collect()
    }

    pub(super) fn size(&self) -> usize {
        self.nodes.iter().map(Node::states).sum::<usize>() + SAMPLE * self.timetable.depth.iter().sum::<usize>()
    }

    /// Returns the state at rest with copies, samples of copies and devices displaced by `by`.
    pub(super) fn displaced(&self, by: &Displacement) -> Vec<f64> {
        let mut state = vec![0.0; self.size()];
        for ((copy, device), first) in by.nodes.iter().zip(self.firsts()) {
            state[first..first + 6].copy_from_slice(copy);
            state[first + 12..first + 12 + device.len()].copy_from_slice(device);
        }
        let mut next: usize = self.nodes.iter().map(Node::states).sum();
        for ((copy, _), depth) in by.nodes.iter().zip(&self.timetable.depth) {
            for sample in state[next..next + depth * SAMPLE].chunks_exact_mut(SAMPLE) {
                sample[..6].copy_from_slice(copy);
            }
            next += depth * SAMPLE;
        }
        state
    }

    /// Returns the state after a frame without a hand.
    pub(super) fn reached(&self, state: &[f64]) -> Vec<f64> {
        self.pushed_under(state, &mut 0.0, &mut |_, _, _| None)
    }

    /// Returns a state at rest with the forces computed by the peers at `state` as its late forces.
    #[cfg(test)]
    pub(super) fn computed(&self, state: &[f64]) -> Vec<f64> {
        let mut waiting = vec![0.0; state.len()];
        for (node, first) in self.nodes.iter().zip(self.firsts()) {
            let mut peer = Moving::read(node, &state[first..], self.time);
            peer.tick(node, &[0.0; 6], None, std::time::Duration::from_millis(1));
            let mut written = vec![0.0; node.states()];
            peer.write(node, &mut written, self.time);
            let forces = 12 + 2 * node.device.len();
            waiting[first + forces..first + node.states()].copy_from_slice(&written[forces..]);
        }
        waiting
    }

    /// Returns the state after a frame under the forces of a hand. Raises `growth` to the largest component of a peer on the way, velocities as lengths.
    fn pushed_under(&self, state: &[f64], growth: &mut f64, hand: &mut Hand<'_>) -> Vec<f64> {
        let nodes = self.nodes.len();
        let firsts = self.firsts();
        let mut peers: Vec<Moving> = self.nodes.iter().zip(&firsts).map(|(node, first)| Moving::read(node, &state[*first..], self.time)).collect();
        // `samples` has the oldest sample of each node first, and samples of this frame are appended. In the state the newest sample is first.
        let mut next: usize = self.nodes.iter().map(Node::states).sum();
        let mut samples: Vec<Vec<[Motion; 6]>> = Vec::with_capacity(nodes);
        for depth in &self.timetable.depth {
            let earlier = state[next..next + depth * SAMPLE].chunks_exact(SAMPLE).map(|sample| motions(sample, self.time));
            samples.push(earlier.rev().collect());
            next += depth * SAMPLE;
        }
        let instants = Instants::of(self.timetable);
        let mut held: Vec<Option<i64>> = vec![None; nodes * nodes];
        for (to, from, sample) in &self.timetable.held {
            held[to * nodes + from] = Some(*sample);
        }
        for event in &self.timetable.events {
            match *event {
                Event::Sample { node } => samples[node].push(peers[node].copy),
                Event::Deliver { from, to, sample } => held[to * nodes + from] = Some(sample),
                Event::Tick { node: to, at, span, .. } => {
                    // The force of a sample is linear in the sample, so weighted sums over the senders are added component by component.
                    let node = &self.nodes[to];
                    let mut drawn = [0.0; 6];
                    for from in 0..nodes {
                        let Some(number) = held[to * nodes + from] else { continue };
                        let age = instants.age((to, from), number, at, self.timetable.frame).min(node.horizon);
                        // Sample 0 is the first of this frame; `depth` earlier samples come before, so the index is not negative.
                        let earlier = i64::try_from(self.timetable.depth[from]).unwrap_or(0);
                        let sample = &samples[from][usize::try_from(earlier + number).unwrap_or(0)];
                        for (axis, force) in drawn.iter_mut().enumerate() {
                            let (gains, moved) = (&node.heard[axis], &sample[axis]);
                            *force += self.weights[(to, from)]
                                * (gains.stiffness * moved.position + (gains.damping + node.ahead[axis] * age) * moved.velocity);
                        }
                        if let Some(stress) = &node.stress {
                            let [by_turn, by_rate] = &stress.heard[from];
                            let (turn, rate) = (apply(by_turn, turned(sample)), apply(by_rate, spun(sample)));
                            (0..3).for_each(|axis| drawn[3 + axis] += self.weights[(to, from)] * (turn[axis] + rate[axis]));
                        }
                    }
                    let push = hand(to, at, &peers[to].device);
                    peers[to].tick(node, &drawn, push, span);
                    *growth = growth.max(peers[to].largest(self.time));
                }
            }
        }
        let mut reached = vec![0.0; state.len()];
        for ((node, peer), first) in self.nodes.iter().zip(&peers).zip(&firsts) {
            peer.write(node, &mut reached[*first..], self.time);
        }
        let mut next: usize = self.nodes.iter().map(Node::states).sum();
        for (samples, depth) in samples.iter().zip(&self.timetable.depth) {
            // The newest `depth` samples are the states of the next frame, newest first.
            for sample in samples.iter().rev().take(*depth) {
                write(sample, &mut reached[next..], self.time);
                next += SAMPLE;
            }
        }
        reached
    }
}

/// Present state of a node during a frame.
#[derive(Clone, Debug)]
struct Moving {
    copy: [Motion; 6],
    device: Vec<Motion>,
    /// Forces on the components of the copy at the next tick, if the peer applies forces a tick late.
    on_copy: [f64; 6],
    on_device: Vec<f64>,
}

impl Moving {
    fn read(node: &Node, state: &[f64], time: f64) -> Self {
        let devices = node.device.len();
        let device = |component: usize| Motion { position: state[12 + component], velocity: state[12 + devices + component] / time };
        let waiting = |component: usize| state[12 + 2 * devices + component] / (time * node.mobility);
        let on_copy = std::array::from_fn(|axis| if node.compute_delay { waiting(axis) } else { 0.0 });
        let on_device = (0..devices).map(|axis| if node.compute_delay && node.touching { waiting(6 + axis) } else { 0.0 }).collect();
        Self { copy: motions(state, time), device: (0..devices).map(device).collect(), on_copy, on_device }
    }

    fn write(&self, node: &Node, state: &mut [f64], time: f64) {
        write(&self.copy, state, time);
        let devices = self.device.len();
        for (component, motion) in self.device.iter().enumerate() {
            state[12 + component] = motion.position;
            state[12 + devices + component] = motion.velocity * time;
        }
        if node.compute_delay {
            let waiting = self.on_copy.iter().chain(if node.touching { self.on_device.as_slice() } else { &[] });
            for (entry, force) in state[12 + 2 * devices..].iter_mut().zip(waiting) {
                *entry = force * time * node.mobility;
            }
        }
    }

    /// Advances the node by a tick. `drawn` are the forces of the held samples on the copy; `push` is a component of the device and a hand's force on this
    /// component.
    fn tick(&mut self, node: &Node, drawn: &[f64; 6], push: Option<(usize, f64)>, span: std::time::Duration) {
        let mut on_copy: [f64; 6] = std::array::from_fn(|axis| drawn[axis] - node.own[axis].force(self.copy[axis]));
        let mut on_device = vec![0.0; self.device.len()];
        let mut by_hand = [0.0; 3];
        if let Some(stress) = &node.stress {
            let (angle, own) = (turned(&self.copy), apply(&stress.own, turned(&self.copy)));
            (0..3).for_each(|axis| on_copy[3 + axis] += own[axis]);
            if let Some(twist) = &stress.twist {
                let (handle, rate) = (turned(&self.device), spun(&self.device));
                let by = [angle, handle, spun(&self.copy), rate];
                let torque: [f64; 3] = std::array::from_fn(|axis| twist.by.iter().zip(by).map(|(matrix, by)| apply(matrix, by)[axis]).sum());
                // The reaction on the device changes with the turns of copy and device too, and not only with the torque: see `Twist::back`.
                let back = [torque, angle, handle];
                for axis in 0..3 {
                    on_copy[3 + axis] += torque[axis];
                    on_device[3 + axis] = twist.back.iter().zip(back).map(|(matrix, by)| apply(matrix, by)[axis]).sum();
                }
                by_hand = apply(&twist.hand, handle);
            }
        }
        // The coupling ties a component of the device to the combination `grip` of the copy's components. Action and reaction use the same combination.
        if node.touching {
            let (positions, velocities) = (self.copy.map(|motion| motion.position), self.copy.map(|motion| motion.velocity));
            for (component, grip) in node.grip.iter().enumerate() {
                let held = Motion { position: dot(grip, &positions), velocity: dot(grip, &velocities) };
                let force = node.coupling[component].force(self.device[component].relative_to(held));
                on_device[component] -= force;
                for (axis, sum) in on_copy.iter_mut().enumerate() {
                    *sum += grip[axis] * force;
                }
            }
        }
        // Now the forces of the previous tick act, and the present forces wait for the next tick.
        if node.compute_delay {
            std::mem::swap(&mut self.on_copy, &mut on_copy);
            std::mem::swap(&mut self.on_device, &mut on_device);
        }
        // The forces of hands are added after the exchange, because a compute delay does not concern hands.
        if let Some((component, force)) = push {
            on_device[component] += force;
        }
        for (force, by_hand) in on_device.iter_mut().skip(3).zip(by_hand) {
            *force += by_hand;
        }
        for ((motion, body), force) in self.copy.iter_mut().zip(&node.copy).zip(on_copy) {
            body.map(span).advance(motion, force);
        }
        for ((motion, body), force) in self.device.iter_mut().zip(&node.device).zip(on_device) {
            body.map(span).advance(motion, force);
        }
    }

    /// Returns the largest sum of a component's size and of its velocity's size as a length.
    fn largest(&self, time: f64) -> f64 {
        let size = |motion: &Motion| motion.position.abs() + time * motion.velocity.abs();
        self.copy.iter().chain(&self.device).map(size).fold(0.0, f64::max)
    }
}

fn motions(numbers: &[f64], time: f64) -> [Motion; 6] {
    std::array::from_fn(|axis| Motion { position: numbers[axis], velocity: numbers[6 + axis] / time })
}

fn write(motions: &[Motion; 6], numbers: &mut [f64], time: f64) {
    for (axis, motion) in motions.iter().enumerate() {
        numbers[axis] = motion.position;
        numbers[6 + axis] = motion.velocity * time;
    }
}

/// Returns the angles of a body, its components 3 to 5.
fn turned(components: &[Motion]) -> [f64; 3] {
    std::array::from_fn(|axis| components[3 + axis].position)
}

/// Returns the angular velocity of a body, the velocities of its components 3 to 5.
fn spun(components: &[Motion]) -> [f64; 3] {
    std::array::from_fn(|axis| components[3 + axis].velocity)
}

fn dot(row: &[f64; 6], components: &[f64; 6]) -> f64 {
    row.iter().zip(components).map(|(by, component)| by * component).sum()
}
