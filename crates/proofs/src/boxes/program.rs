//! A frame as a straight-line program: operations set registers to sums of multiples of registers, step by step.
//!
//! Programs are used for laws with more than a state in a sample. The multiples within a step are affine in each number of a [`super::corners::Point`], as
//! the entries of [`super::steps`] are. Registers without an effect on a body, in this frame or in a later frame, are left out.

use std::collections::{BTreeMap, BTreeSet};

use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{Node, Scale};
use cohaptic_stability::numerics::real;

use super::certificate::Named;
use super::corners::{Point, States, enclosed};
use super::error::ProofError;
use super::span::FrameSpan;
use super::steps::{FrameState, StepMatrix};

/// Variable of the program, set and read by operations.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum Register {
    /// Position or velocity of the device or of the copy of a class.
    Body { class: usize, of_copy: bool, velocity: bool },
    /// Force of the next tick.
    Pending { class: usize, on_copy: bool },
    /// Force of this tick. Operations set the force before reading it, so the force is never a state.
    Force { class: usize, on_copy: bool },
    /// Sampled position or velocity. Samples of a class in this frame are numbered from 0, and −1 is the last sample before the frame.
    Sample { class: usize, number: i64, velocity: bool },
    /// Force for a class in a sample of a server.
    Returned { server: usize, class: usize, number: i64 },
    /// Sum of the waves of a sampling from all other peers to a class, or (`of_others`) from the class to all other peers.
    Waves { class: usize, number: i64, of_others: bool },
}

/// Linear combination: registers with their factors.
pub(super) type Sum = Vec<(Register, f64)>;

/// Registers set at once: every sum reads the values from before the operation.
pub(super) type Operation = Vec<(Register, Sum)>;

/// A frame as operations.
pub(super) struct Program {
    /// Operations of each step, in order, indexed by step.
    pub(super) steps: Vec<Vec<Operation>>,
    /// Number of samples sent in a frame, indexed by class.
    pub(super) sent: Vec<usize>,
    /// Reference of all positions of a class, indexed by class; `None` for a class tied to ground.
    pub(super) references: Vec<Option<Register>>,
}

/// Live registers before each step and after the last step, in the order of rows and columns.
struct Layout {
    order: Vec<Vec<Register>>,
}

/// Roundings of a coefficient and of a sum, in units of the last place, in addition to one rounding per term.
const ROUNDINGS: f64 = 32.0;

impl Register {
    /// Returns the name at the end of a frame of the register with this name at the beginning of the next frame. `sent`: samples per frame, indexed by
    /// class.
    fn before(self, sent: &[usize]) -> Self {
        let renamed = |class: usize, number: i64| number + i64::try_from(sent[class]).unwrap_or(i64::MAX);
        match self {
            Self::Sample { class, number, velocity } => Self::Sample { class, number: renamed(class, number), velocity },
            Self::Returned { server, class, number } => Self::Returned { server, class, number: renamed(server, number) },
            Self::Waves { class, number, of_others } => Self::Waves { class, number: renamed(class, number), of_others },
            Self::Body { .. } | Self::Pending { .. } | Self::Force { .. } => self,
        }
    }

    /// Returns the register as a state of the beginning of a frame, with the place of its class mapped by `placed`.
    fn state(self, placed: impl Fn(usize) -> usize) -> FrameState {
        match self {
            Self::Body { class, of_copy: true, velocity } => FrameState::Copy { class: placed(class), velocity },
            Self::Body { class, of_copy: false, velocity } => FrameState::Device { class: placed(class), velocity },
            Self::Sample { class, number, velocity } => FrameState::Sample { class: placed(class), number, channel: usize::from(velocity) },
            Self::Returned { class, number, .. } => FrameState::Returned { class: placed(class), number },
            Self::Waves { class, number, of_others } => FrameState::Waves { class: placed(class), number, of_others },
            Self::Pending { class, on_copy } | Self::Force { class, on_copy } => {
                FrameState::Other { class: placed(class), row: usize::from(on_copy) }
            }
        }
    }

    /// Returns the class of a position; `None` for other registers.
    const fn position_of(self) -> Option<usize> {
        match self {
            Self::Body { class, velocity: false, .. } | Self::Sample { class, velocity: false, .. } => Some(class),
            Self::Body { .. } | Self::Sample { .. } | Self::Pending { .. } | Self::Force { .. } | Self::Returned { .. } | Self::Waves { .. } => None,
        }
    }
}

/// Frame over a box, with the names of its states.
pub(super) struct NamedFrame {
    pub(super) steps: FrameSpan,
    pub(super) states: States,
    /// Compliance by which forces are multiplied to become lengths \[m/N\].
    pub(super) compliance: f64,
}

impl NamedFrame {
    /// Encloses the programs at the corners of a box. `apart`: the class whose differences are followed, or `None` for the averages of classes. `ends`: the
    /// nodes of the part at the corners.
    pub(super) fn of(
        points: &[Point],
        ends: &[Vec<Node>],
        apart: Option<usize>,
        scale: Scale,
        program: impl Fn(&Point) -> Program,
    ) -> Result<Self, ProofError> {
        let first = program(&points[0]);
        let layout = first.layout();
        let steps = enclosed(points, ends, |point| program(point).matrices(&layout))?;
        #[cfg(test)]
        let steps = super::mutation::of_steps(steps);
        // A difference has a single class, which is class 0 of the part.
        let names = layout.states(&first).map(|register| register.state(|class| class - apart.unwrap_or(0))).collect();
        Ok(Self { steps: FrameSpan::of(steps), states: States { names, heard: None }, compliance: scale.compliance })
    }
}

