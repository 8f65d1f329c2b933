//! Bound of the rounding errors of a frame, close even for fast growing disturbances.
//!
//! With T the matrix of a tick, the computed rows ẑ obey ẑ⁺ = T·ẑ + r. Each operation rounds the added terms, so r is at most u·|T|·s row by row, where s holds
//! the sums of absolute values of the computed rows and |T| the absolute values of the terms of a tick. Hence two recursions over the same events,
//!
//! ```text
//! s⁺ = |T|·s        e⁺ = |T|·e + u·|T|·s
//! ```
//!
//! bound the sums and their errors. The recursions use only the parameters of the nodes, no entry of the frame's matrix. For stiff gains |T| grows by a factor
//! near the growth by T: with a = KT·h²/(2m), the copy alone grows by about a − 3 per tick and its majorant by a + 4. So e stays about u times the number of
//! ticks times s, even if the square of the growth ([`Rounding`](super::Rounding)) is useless as a bound.

use std::collections::VecDeque;

use cohaptic_peer::Exchange;

use super::node::{Body, Node, Scale};
use super::operator::Seen;
use super::system::Lifted;
use crate::rounding::real;
use crate::timetable::Event;

/// Rounding error of the operations of a tick, relative to the added terms: at most fifteen operations in a row, among them the rounding of the
/// coefficients of step maps and of the units.
const TICK: f64 = 16.0 * f64::EPSILON;
/// Rounding error of a sample, and of the mean of samples; the mean has a further rounding for each number of each node.
const MEAN: f64 = 6.0 * f64::EPSILON;

/// A bound of the sum of absolute values of a row, and a bound of the row's error.
#[derive(Clone, Copy, Debug)]
struct Size {
    sum: f64,
    error: f64,
}

impl Size {
    const UNIT: Self = Self { sum: 1.0, error: 0.0 };
    const ZERO: Self = Self { sum: 0.0, error: 0.0 };

    fn plus(self, factor: f64, other: Self) -> Self {
        Self { sum: self.sum + factor.abs() * other.sum, error: self.error + factor.abs() * other.error }
    }

    /// Returns the size with the error of a further rounding, of the share `by` of the sum.
    fn rounded(self, by: f64) -> Self {
        Self { error: self.error + by * self.sum, ..self }
    }
}

/// Sizes of the rows of a node.
#[derive(Clone, Debug)]
struct NodeSizes {
    device: [Size; 2],
    copy: [Size; 2],
    /// Sizes of the forces at the next tick, on the copy and on the device \[N\].
    pending: [Size; 2],
    /// Sizes of the device at the latest exchange, and of the reading that the coupling uses.
    latest: [Size; 2],
    reading: [Size; 2],
    /// Size of the force that the device keeps \[N\].
    kept: Size,
    /// Sizes of the numbers of the law's memory, in the law's own units.
    memory: Vec<Size>,
    /// Sizes of the used combinations of the own states of the latest ticks, the newest first.
    past: VecDeque<Size>,
    /// Size of the wanted place of the operator's arm.
    wanted: Size,
    /// Sizes of the places that the operator saw in this frame, in the order of the ticks.
    seen: Vec<Size>,
}

impl Lifted<'_> {
    /// Returns a bound of the rounding errors of a frame: see [`error_of`].
    pub(crate) fn error(&self) -> f64 {
        let compliance = self.nodes[0].compliance(self.time);
        error_of(self, |_| compliance)
    }
}

