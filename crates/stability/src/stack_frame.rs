//! The frame of a single node, computed in arrays on the stack. When all peers of a scene are alike, each cell of a map costs little more than a few frames on
//! the stack.
//!
//! The operations and their order equal the operations of [`Lifted::frame`](crate::lifted::Lifted::frame), and the resulting matrix is the same to the bit.
//! Only the bookkeeping is done once for each timetable: the used samples of earlier frames, and the order of samples, deliveries and ticks.

use std::time::Duration;

use cohaptic_peer::{Exchange, Gains, Motion, StepMap, tick};

use crate::Matrix;
use crate::lifted::node::{Scale, coordination_of};
use crate::lifted::{Lifted, Node, Rounding};
use crate::timetable::{Event, Timetable};

/// The largest number of samples of earlier frames, and the largest number of samples sent in one frame. Frames with more take the general path.
const MOST_SAMPLES: usize = 4;
/// The largest number of states: positions and velocities of a device and a copy.
const MOST_STATES: usize = 4;

/// Steps of a frame of a single node that receives its own samples. All numbers fit on the stack, within [`MOST_SAMPLES`] and [`MOST_STATES`].
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct StackFrame {
    steps: Vec<Step>,
    /// Ages of the used samples of earlier frames, ascending; the newest sample of the previous frame has age 1.
    used: Vec<usize>,
    /// Index of the sample held at the beginning of the frame, among the samples: used samples of earlier frames first, then the samples of the frame.
    held: Option<usize>,
    /// Number of samples sent in the frame.
    sent: usize,
    /// Number of samples of earlier frames among the states of the monodromy matrix.
    depth: usize,
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Step {
    Sample,
    /// The node holds this sample from here on. Samples are indexed with the used samples of earlier frames first, then the samples of this frame.
    Deliver(usize),
    Tick(Duration),
}

/// The numbers of a frame, besides the steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StackNode<'a> {
    pub(crate) node: &'a Node,
    /// Weight of the node's own samples in its target.
    pub(crate) weight: f64,
    /// Gains KT and BT of the law; not both zero.
    pub(crate) coordination: Gains,
    /// Common time \[s\]. Velocities times the common time are lengths.
    pub(crate) time: f64,
    pub(crate) tied: bool,
}

impl<'a> StackNode<'a> {
    /// Returns the only node of a system, if the frame can be computed on the stack: forces act without a delay, the device exchanges at each tick, no operator
    /// moves the hand, and the law is a pull towards the mean with gains not both zero. `None` for any other system.
    pub(crate) fn of(lifted: &Lifted<'a>) -> Option<Self> {
        let [node] = lifted.nodes else { return None };
        let coordination = node.law.pull().filter(|gains| gains.stiffness + gains.damping > 0.0)?;
        if node.compute_delay || node.operator.is_some() || node.exchanges() != Exchange::EACH_TICK {
            return None;
        }
        Some(Self { node, weight: lifted.weights[(0, 0)], coordination, time: lifted.time, tied: lifted.tied })
    }
}

impl StackFrame {
    /// Returns the steps of a timetable; `None` if the timetable is not of one node, or has more samples than the stack has room for.
    pub(crate) fn of(timetable: &Timetable) -> Option<Self> {
        let ([sent], [depth]) = (timetable.sent.as_slice(), timetable.depth.as_slice()) else { return None };
        let deliveries = timetable.events.iter().filter_map(|event| match event {
            Event::Deliver { sample, .. } => Some(*sample),
            Event::Sample { .. } | Event::Tick { .. } => None,
        });
        let samples = timetable.held.iter().map(|(_, _, sample)| *sample).chain(deliveries);
        let mut used: Vec<usize> = samples.filter_map(|sample| usize::try_from(-sample).ok().filter(|age| *age > 0)).collect();
        used.sort_unstable();
        used.dedup();
        if used.len() > MOST_SAMPLES || *sent > MOST_SAMPLES {
            return None;
        }
        // Samples of this frame have numbers from zero on; a negative number is the age of a sample of an earlier frame.
        let place = |sample: i64| match usize::try_from(sample) {
            Ok(number) => Some(used.len() + number),
            Err(_) => used.iter().position(|age| usize::try_from(-sample) == Ok(*age)),
        };
        let steps = timetable.events.iter().map(|event| match *event {
            Event::Sample { .. } => Some(Step::Sample),
            Event::Deliver { sample, .. } => place(sample).map(Step::Deliver),
            Event::Tick { span, .. } => Some(Step::Tick(span)),
        });
        let steps: Vec<Step> = steps.collect::<Option<_>>()?;
        let held = timetable.held.first().and_then(|(_, _, sample)| place(*sample));
        Some(Self { held, sent: *sent, depth: *depth, steps, used })
    }

