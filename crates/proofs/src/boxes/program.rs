//! A frame as a straight-line program: operations that set registers to sums of multiples of registers, step by step.
//!
//! For laws whose samples carry more than a state. The multiples within a step are affine in each number of a [`super::corners::Point`], as those of
//! [`super::steps`] are. Registers that no body feels, now or in any later frame, are left out.

use std::collections::{BTreeMap, BTreeSet};

use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{Node, Scale};
use cohaptic_stability::numerics::real;

use super::certificate::Named;
use super::corners::{Point, States, enclosed};
use super::error::ProofError;
use super::span::FrameSpan;
use super::steps::{FrameState, StepMatrix};

/// A number that operations set and read.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum Register {
    /// Position or velocity of the device of a class, or of its copy.
    Body { class: usize, of_copy: bool, velocity: bool },
    /// A force that acts a tick later.
    Pending { class: usize, on_copy: bool },
    /// A force of this tick, which no state is.
    Force { class: usize, on_copy: bool },
    /// A sampled position or velocity; the samples of a class in this frame are numbered from 0, the last one before is −1.
    Sample { class: usize, number: i64, velocity: bool },
    /// The force that a sample of a server has for a class.
    Returned { server: usize, class: usize, number: i64 },
    /// The waves of a sampling that a class gets from all others, or others from it.
    Waves { class: usize, number: i64, of_others: bool },
}

/// Multiples of registers, which are added up.
pub(super) type Sum = Vec<(Register, f64)>;

/// Registers that are set at once.
pub(super) type Operation = Vec<(Register, Sum)>;

/// A frame.
pub(super) struct Program {
    /// Operations of each step, in order.
    pub(super) steps: Vec<Vec<Operation>>,
    /// How many samples each class sends in a frame.
    pub(super) sent: Vec<usize>,
    /// For each class, the position that all of its positions are counted from, where nothing ties them to ground.
    pub(super) references: Vec<Option<Register>>,
}

/// The states of a program between its steps.
struct Layout {
    order: Vec<Vec<Register>>,
}

/// What a coefficient and a sum round, in units of the last place, beside one for each term.
const ROUNDINGS: f64 = 32.0;

impl Register {
    /// As it is called at the end of a frame that it is there after.
    fn before(self, sent: &[usize]) -> Self {
        let renamed = |class: usize, number: i64| number + i64::try_from(sent[class]).unwrap_or(i64::MAX);
        match self {
            Self::Sample { class, number, velocity } => Self::Sample { class, number: renamed(class, number), velocity },
            Self::Returned { server, class, number } => Self::Returned { server, class, number: renamed(server, number) },
            Self::Waves { class, number, of_others } => Self::Waves { class, number: renamed(class, number), of_others },
            Self::Body { .. } | Self::Pending { .. } | Self::Force { .. } => self,
        }
    }

    /// The state that it is at the beginning of a frame, with another place for its class.
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

    /// The class of which it is a position.
    const fn position_of(self) -> Option<usize> {
        match self {
            Self::Body { class, velocity: false, .. } | Self::Sample { class, velocity: false, .. } => Some(class),
            Self::Body { .. } | Self::Sample { .. } | Self::Pending { .. } | Self::Force { .. } | Self::Returned { .. } | Self::Waves { .. } => None,
        }
    }
}

/// A frame over a box, and the names of its states.
pub(super) struct NamedFrame {
    pub(super) steps: FrameSpan,
    pub(super) states: States,
    /// What forces are multiplied by to be lengths \[m/N\].
    pub(super) compliance: f64,
}

impl NamedFrame {
    /// Of the programs at the corners of a box, of the averages of classes or of how the members of one differ. `ends`: the nodes of that part at the corners.
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
        // The classes of a part are counted by themselves.
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
    /// The states at the beginning of a frame, in the order of its rows and columns.
    fn states(&self, program: &Program) -> impl Iterator<Item = Register> {
        self.order[0].iter().copied().filter(move |register| program.reference(*register) != Some(*register))
    }
}

impl Program {
    /// All registers that are set.
    fn set(&self) -> impl Iterator<Item = Register> {
        self.steps.iter().flatten().flatten().map(|(register, _)| *register)
    }

    /// The registers that are alive before each step and after the last: those that bodies feel from there on.
    fn live(&self) -> Vec<BTreeSet<Register>> {
        let bodies: BTreeSet<Register> = self.set().filter(|register| matches!(register, Register::Body { .. })).collect();
        let mut end = bodies.clone();
        loop {
            let mut live = vec![end.clone()];
            for step in self.steps.iter().rev() {
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

    /// Which states the frame has between its steps: those of all programs that differ in multiples alone.
    fn layout(&self) -> Layout {
        let mut order: Vec<Vec<Register>> = self.live().into_iter().map(|live| live.into_iter().collect()).collect();
        // Those that live on from a frame to the next are in one order at both ends.
        order[self.steps.len()] = order[0].iter().map(|register| register.before(&self.sent)).collect();
        Layout { order }
    }

    /// The matrices of all steps.
    fn matrices(&self, layout: &Layout) -> Vec<StepMatrix> {
        (0..self.steps.len()).map(|step| self.matrix(step, &layout.order[step], &layout.order[step + 1])).collect()
    }

    /// The position that a register is counted from.
    fn reference(&self, register: Register) -> Option<Register> {
        register.position_of().and_then(|class| self.references[class])
    }

    fn matrix(&self, step: usize, before: &[Register], after: &[Register]) -> StepMatrix {
        let columns: Vec<Register> = before.iter().copied().filter(|register| self.reference(*register) != Some(*register)).collect();
        let unit = |place: Option<usize>| -> Vec<f64> { (0..columns.len()).map(|column| if Some(column) == place { 1.0 } else { 0.0 }).collect() };
        // Each with the sum of the sizes of all terms, for a bound of roundings.
        let mut rows: BTreeMap<Register, (Vec<f64>, Vec<f64>)> = before
            .iter()
            .map(|register| {
                let row = unit(columns.iter().position(|column| column == register));
                (*register, (row.clone(), row))
            })
            .collect();
        let mut roundings = ROUNDINGS;
        for operation in &self.steps[step] {
            let mut set = Vec::new();
            for (register, sum) in operation {
                let (mut row, mut sizes) = (unit(None), unit(None));
                for (of, by) in sum {
                    // A register that is not alive is read for others that are not: nothing feels them.
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