/// Returns a bound of the errors of all rows of a frame as one matrix, in the 2-norm: of the states at the end and of the samples sent, as positions and
/// velocities, relative to the reference or not. `compliance` returns the factor [m/N] by which the waiting forces of a node become lengths.
pub(crate) fn error_of(lifted: &Lifted<'_>, compliance: impl Fn(usize) -> f64) -> f64 {
    let nodes = lifted.nodes.len();
    let unit = |node: usize, place: usize| lifted.nodes[node].memory_unit(place, Scale { time: lifted.time, compliance: compliance(node) });
    let begin = |node: usize| {
        let force = Size { sum: 1.0 / compliance(node), error: 0.0 };
        let memory = (0..lifted.nodes[node].law.memory.len()).map(|place| Size { sum: 1.0 / unit(node, place), error: 0.0 }).collect();
        NodeSizes {
            device: [Size::UNIT; 2],
            copy: [Size::UNIT; 2],
            pending: [force; 2],
            latest: [Size::UNIT; 2],
            reading: [Size::UNIT; 2],
            kept: force,
            memory,
            past: vec![Size::UNIT; lifted.nodes[node].looks_back()].into(),
            wanted: Size::UNIT,
            seen: Vec::new(),
        }
    };
    let mut sizes: Vec<NodeSizes> = (0..nodes).map(begin).collect();
    let (sampling, time) = (lifted.sampling, lifted.time);
    let channels = sampling.channels();
    let signal = |[x, v]: [Size; 2]| -> Vec<Size> {
        let of = |channel| {
            let (position, velocity) = sampling.gains(channel, time);
            Size::ZERO.plus(position, x).plus(velocity, v)
        };
        (0..channels).map(of).collect()
    };
    let before = signal([Size::UNIT; 2]);
    let mut sent: Vec<Vec<Vec<Size>>> = vec![Vec::new(); nodes];
    let mut squares = 0.0;
    let reference = |sizes: &[NodeSizes]| if lifted.tied { Size::ZERO } else { sizes[0].copy[0] };
    // Samples are taken relative to the reference at the end of the frame, still unknown here. Their own errors are noted now, and the error of the
    // reference is added at the end.
    let mut positions: Vec<Size> = Vec::new();
    let of_sample = |sent: &[Vec<Vec<Size>>], node: usize, sample: i64| {
        usize::try_from(sample).ok().map_or_else(|| before.clone(), |number| sent[node][number].clone())
    };
    let oldest = lifted.timetable.oldest();
    let mut held: Vec<Option<Vec<Size>>> = vec![None; nodes * nodes];
    for (to, from, sample) in &lifted.timetable.held {
        held[to * nodes + from] = Some(of_sample(&sent, *from, *sample));
    }
    for event in &lifted.timetable.events {
        match *event {
            Event::Sample { node } => {
                let copy = sizes[node].copy;
                positions.push(copy[0]);
                // The velocity of a sample does not depend on the reference, so the error of the velocity is final.
                squares += copy[1].error * copy[1].error;
                sent[node].push(signal(copy).into_iter().map(|size| size.rounded(MEAN)).collect());
            }
            // A held sample keeps its size until the next delivery. Its coefficients do not change in between.
            Event::Deliver { from, to, sample } => held[to * nodes + from] = Some(of_sample(&sent, from, sample)),
            Event::Tick { node, span, exchanges, .. } => {
                let mut heard = vec![Size::ZERO; 1 + lifted.nodes[node].law.memory.len()];
                for from in 0..nodes {
                    for (channel, number) in held[node * nodes + from].iter().flatten().enumerate() {
                        // Every sample counts with the age of the oldest sample, because the gains grow with the age: the bound then covers all ages.
                        for (heard, by) in heard.iter_mut().zip(lifted.nodes[node].heard(sampling, channel, oldest, time)) {
                            *heard = heard.plus(lifted.weights[(node, from)] * sampling.of_gains(by, time), *number);
                        }
                    }
                }
                heard.iter_mut().for_each(|heard| *heard = heard.rounded(MEAN + real(channels * nodes) * f64::EPSILON));
                let sees = match lifted.nodes[node].operator.map(|operator| operator.sees) {
                    Some(Seen::Own) => sizes[node].copy[0],
                    // The first number of a whole sample is the position.
                    Some(Seen::Held { from }) => held[node * nodes + from].as_ref().map_or(Size::ZERO, |sample| sample[0]),
                    Some(Seen::Nothing) | None => Size::ZERO,
                };
                tick(&lifted.nodes[node], &mut sizes[node], &heard, sees, lifted, (span, exchanges));
            }
        }
    }
    let origin = reference(&sizes);
    let mut add = |size: Size, origin: Size| {
        let error = size.error + origin.error + f64::EPSILON * (size.sum + origin.sum);
        squares += error * error;
    };
    positions.into_iter().for_each(|position| add(position, origin));
    for (node, size) in sizes.iter().enumerate() {
        if lifted.nodes[node].device.is_some() {
            add(size.device[0], origin);
            add(size.device[1], Size::ZERO);
        }
        add(size.copy[0], origin);
        add(size.copy[1], Size::ZERO);
        if lifted.nodes[node].compute_delay {
            size.pending.iter().for_each(|force| add(Size::ZERO.plus(compliance(node), *force).rounded(f64::EPSILON), Size::ZERO));
        }
        let exchange = lifted.nodes[node].exchanges();
        for [position, velocity] in
            [(exchange.late, size.latest), (exchange.holds(), size.reading)].into_iter().filter_map(|(is, size)| is.then_some(size))
        {
            add(position, origin);
            add(velocity, Size::ZERO);
        }
        if exchange.holds() {
            add(Size::ZERO.plus(compliance(node), size.kept).rounded(f64::EPSILON), Size::ZERO);
        }
        // The reference counts in each number by the share of the position, a share of at most 1.
        size.past.iter().for_each(|number| add(*number, origin));
        if lifted.nodes[node].operator.is_some() {
            add(size.wanted, origin);
            size.seen.iter().for_each(|place| add(*place, origin));
        }
        let memory = size.memory.iter().enumerate();
        memory.for_each(|(place, number)| add(Size::ZERO.plus(unit(node, place), *number).rounded(2.0 * f64::EPSILON), Size::ZERO));
    }
    // The square root of the sum of squared row errors is the Frobenius norm of a matrix of these errors, and bounds the 2-norm.
    squares.sqrt()
}

