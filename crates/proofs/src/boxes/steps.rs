//! A frame as a product of steps: each instant at which nodes tick acts on the relative state by a matrix of its own.
//!
//! The entries of a step are affine in each gain of a node, in each coefficient of a step map and in each weight, while all other numbers stay: forces are sums
//! of gains times states, and each body adds one multiple of its force. The entries of a whole frame are not affine, so that a frame stays a product here.
//! Between two steps the state consists of the bodies and of the samples that are still used.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;
use std::time::Duration;

use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{Event, External, Instants, Node, Rows, Sampling, Scale, Scratch, Timetable};

/// Node and number of a sample. Samples of this frame are numbered from 0, and −1 is the last sample of the frame before.
type SampleName = (usize, i64);

/// Tick of a node, and the samples that the node holds at the tick.
#[derive(Clone, Debug)]
struct Tick {
    node: usize,
    span: Duration,
    /// `true` if the node exchanges with its device at the tick.
    exchanges: bool,
    /// Held samples, each with its age \[s\]; the age is 0 where laws do not use ages.
    held: Vec<(SampleName, f64)>,
}

/// Samples and ticks of one instant.
#[derive(Clone, Debug, Default)]
struct Step {
    /// Samples that are taken before any body moves.
    samples: Vec<SampleName>,
    at: u64,
    ticks: Vec<Tick>,
}

/// Steps of a frame in order, and the samples that are states between the steps.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    steps: Vec<Step>,
    /// Samples that are states before each step, and after the last step: one entry more than `steps`.
    live: Vec<Vec<SampleName>>,
    /// Place of the first step of each kind, indexed by kind. All steps of a kind have the same matrix.
    firsts: Vec<usize>,
    /// Kind of each step as an index in `firsts`, indexed by step.
    kinds: Vec<usize>,
    /// Age of the oldest sample that is held at a tick \[s\]; 0 where laws do not use ages.
    oldest: f64,
}

/// Held sample: the node that sent the sample, the place of the sample, and the bits of its age.
type HeldKind = (usize, usize, u64);

/// Everything in a step that the matrix of the step depends on. Samples are named by places, which count the samples before the step and then the samples taken
/// in it.
#[derive(PartialEq, Eq, PartialOrd, Ord, Debug)]
struct StepKind {
    /// Number of samples that are states before the step.
    before: usize,
    /// Nodes that take samples, in order.
    taken: Vec<usize>,
    /// Nodes that tick, with the duration of the tick, whether the node exchanges with its device, and the held samples.
    ticks: Vec<(usize, Duration, bool, Vec<HeldKind>)>,
    /// Places of the samples that are states after the step.
    after: Vec<Option<usize>>,
}

impl Step {
    /// Returns the kind of the step, given the samples that are states before and after the step.
    fn kind(&self, before: &[SampleName], after: &[SampleName]) -> StepKind {
        let place = |name: &SampleName| before.iter().chain(&self.samples).position(|other| other == name);
        let held = |tick: &Tick| tick.held.iter().filter_map(|(name, age)| Some((name.0, place(name)?, age.to_bits()))).collect();
        StepKind {
            before: before.len(),
            taken: self.samples.iter().map(|name| name.0).collect(),
            ticks: self.ticks.iter().map(|tick| (tick.node, tick.span, tick.exchanges, held(tick))).collect(),
            after: after.iter().map(place).collect(),
        }
    }
}

/// Plans of one timetable, indexed by whether any sample is heard and by whether laws use ages. Each plan is made on first use, because both are known only
/// with the numbers of a box.
#[derive(Debug, Default)]
pub(super) struct Plans([OnceLock<Plan>; 4]);

impl Plans {
    /// Returns the plan for the timetable, which must be the same timetable in every call.
    pub(super) fn of(&self, timetable: &Timetable, heard: bool, ages: bool) -> &Plan {
        self.0[usize::from(heard) + 2 * usize::from(ages)].get_or_init(|| Plan::of(timetable, heard, ages))
    }
}

/// Numbers of a lifted system, and the units of its states.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbers<'a> {
    pub(super) nodes: &'a [Node],
    pub(super) weights: &'a Matrix,
    pub(super) sampling: Sampling,
    pub(super) scale: Scale,
    pub(super) tied: bool,
}

/// Matrix of a step, and the bound of the error of each entry.
#[derive(Clone, Debug)]
pub(super) struct StepMatrix {
    pub(super) matrix: Matrix,
    pub(super) error: f64,
}