    /// Writes the monodromy matrix into `matrix` and returns a bound of the error of its entries, as the largest sum of absolute values of a row; zero without
    /// `BOUND`. `closer` computes another bound and is called only if the quick bound is not below 1.
    pub(crate) fn monodromy<const BOUND: bool>(&self, stack: StackNode<'_>, matrix: &mut Matrix, closer: impl FnOnce() -> f64) -> f64 {
        let states = stack.node.states() - usize::from(!stack.tied);
        // The loop is compiled once for each small number of unknowns, and the compiler can unroll the loops over columns.
        match states + self.used.len() {
            0..=2 => self.run::<2, BOUND>(stack, matrix, closer),
            3 => self.run::<3, BOUND>(stack, matrix, closer),
            4 => self.run::<4, BOUND>(stack, matrix, closer),
            5 => self.run::<5, BOUND>(stack, matrix, closer),
            6 => self.run::<6, BOUND>(stack, matrix, closer),
            _ => self.run::<{ MOST_STATES + MOST_SAMPLES }, BOUND>(stack, matrix, closer),
        }
    }

    fn run<const C: usize, const BOUND: bool>(&self, stack: StackNode<'_>, matrix: &mut Matrix, closer: impl FnOnce() -> f64) -> f64 {
        let StackNode { node, weight, coordination, time, tied } = stack;
        let Gains { stiffness, damping } = coordination;
        // A sample is the combination of position and velocity used by the law, scaled to be a length. Times `unit` [N/m] the sample is a force again.
        let unit = stiffness + damping / time;
        let (position_share, velocity_share) = (stiffness / unit, damping / time / unit);
        let count = node.states();
        let object = count - 2;
        let reference = (!tied).then_some(object);
        let states = count - usize::from(!tied);
        // Every state except the reference position is an unknown. All positions are relative to the reference, so the reference's row begins as zero.
        let mut z = [[0.0; C]; MOST_STATES];
        for row in (0..count).filter(|row| Some(*row) != reference) {
            z[row][row - usize::from(reference.is_some_and(|reference| row > reference))] = 1.0;
        }
        let mut store = [[0.0; C]; 2 * MOST_SAMPLES];
        for place in 0..self.used.len() {
            store[place][states + place] = 1.0;
        }
        let scale = Scale { time, compliance: node.compliance(time) };
        let own = scale.gains(coordination_of(coordination, node.wall));
        let coupling = scale.gains(node.coupling);
        let gain = weight * unit;
        let aim_at = |sample: &[f64; C]| sample.map(|entry| 0.0 + gain * entry);
        let mut aim = self.held.map_or([0.0; C], |held| aim_at(&store[held]));
        let mut next_sent = self.used.len();
        let mut rounding = Rounding::new(if BOUND { node.step_norm(scale).max(1.0) } else { 1.0 });
        let mut maps: Option<(Duration, StepMap, StepMap)> = None;
        for step in &self.steps {
            match *step {
                Step::Sample => {
                    for column in 0..C {
                        store[next_sent][column] = position_share * z[object][column] + velocity_share * z[object + 1][column];
                    }
                    next_sent += 1;
                }
                Step::Deliver(sample) => aim = aim_at(&store[sample]),
                // Most ticks of a frame have the same span, so the step maps of the last span are kept.
                Step::Tick(span) => {
                    let (on_copy, on_device) = match maps {
                        Some((of, on_copy, on_device)) if of == span => (on_copy, on_device),
                        _ => {
                            let on_copy = node.object.scaled_map(span, time);
                            let on_device = node.device.as_ref().map_or(on_copy, |device| device.scaled_map(span, time));
                            maps = Some((span, on_copy, on_device));
                            (on_copy, on_device)
                        }
                    };
                    if node.device.is_some() {
                        let [xh, vh, x, v] = &mut z;
                        for column in 0..C {
                            let mut copy = Motion { position: x[column], velocity: v[column] };
                            let mut device = Motion { position: xh[column], velocity: vh[column] };
                            let held = tick::grasp(&coupling, device.relative_to(copy));
                            let pull = tick::coordinate(&own, copy) - aim[column];
                            on_copy.advance(&mut copy, tick::on_object(held, pull));
                            on_device.advance(&mut device, tick::on_device(0.0, held));
                            (x[column], v[column]) = (copy.position, copy.velocity);
                            (xh[column], vh[column]) = (device.position, device.velocity);
                        }
                    } else {
                        let [x, v, ..] = &mut z;
                        for column in 0..C {
                            let mut copy = Motion { position: x[column], velocity: v[column] };
                            let pull = tick::coordinate(&own, copy) - aim[column];
                            on_copy.advance(&mut copy, tick::on_object(0.0, pull));
                            (x[column], v[column]) = (copy.position, copy.velocity);
                        }
                    }
                    if BOUND {
                        let norm = |row: &[f64; C]| row.iter().map(|entry| entry.abs()).sum::<f64>();
                        rounding.tick(z.iter().take(count).map(norm).fold(0.0, f64::max));
                    }
                }
            }
        }
        let moved = |row: usize| if row == 0 || row == object { 1.0 } else { 0.0 };
        self.assemble(&z, &store, reference.map(|row| (row, stiffness / unit)), (count, states), moved, matrix);
        if BOUND { rounding.bound(closer) } else { 0.0 }
    }