/// Makes one tick of a node in sizes: see [`Node::tick`]. `sees` is the size of the place that the operator of the node sees.
fn tick(node: &Node, sizes: &mut NodeSizes, heard: &[Size], sees: Size, lifted: &Lifted<'_>, (span, exchanges): (std::time::Duration, bool)) {
    let time = lifted.time;
    let (wall, gains) = (node.wall.unwrap_or(cohaptic_peer::Gains { stiffness: 0.0, damping: 0.0 }), node.law.force.own);
    let [x, v] = sizes.copy;
    let remembered = |sum: Size, by: &[f64]| by.iter().zip(&sizes.memory).fold(sum, |sum, (by, number)| sum.plus(*by, *number));
    let next = node.law.memory.iter().zip(&heard[1..]).map(|(row, heard)| {
        remembered(heard.plus(row.own.stiffness, x).plus(row.own.damping / time, v), &row.memory)
            .rounded(TICK + real(row.memory.len()) * f64::EPSILON)
    });
    let next: Vec<Size> = next.collect();
    let mut on_copy =
        remembered(heard[0], &node.law.force.memory).plus(gains.stiffness + wall.stiffness, x).plus((gains.damping + wall.damping) / time, v);
    if let Some(oldest) = sizes.past.pop_back() {
        let (unit, past) = (node.past_unit(time), node.law.force.past);
        on_copy = on_copy.plus(unit, oldest);
        sizes.past.push_front(Size::ZERO.plus(past.stiffness / unit, x).plus(past.damping / time / unit, v).rounded(MEAN));
    }
    // Every term of a force counts with its absolute value: signs must not cancel in a bound.
    let mut on_device = Size::ZERO;
    if node.device.is_some() {
        let [xh, vh] = read(node, sizes, exchanges);
        let (stiffness, damping) = (node.coupling.stiffness, node.coupling.damping / time);
        on_device = Size::ZERO.plus(stiffness, xh).plus(stiffness, x).plus(damping, vh).plus(damping, v);
        on_copy = on_copy.plus(1.0, on_device);
    }
    sizes.memory = next;
    let mut of_hand = Size::ZERO;
    if let Some(operator) = &node.operator {
        sizes.seen.push(sees);
        // A place of an earlier frame is a state, with the size 1.
        let acts = (sizes.seen.len() - 1).checked_sub(operator.lag).map_or(Size::UNIT, |tick| sizes.seen[tick]);
        let speed = Size::ZERO.plus(operator.crossover, acts);
        of_hand = of_hand.plus(operator.arm.stiffness, sizes.wanted).plus(operator.arm.damping, speed);
        sizes.wanted = sizes.wanted.plus(operator.tick, speed).rounded(TICK);
    }
    if node.compute_delay {
        // The computed forces wait as lengths and act a tick later, so the forces now are those computed before.
        let computed = [on_copy.rounded(TICK), on_device.rounded(TICK)];
        [on_copy, on_device] = std::mem::replace(&mut sizes.pending, computed);
    }
    if node.exchanges().holds() {
        // Stored as a length and read as a force, so that each of both rounds.
        if exchanges {
            sizes.kept = on_device.rounded(TICK);
        }
        on_device = sizes.kept;
    }
    advance(&node.object, &mut sizes.copy, on_copy, time, span);
    if let Some(device) = &node.device {
        // The force of the hand acts at its own tick, also where computed forces wait.
        advance(device, &mut sizes.device, on_device.plus(1.0, of_hand), time, span);
    }
}

/// Reads the device as a tick of a node with or without an exchange does, and returns the sizes that the coupling uses.
fn read(node: &Node, sizes: &mut NodeSizes, exchanges: bool) -> [Size; 2] {
    let exchange = node.exchanges();
    if exchange == Exchange::EACH_TICK {
        return sizes.device;
    }
    if exchanges {
        sizes.reading = if exchange.late { sizes.latest } else { sizes.device };
        sizes.latest = sizes.device;
    }
    sizes.reading
}

// A step map adds e·z and g·F to the state. The terms count with absolute values, and the exact maps round `factor` times as much.
fn advance(body: &Body, [x, v]: &mut [Size; 2], force: Size, time: f64, span: std::time::Duration) {
    let (e, g, factor) = body.sizes(span);
    let position = x.plus(e[0][0], *x).plus(e[0][1] / time, *v).plus(g[0], force).rounded(TICK * factor);
    let velocity = v.plus(e[1][0] * time, *x).plus(e[1][1], *v).plus(g[1] * time, force).rounded(TICK * factor);
    (*x, *v) = (position, velocity);
}