/// Name of a state of a frame, a row and a column of the frame's matrix.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FrameState {
    /// Position or velocity of the device of a class.
    Device {
        /// The place of the class.
        class: usize,
        /// `true` if the state is the velocity.
        velocity: bool,
    },
    /// Position or velocity of the copy of a class.
    Copy {
        /// The place of the class.
        class: usize,
        /// `true` if the state is the velocity.
        velocity: bool,
    },
    /// Channel of a sample of a class.
    Sample {
        /// The place of the class.
        class: usize,
        /// Number of the sample: −1 is the last sample before the frame, −2 the sample before −1.
        number: i64,
        /// Channel of the sample: 0 is the position and 1 the velocity, or 0 is the only heard number.
        channel: usize,
    },
    /// Force for a class in a sample of a server.
    Returned {
        /// The place of the class of the receiver.
        class: usize,
        /// Number of the sample, counted as in [`FrameState::Sample`].
        number: i64,
    },
    /// Sum of the waves of a sample from all other peers to a class, or from the class to all other peers.
    Waves {
        /// The place of the class.
        class: usize,
        /// Number of the sample, counted as in [`FrameState::Sample`].
        number: i64,
        /// `true` if the other peers receive the waves, instead of the class.
        of_others: bool,
    },
    /// Force waiting for the next tick, reading or force between two exchanges with a device, or number of a law's memory.
    Other {
        /// The place of the class.
        class: usize,
        /// Row of the state among the rows of the class.
        row: usize,
    },
}

impl FrameState {
    /// Returns the state of a row of a class. The rows of the class itself begin with 0.
    pub(crate) fn of(class: usize, rows: Rows, row: usize) -> Self {
        match row {
            _ if rows.device.is_some_and(|device| row < device + 2) => Self::Device { class, velocity: row == 1 },
            _ if row < rows.object + 2 => Self::Copy { class, velocity: row == rows.object + 1 },
            _ => Self::Other { class, row },
        }
    }
}

/// Rounding error of the operations of a step, relative to the largest sum of the sizes of the terms of a row. Fifteen operations in sequence and the
/// coefficients of the step maps count, twice because of the difference from the reference. Half of the value remains for coefficients that are themselves off
/// by some roundings.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

impl Plan {
    /// Returns the plan of a timetable. `heard`: at least one sample is heard with a nonzero gain. `ages`: a law uses the ages of samples.
    fn of(timetable: &Timetable, heard: bool, ages: bool) -> Self {
        let nodes = timetable.sent.len();
        let instants = ages.then(|| Instants::of(timetable));
        let mut oldest = 0.0_f64;
        let mut held: Vec<BTreeMap<usize, i64>> = vec![BTreeMap::new(); nodes];
        if heard {
            for (to, from, sample) in &timetable.held {
                held[*to].insert(*from, *sample);
            }
        }
        let mut steps: Vec<Step> = vec![Step::default()];
        let mut sent = vec![0_i64; nodes];
        for event in &timetable.events {
            match *event {
                Event::Sample { node } => {
                    // Samples come before the ticks of a step, so a sample after a tick begins a new step.
                    if steps.last().is_none_or(|step| !step.ticks.is_empty()) {
                        steps.push(Step::default());
                    }
                    if heard && let Some(step) = steps.last_mut() {
                        step.samples.push((node, sent[node]));
                    }
                    sent[node] += 1;
                }
                Event::Deliver { from, to, sample } => {
                    if heard {
                        held[to].insert(from, sample);
                    }
                }
                Event::Tick { node, at, span, exchanges } => {
                    // Ticks of one instant share a step. A node ticks at most once in a step, since two ticks of a node would multiply its gains.
                    if steps.last().is_none_or(|step| step.ticks.iter().any(|tick| tick.node == node) || !step.ticks.is_empty() && step.at != at) {
                        steps.push(Step::default());
                    }
                    let age = |(from, sample)| instants.as_ref().map_or(0.0, |instants| instants.age((node, from), sample, at, timetable.frame));
                    let held: Vec<_> = held[node].iter().map(|(from, sample)| ((*from, *sample), age((*from, *sample)))).collect();
                    oldest = held.iter().fold(oldest, |oldest, (_, age)| oldest.max(*age));
                    if let Some(step) = steps.last_mut() {
                        step.at = at;
                        step.ticks.push(Tick { node, span, exchanges, held });
                    }
                }
            }
        }
        let live = live(&steps, &timetable.sent);
        let (mut known, mut firsts) = (BTreeMap::new(), Vec::new());
        // Steps with the same live samples and the same ticks have the same matrix, which is then computed once.
        let kinds = steps.iter().zip(live.windows(2)).enumerate().map(|(place, (step, live))| {
            *known.entry(step.kind(&live[0], &live[1])).or_insert_with(|| {
                firsts.push(place);
                firsts.len() - 1
            })
        });
        Self { kinds: kinds.collect(), steps, live, firsts, oldest }
    }