impl From<NamedFrame> for (FrameSpan, Named) {
    fn from(frame: NamedFrame) -> Self {
        (frame.steps, Named::Known(frame.states, frame.compliance))
    }
}

impl Layout {
    /// Returns the states at the beginning of a frame in the order of rows and columns. References are left out, since their positions count from themselves.
    fn states(&self, program: &Program) -> impl Iterator<Item = Register> {
        self.order[0].iter().copied().filter(move |register| program.reference(*register) != Some(*register))
    }
}

impl Program {
    /// Returns all registers set by the operations.
    fn set(&self) -> impl Iterator<Item = Register> {
        self.steps.iter().flatten().flatten().map(|(register, _)| *register)
    }

    /// Returns the live registers before each step and after the last step: registers with an effect on a body from there on.
    fn live(&self) -> Vec<BTreeSet<Register>> {
        let bodies: BTreeSet<Register> = self.set().filter(|register| matches!(register, Register::Body { .. })).collect();
        // The registers alive at the end are the bodies, and the registers alive at the beginning of the next frame under their names in this frame. The set
        // only grows. The number of a sample rises with each pass until this frame takes the sample, so the set reaches a fixed point.
        let mut end = bodies.clone();
        loop {
            let mut live = vec![end.clone()];
            for step in self.steps.iter().rev() {
                // Going backwards, a set register is dead before, and the registers read by its sum are alive.
                let mut now = live[live.len() - 1].clone();
                for operation in step.iter().rev() {
                    let read: Vec<Register> = operation
                        .iter()
                        .filter(|(register, _)| now.remove(register))
                        .flat_map(|(_, sum)| sum.iter().map(|(register, _)| *register))
                        .collect();
                    now.extend(read);
                }
                live.push(now);
            }
            live.reverse();
            let mut next = bodies.clone();
            next.extend(live[0].iter().map(|register| register.before(&self.sent)));
            if next == end {
                return live;
            }
            next.extend(end);
            end = next;
        }
    }

    /// Returns the layout of the states between steps. Programs with different factors alone have the same layout.
    fn layout(&self) -> Layout {
        let mut order: Vec<Vec<Register>> = self.live().into_iter().map(|live| live.into_iter().collect()).collect();
        // The registers at the end of a frame are in the order of the beginning, so the product of the steps maps states to the same states.
        order[self.steps.len()] = order[0].iter().map(|register| register.before(&self.sent)).collect();
        Layout { order }
    }

    /// Returns the matrix of each step, in order.
    fn matrices(&self, layout: &Layout) -> Vec<StepMatrix> {
        (0..self.steps.len()).map(|step| self.matrix(step, &layout.order[step], &layout.order[step + 1])).collect()
    }

    /// Returns the reference position of a register; `None` if the register is no position, or its class is tied to ground.
    fn reference(&self, register: Register) -> Option<Register> {
        register.position_of().and_then(|class| self.references[class])
    }

    fn matrix(&self, step: usize, before: &[Register], after: &[Register]) -> StepMatrix {
        let columns: Vec<Register> = before.iter().copied().filter(|register| self.reference(*register) != Some(*register)).collect();
        let unit = |place: Option<usize>| -> Vec<f64> { (0..columns.len()).map(|column| if Some(column) == place { 1.0 } else { 0.0 }).collect() };
        // Each register as a row over the states before the step, with a row of the sums of the sizes of all terms, for the bound of roundings.
        let mut rows: BTreeMap<Register, (Vec<f64>, Vec<f64>)> = before
            .iter()
            .map(|register| {
                let row = unit(columns.iter().position(|column| column == register));
                (*register, (row.clone(), row))
            })
            .collect();
        let mut roundings = ROUNDINGS;
        for operation in &self.steps[step] {
            // All sums of an operation read the values from before the operation, so new rows are collected first.
            let mut set = Vec::new();
            for (register, sum) in operation {
                let (mut row, mut sizes) = (unit(None), unit(None));
                for (of, by) in sum {
                    // A dead register is read only by sums of dead registers, and the values of dead registers are not kept.
                    let Some((values, of_sizes)) = rows.get(of) else { continue };
                    for ((entry, size), (value, of_size)) in row.iter_mut().zip(&mut sizes).zip(values.iter().zip(of_sizes)) {
                        *entry += by * value;
                        *size += by.abs() * of_size;
                    }
                }
                set.push((*register, (row, sizes)));
            }
            roundings += ROUNDINGS + real(operation.iter().map(|(_, sum)| sum.len()).max().unwrap_or(0));
            rows.extend(set);
        }
        let kept: Vec<Register> = after.iter().copied().filter(|register| self.reference(*register) != Some(*register)).collect();
        let mut matrix = Matrix::zeros(kept.len(), columns.len());
        let mut largest = 1.0_f64;
        for (row, register) in kept.iter().enumerate() {
            let Some((values, sizes)) = rows.get(register) else { continue };
            // A position counts from its reference, so the reference's row is subtracted, and both sizes add up for the bound.
            let moved = self.reference(*register).and_then(|reference| rows.get(&reference));
            for column in 0..columns.len() {
                let (by, size) = moved.map_or((0.0, 0.0), |(values, sizes)| (values[column], sizes[column]));
                matrix[(row, column)] = values[column] - by;
                largest = largest.max(sizes[column] + size);
            }
        }
        StepMatrix { matrix, error: roundings * f64::EPSILON * largest }
    }
}
