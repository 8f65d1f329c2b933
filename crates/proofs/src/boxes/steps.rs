//! A frame in steps: what each instant at which nodes tick does to the relative state, as a matrix of its own.
//!
//! The entries of one step are affine in each gain of a node, in each coefficient of a step map, and in the weights, as long as the others stay: forces are
//! sums of gains times states, and each body adds one multiple of its force. Over a whole frame that is lost; so a frame stays a product here. Between two
//! steps the state has the bodies and those samples alone that are still used.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;
use std::time::Duration;

use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{Event, External, Instants, Node, Rows, Sampling, Scale, Scratch, Timetable};

/// A sample of a node: from 0 on those of this frame, −1 the last one of the frame before.
type SampleName = (usize, i64);

/// A tick of a node, and the samples that it holds then.
#[derive(Clone, Debug)]
struct Tick {
    node: usize,
    span: Duration,
    /// And how old each is \[s\], where ages matter; otherwise 0.
    held: Vec<(SampleName, f64)>,
}

/// What happens at one instant.
#[derive(Clone, Debug, Default)]
struct Step {
    /// Samples that are taken before anything moves.
    samples: Vec<SampleName>,
    at: u64,
    ticks: Vec<Tick>,
}

/// When what happens in a frame, and which samples are states between its steps.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    steps: Vec<Step>,
    /// Before each step, and after the last one.
    live: Vec<Vec<SampleName>>,
    /// The first step of each kind: all others of it have the same matrix.
    firsts: Vec<usize>,
    /// The kind of each step.
    kinds: Vec<usize>,
    /// The age of the oldest sample that is held at a tick \[s\], where ages matter; otherwise 0.
    oldest: f64,
}

/// A sample that is held: its node, its place, and the bits of its age.
type HeldKind = (usize, usize, u64);

/// All of a step that its matrix depends on. Samples are called by their places: among those before the step, and then those that are taken in it.
#[derive(PartialEq, Eq, PartialOrd, Ord, Debug)]
struct StepKind {
    before: usize,
    /// The nodes that take samples.
    taken: Vec<usize>,
    /// The nodes that tick, for how long, and what they hold.
    ticks: Vec<(usize, Duration, Vec<HeldKind>)>,
    after: Vec<Option<usize>>,
}

impl Step {
    /// Its kind, between the samples before it and after it.
    fn kind(&self, before: &[SampleName], after: &[SampleName]) -> StepKind {
        let place = |name: &SampleName| before.iter().chain(&self.samples).position(|other| other == name);
        let held = |tick: &Tick| tick.held.iter().filter_map(|(name, age)| Some((name.0, place(name)?, age.to_bits()))).collect();
        StepKind {
            before: before.len(),
            taken: self.samples.iter().map(|name| name.0).collect(),
            ticks: self.ticks.iter().map(|tick| (tick.node, tick.span, held(tick))).collect(),
            after: after.iter().map(place).collect(),
        }
    }
}

/// The plans of a timetable, each made when it is first asked for: whether anything is heard, and whether ages matter, is known with the numbers alone.
#[derive(Debug, Default)]
pub(super) struct Plans([OnceLock<Plan>; 4]);

impl Plans {
    /// That of the timetable, which is always the same.
    pub(super) fn of(&self, timetable: &Timetable, heard: bool, ages: bool) -> &Plan {
        self.0[usize::from(heard) + 2 * usize::from(ages)].get_or_init(|| Plan::of(timetable, heard, ages))
    }
}

/// The numbers of a lifted system, and the units of its states.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbers<'a> {
    pub(super) nodes: &'a [Node],
    pub(super) weights: &'a Matrix,
    pub(super) sampling: Sampling,
    pub(super) scale: Scale,
    pub(super) tied: bool,
}

/// A step matrix, and how far each of its entries may be from the exact one.
#[derive(Clone, Debug)]
pub(super) struct StepMatrix {
    pub(super) matrix: Matrix,
    pub(super) error: f64,
}