    /// Returns the states of the frame in the order of its rows and columns. The position of the first copy is a state only in a scene tied to ground.
    /// Otherwise all positions are counted from the first copy.
    pub(super) fn states(&self, nodes: &[Node], channels: usize, tied: bool) -> Vec<FrameState> {
        let mut names = Vec::new();
        for (place, node) in nodes.iter().enumerate() {
            let rows = node.rows(0);
            let reference = (place == 0 && !tied).then_some(rows.object);
            names.extend((0..node.states()).filter(|row| Some(*row) != reference).map(|row| FrameState::of(place, rows, row)));
        }
        let samples = self.live[0].iter();
        names.extend(samples.flat_map(|(class, number)| (0..channels).map(|channel| FrameState::Sample { class: *class, number: *number, channel })));
        names
    }

    /// Returns the matrix of each kind of step, indexed by kind.
    pub(super) fn matrices(&self, numbers: Numbers<'_>) -> Vec<StepMatrix> {
        self.firsts.iter().map(|step| self.matrix(*step, numbers)).collect()
    }

    /// Returns the index in `firsts` of the kind of each step, indexed by step. Steps of one kind have the same matrix.
    pub(super) fn kinds(&self) -> &[usize] {
        &self.kinds
    }

    /// Returns the matrix of a step, from the states before to the states after the step.
    fn matrix(&self, step: usize, numbers: Numbers<'_>) -> StepMatrix {
        let Numbers { nodes, weights, sampling, scale, tied } = numbers;
        let channels = sampling.channels();
        let (before, after) = (&self.live[step], &self.live[step + 1]);
        let mut rows: Vec<Rows> = Vec::with_capacity(nodes.len());
        let mut count = 0;
        for node in nodes {
            rows.push(node.rows(count));
            count += node.states();
        }
        // `z` has a row for every state of the nodes, and a column for every state before the step. The reference has no column and a row. The row stays zero
        // until the reference moves.
        let reference = (!tied).then(|| rows[0].object);
        let states = count - usize::from(reference.is_some());
        let columns = states + before.len() * channels;
        let mut z = Matrix::zeros(count, columns);
        for (column, row) in (0..count).filter(|row| Some(*row) != reference).enumerate() {
            z[(row, column)] = 1.0;
        }
        let mut store: BTreeMap<SampleName, Vec<Vec<f64>>> = BTreeMap::new();
        let unit = |place: usize| (0..columns).map(|column| if column == place { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        for (place, name) in before.iter().enumerate() {
            store.insert(*name, (0..channels).map(|channel| unit(states + place * channels + channel)).collect());
        }
        let Step { samples, ticks, .. } = &self.steps[step];
        for name in samples {
            let (x, v) = (z.row(rows[name.0].object), z.row(rows[name.0].object + 1));
            let channel = |channel| {
                let (position, velocity) = sampling.shares(channel, scale.time);
                x.iter().zip(v).map(|(x, v)| position * x + velocity * v).collect()
            };
            store.insert(*name, (0..channels).map(channel).collect());
        }
        let law_rows = 1 + nodes.iter().map(|node| node.law.memory.len()).max().unwrap_or(0);
        let mut scratch = Scratch::default();
        scratch.resize(columns);
        for Tick { node, span, exchanges, held } in ticks {
            let mut heard = Matrix::zeros(law_rows, columns);
            for (name, age) in held {
                let Some(sample) = store.get(name) else { continue };
                for (channel, entries) in sample.iter().enumerate() {
                    for (row, by) in nodes[*node].heard(sampling, channel, *age, scale.time).enumerate() {
                        let weight = weights[(*node, name.0)] * by;
                        heard.row_mut(row).iter_mut().zip(entries).for_each(|(sum, entry)| *sum += weight * entry);
                    }
                }
            }
            nodes[*node].tick(&mut z, rows[*node], |row| heard.row(row), External::default(), (*span, *exchanges), scale, &mut scratch);
        }
        // The reference has moved during the step: positions after the step are counted from its new place.
        let moved = |by: f64, column: usize| reference.map_or(0.0, |reference| by * z[(reference, column)]);
        let mut matrix = Matrix::zeros(states + after.len() * channels, columns);
        let mut next = 0;
        for (node, rows) in nodes.iter().zip(&rows) {
            let first = rows.device.unwrap_or(rows.object);
            for row in (first..first + node.states()).filter(|row| Some(*row) != reference) {
                let by = node.displacement(*rows, row, scale.time);
                (0..columns).for_each(|column| matrix[(next, column)] = z[(row, column)] - moved(by, column));
                next += 1;
            }
        }
        for name in after {
            for (channel, entries) in store[name].iter().enumerate() {
                let by = sampling.translation(channel, scale.time);
                (0..columns).for_each(|column| matrix[(next, column)] = entries[column] - moved(by, column));
                next += 1;
            }
        }
        StepMatrix { matrix, error: error(nodes, scale, self.oldest) }
    }
}

/// Returns the bound of the error of each entry of a step of the nodes. `oldest` is the age of the oldest held sample \[s\], for laws that use ages.
pub(super) fn error(nodes: &[Node], scale: Scale, oldest: f64) -> f64 {
    ROUNDING * nodes.iter().map(|node| node.step_norm_up_to(scale, oldest)).fold(1.0, f64::max)
}

/// Returns the samples among the states before each step, and after the last step: samples sent before the step and used from the step on, in this frame or
/// a later frame.
fn live(steps: &[Step], sent: &[usize]) -> Vec<Vec<SampleName>> {
    let mut last: BTreeMap<SampleName, usize> = BTreeMap::new();
    for (place, step) in steps.iter().enumerate() {
        for (name, _) in step.ticks.iter().flat_map(|tick| &tick.held) {
            last.insert(*name, place);
        }
    }
    let whole = |number: usize| i64::try_from(number).unwrap_or(i64::MAX);
    let oldest = last.keys().map(|(_, sample)| *sample).min().unwrap_or(0).min(0);
    // A sample that this frame uses under the number s is the sample s − k·period of the frame k frames later.
    let later = |(node, sample): SampleName| {
        let period = whole(sent[node]).max(1);
        (1..).map(|frames| sample - frames * period).take_while(|sample| *sample >= oldest).any(|sample| last.contains_key(&(node, sample)))
    };
    let mut there: BTreeSet<SampleName> =
        (0..sent.len()).flat_map(|node| (oldest - whole(sent[node])..0).map(move |sample| (node, sample))).collect();
    let mut live = Vec::with_capacity(steps.len() + 1);
    for place in 0..=steps.len() {
        let used = |name: &SampleName| last.get(name).is_some_and(|last| *last >= place) || later(*name);
        live.push(there.iter().copied().filter(used).collect());
        if let Some(step) = steps.get(place) {
            there.extend(step.samples.iter().copied());
        }
    }
    live
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper_scene::PAPER;
    use cohaptic_stability::frames::NominalNetwork;
    use cohaptic_stability::frames::{Contacts, Structure};

    /// Each step of a frame has the matrix of its kind, to the bit, and there are fewer kinds than steps.
    #[test]
    fn steps_of_a_kind_have_one_matrix() {
        let two_kinds = "peers=[{ name = \"peer1\", device = { mass = 0.2 } }]";
        for (set, of_all) in [
            (&["link.delay=24ms"][..], true),
            (&["link.delay=13.7ms", two_kinds], true),
            (&["link.loss={ packets = [2], every = 5 }", two_kinds], true),
            (&["coordination.strategy=\"extrapolated\"", "link.delay=3ms"], false),
            (&["peer.device.exchange-every=3", "peer.device.exchange-age=1"], true),
            (&["peers=[{ name = \"peer2\", clock = { offset = \"0.4ms\" } }, { name = \"peer3\", tick = \"2ms\" }]"], true),
        ] {
            let overrides: Vec<String> = set.iter().map(|text| (*text).to_owned()).collect();
            let scene = cohaptic_scene::Scene::parse(PAPER, "paper.toml".as_ref(), &overrides).unwrap();
            let network = NominalNetwork::of(&scene).unwrap();
            let peers = scene.peers.len();
            let contacts = Contacts { touching: vec![true; peers], at_wall: false, absent: vec![false; peers] };
            let structure = Structure::of(&[&scene], &network, &contacts).unwrap();
            let nodes = structure.nodes(&scene);
            let time = structure.time(&scene, &nodes);
            let numbers = Numbers {
                nodes: &nodes,
                weights: &structure.weights,
                sampling: Sampling::of(&nodes),
                scale: Scale { time, compliance: nodes[0].compliance(time) },
                tied: structure.tied,
            };
            let ages = nodes.iter().any(|node| node.law.horizon.is_some());
            let plan = Plan::of(&structure.timetable, true, ages);
            let matrices = plan.matrices(numbers);
            assert!(matrices.len() < plan.steps.len() || !of_all, "{set:?}: {} of {}", matrices.len(), plan.steps.len());
            for (step, kind) in plan.kinds().iter().enumerate() {
                assert_eq!(plan.matrix(step, numbers).matrix, matrices[*kind].matrix, "{set:?}: {step}");
            }
        }
    }
}