    /// Writes the matrix of the relative state, from the rows of states and samples. `reference` is the row of the reference and the distance by which a
    /// translation of everything by 1 moves a sample; `None` if the motion is tied to ground. `moved` is the same distance for a row of the states.
    fn assemble<const C: usize>(
        &self,
        z: &[[f64; C]; MOST_STATES],
        store: &[[f64; C]; 2 * MOST_SAMPLES],
        reference: Option<(usize, f64)>,
        (count, states): (usize, usize),
        moved: impl Fn(usize) -> f64,
        matrix: &mut Matrix,
    ) {
        let size = states + self.depth;
        if matrix.rows() != size || matrix.columns() != size {
            *matrix = Matrix::zeros(size, size);
        }
        let used = self.used.len();
        let mut put = |row: usize, source: &[f64; C], moved: f64| {
            let row = matrix.row_mut(row);
            row.fill(0.0);
            let origin = reference.map_or(source, |(reference, _)| &z[reference]);
            let moved = if reference.is_some() { moved } else { 0.0 };
            for column in 0..states + used {
                // Unused samples of earlier frames have a column too, which stays zero, so that the matrix maps the whole state.
                let place = if column < states { column } else { states + self.used[column - states] - 1 };
                row[place] = source[column] - moved * origin[column];
            }
        };
        let kept = (0..count).filter(|row| reference.is_none_or(|(reference, _)| *row != reference));
        for (row, source) in kept.enumerate() {
            put(row, &z[source], moved(source));
        }
        let translation = reference.map_or(0.0, |(_, translation)| translation);
        for age in 1..=self.depth {
            let row = states + age - 1;
            if age <= self.sent {
                put(row, &store[used + self.sent - age], translation);
            } else {
                put(row, &[0.0; C], translation);
            }
        }
        // A sample of an earlier frame stays a state and becomes older by the number of samples sent.
        for age in self.sent + 1..=self.depth {
            matrix[(states + age - 1, states + age - self.sent - 1)] += 1.0;
        }
    }
}