/// A state of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FrameState {
    /// Of the device of a class: its position, or its velocity.
    Device {
        /// The place of the class.
        class: usize,
        /// Whether it is the velocity.
        velocity: bool,
    },
    /// Of the copy of a class: its position, or its velocity.
    Copy {
        /// The place of the class.
        class: usize,
        /// Whether it is the velocity.
        velocity: bool,
    },
    /// A number of a sample of a class.
    Sample {
        /// The place of the class.
        class: usize,
        /// The last one before the frame is −1, the one before it −2.
        number: i64,
        /// Which of its numbers: position and velocity, or the one that is heard.
        channel: usize,
    },
    /// The force that a sample of a server has for a class.
    Returned {
        /// The place of the class that gets it.
        class: usize,
        /// Which sample, as above.
        number: i64,
    },
    /// The sum of the waves of a sample that a class gets from all others, or others from it.
    Waves {
        /// The place of the class.
        class: usize,
        /// Which sample, as above.
        number: i64,
        /// Whether others get them.
        of_others: bool,
    },
    /// A force that waits, or a number that a law remembers.
    Other {
        /// The place of the class.
        class: usize,
        /// Which of the numbers of the class.
        row: usize,
    },
}

impl FrameState {
    /// The state of a row of a class whose own rows begin with 0.
    pub(crate) fn of(class: usize, rows: Rows, row: usize) -> Self {
        match row {
            _ if rows.device.is_some_and(|device| row < device + 2) => Self::Device { class, velocity: row == 1 },
            _ if row < rows.object + 2 => Self::Copy { class, velocity: row == rows.object + 1 },
            _ => Self::Other { class, row },
        }
    }
}

/// What the operations of a step round, relative to the largest sum of the sizes of the terms of a row: fifteen operations in a row and the coefficients of the
/// step maps, twice for the difference from the reference. Half of it is left for coefficients that differ by some roundings from those of the numbers meant.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

impl Plan {
    /// The steps of a timetable. `heard` says whether anything is heard at all, `ages` whether the ages of samples matter.
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
                Event::Tick { node, at, span } => {
                    if steps.last().is_none_or(|step| step.ticks.iter().any(|tick| tick.node == node) || !step.ticks.is_empty() && step.at != at) {
                        steps.push(Step::default());
                    }
                    let age = |(from, sample)| instants.as_ref().map_or(0.0, |instants| instants.age((node, from), sample, at, timetable.frame));
                    let held: Vec<_> = held[node].iter().map(|(from, sample)| ((*from, *sample), age((*from, *sample)))).collect();
                    oldest = held.iter().fold(oldest, |oldest, (_, age)| oldest.max(*age));
                    if let Some(step) = steps.last_mut() {
                        step.at = at;
                        step.ticks.push(Tick { node, span, held });
                    }
                }
            }
        }
        let live = live(&steps, &timetable.sent);
        let (mut known, mut firsts) = (BTreeMap::new(), Vec::new());
        let kinds = steps.iter().zip(live.windows(2)).enumerate().map(|(place, (step, live))| {
            *known.entry(step.kind(&live[0], &live[1])).or_insert_with(|| {
                firsts.push(place);
                firsts.len() - 1
            })
        });
        Self { kinds: kinds.collect(), steps, live, firsts, oldest }
    }

    /// The states of the frame, in the order of its rows and columns.
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

    /// The matrices of each kind of step.
    pub(super) fn matrices(&self, numbers: Numbers<'_>) -> Vec<StepMatrix> {
        self.firsts.iter().map(|step| self.matrix(*step, numbers)).collect()
    }

    /// The kinds of the steps of a frame, in order.
    pub(super) fn kinds(&self) -> &[usize] {
        &self.kinds
    }

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
        for Tick { node, span, held } in ticks {
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
            nodes[*node].tick(&mut z, rows[*node], |row| heard.row(row), External::default(), *span, scale, &mut scratch);
        }
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

/// How far each entry of a step of nodes may be from the exact one; `oldest` is the age of the oldest sample \[s\], for laws that use it.
pub(super) fn error(nodes: &[Node], scale: Scale, oldest: f64) -> f64 {
    ROUNDING * nodes.iter().map(|node| node.step_norm_up_to(scale, oldest)).fold(1.0, f64::max)
}

/// Which samples are states before each step, and after the last: those sent before that are used from there on, in this frame or in a later one.
fn live(steps: &[Step], sent: &[usize]) -> Vec<Vec<SampleName>> {
    let mut last: BTreeMap<SampleName, usize> = BTreeMap::new();
    for (place, step) in steps.iter().enumerate() {
        for (name, _) in step.ticks.iter().flat_map(|tick| &tick.held) {
            last.insert(*name, place);
        }
    }
    let whole = |number: usize| i64::try_from(number).unwrap_or(i64::MAX);
    let oldest = last.keys().map(|(_, sample)| *sample).min().unwrap_or(0).min(0);
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
