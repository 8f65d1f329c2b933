//! One frame of the lifted system: the states at its end and the samples sent, as linear functions of the states at its beginning.

use super::node::{External, Node, Rows, Scale, Scratch};
use super::rounding::Rounding;
use super::system::Lifted;
use crate::timetable::{Event, Instants};
use crate::{Matrix, Unwatched, Watch};

/// Inputs and outputs within a frame. Every method has a default without input or output.
pub trait Instrument {
    /// Returns the number of inputs. Each input is one more column of the unknowns.
    fn inputs(&self) -> usize {
        0
    }

    /// Sets the hand's force on the device of a node at a tick, `at` ns into the frame, as a function of the inputs \[N\]. Returns whether a force acts.
    fn push(&mut self, _node: usize, _at: u64, _inputs: &mut [f64]) -> bool {
        false
    }

    /// Sees the velocity of the device of a node at a tick, multiplied by the common time, before the device moves.
    fn see(&mut self, _node: usize, _at: u64, _velocity: &[f64]) {}

    /// Sees all rows at a tick of a node with the rows `rows`, before the node moves. Sets the replacements of the coupling's force (first) and of the wall's
    /// force on the copy, as functions of the inputs \[N\]. Returns `true` for each replaced force.
    fn touch(&mut self, _node: usize, _z: &Matrix, _rows: Rows, _inputs: [&mut [f64]; 2]) -> [bool; 2] {
        [false; 2]
    }
}

/// The instrument without inputs and outputs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Autonomous;

impl Instrument for Autonomous {}

/// Linear map of one frame, from the unknowns to the states at the end and the sent samples.
///
/// The unknowns, one column each, are the states at the beginning without the reference, then the used samples of earlier frames, then the inputs. A sample
/// has one number or two, by [`Sampling`](super::Sampling), each with a separate place: with c numbers per sample, number i of sample s has the place c·s + i.
///
/// The places that operators see are further *series*, numbered after the nodes, in the order of the operators' nodes: a number for each tick of the node, as if
/// the node sent the place to its own hand.
#[derive(Clone, PartialEq, Debug)]
pub struct FrameMap {
    /// States at the end, one row each, the reference among them. Positions are absolute here, not relative to the reference.
    pub states: Matrix,
    /// Distance by which a translation of everything by 1 moves each row of `states`: 1 for positions, 0 for velocities.
    displacements: Vec<f64>,
    /// Row of the reference of all positions; `None` if the motion is tied to ground.
    reference: Option<usize>,
    /// Samples sent in the frame, one row for each number, ordered by node, then by time; then the places seen in the frame.
    pub sent: Matrix,
    /// First row of `sent` of each node, then of each series of seen places.
    first_sent: Vec<usize>,
    /// Used numbers of samples and seen places of earlier frames: the sending node or the series, and the distance to the first number of this frame, at least 1.
    pub used: Vec<(usize, usize)>,
    /// Number of numbers of earlier frames among the states, indexed by node, then by series of seen places.
    depth: Vec<usize>,
    /// Distance by which a translation of everything by 1 moves each number of a sample.
    translations: Vec<f64>,
    /// Bound of the rounding errors of all rows, as the largest sum of absolute values of a row.
    pub error: f64,
}

/// Number of computed entries between two questions to the watch; some ten milliseconds of work.
const LOOK: usize = 1_000_000;

impl Lifted<'_> {
    /// Computes the map of a frame, by all steps of the frame with all unknowns at once.
    #[expect(clippy::missing_panics_doc, reason = "nothing ends what nobody watches")]
    pub fn frame(&self, instrument: &mut impl Instrument) -> FrameMap {
        self.frame_watched(instrument, &Unwatched).expect("without a watch nothing ends it")
    }

    /// Computes [`Lifted::frame`]; `None` if the watch stops the computation.
    pub(crate) fn frame_watched(&self, instrument: &mut impl Instrument, watch: &dyn Watch) -> Option<FrameMap> {
        let (channels, silent) = (self.sampling.channels(), self.sampling.is_silent(self.time));
        let rows = self.rows();
        let count = self.nodes.iter().map(Node::states).sum::<usize>();
        let reference = (!self.tied).then(|| rows[0].object);
        let mut used = if silent { Vec::new() } else { self.used() };
        let mut sights = self.sights();
        let mut first_looked = Vec::with_capacity(sights.len());
        for (series, sight) in sights.iter().enumerate() {
            first_looked.push(used.len());
            used.extend(sight.ages().map(|age| (self.nodes.len() + series, age)));
        }
        let states = count - usize::from(reference.is_some());
        let inputs = states + used.len();
        let columns = inputs + instrument.inputs();
        let scale = Scale { time: self.time, compliance: self.nodes[0].compliance(self.time) };

        // Each state is an unknown, so the states begin as unit vectors. The reference position is zero by definition and has no unknown.
        let mut z = Matrix::zeros(count, columns);
        for row in 0..count {
            match reference {
                Some(reference) if row == reference => {}
                Some(reference) if row > reference => z[(row, row - 1)] = 1.0,
                _ => z[(row, row)] = 1.0,
            }
        }
        // Rows of `store`: the used samples and seen places of earlier frames, then those of this frame.
        let mut first_sent = Vec::with_capacity(self.nodes.len());
        let mut samples = used.len();
        for sent in &self.timetable.sent {
            first_sent.push(samples);
            samples += sent * channels;
        }
        for (sight, first_looked) in sights.iter_mut().zip(first_looked) {
            first_sent.push(samples);
            samples = sight.place(first_looked, samples);
        }
        let mut store = Matrix::zeros(samples, columns);
        for place in 0..used.len() {
            store[(place, states + place)] = 1.0;
        }
        let mut next_sent = first_sent.clone();
        let nodes = self.nodes.len();
        // The row of the first number of a sample in `store`; the row of the second number follows. Samples of earlier frames have negative numbers.
        let row_of = |node: usize, sample: i64| -> Option<usize> {
            match usize::try_from(sample) {
                Ok(number) => Some(first_sent[node] + number * channels),
                Err(_) => used.iter().position(|(from, age)| *from == node && usize::try_from(-sample).map(|sample| sample * channels) == Ok(*age)),
            }
        };
        let mut held: Vec<Option<(usize, i64)>> = vec![None; nodes * nodes];
        for (to, from, sample) in &self.timetable.held {
            held[to * nodes + from] = row_of(*from, *sample).map(|row| (row, *sample));
        }
        // Heard force of each row of each node's law [N].
        let law_rows = 1 + self.nodes.iter().map(|node| node.law.memory.len()).max().unwrap_or(0);
        let mut heard = Matrix::zeros(nodes * law_rows, columns);
        let instants = self.ages_matter().then(|| Instants::of(self.timetable));
        let mut stale = vec![true; nodes];
        let mut scratch = Scratch::default();
        scratch.resize(columns);
        let mut push = vec![0.0; columns];
        let [mut coupling, mut wall] = [vec![0.0; columns], vec![0.0; columns]];
        let mut pulled = vec![0.0; if sights.is_empty() { 0 } else { columns }];
        let step = self.nodes.iter().map(|node| node.step_norm(scale)).fold(1.0, f64::max);
        let mut rounding = Rounding::new(step);
        let mut since = 0;
        for event in &self.timetable.events {
            // An event takes some operations per column.
            since += columns;
            if since > LOOK {
                since = 0;
                if watch.stops() {
                    return None;
                }
            }
            match *event {
                // A sample holds the state before the tick of the same instant, since samplings precede ticks.
                Event::Sample { node } => {
                    if !silent {
                        let (x, v) = (z.row(rows[node].object), z.row(rows[node].object + 1));
                        for channel in 0..channels {
                            let (position, velocity) = self.sampling.shares(channel, self.time);
                            let sample = store.row_mut(next_sent[node] + channel);
                            for column in 0..columns {
                                sample[column] = position * x[column] + velocity * v[column];
                            }
                        }
                    }
                    next_sent[node] += channels;
                }
                Event::Deliver { from, to, sample } => {
                    held[to * nodes + from] = row_of(from, sample).map(|row| (row, sample));
                    stale[to] = true;
                }
                Event::Tick { node, at, span, exchanges } => {
                    // The sums change only after a delivery, unless the laws use the ages of samples: ages change from tick to tick.
                    if std::mem::take(&mut stale[node]) || instants.is_some() {
                        (0..law_rows).for_each(|row| heard.row_mut(node * law_rows + row).fill(0.0));
                        for from in 0..nodes {
                            // Without a held sample a pair has weight zero: the mean of a node without senders is not heard.
                            let Some((first, sample)) = held[node * nodes + from] else { continue };
                            let age = instants.as_ref().map_or(0.0, |instants| instants.age((node, from), sample, at, self.timetable.frame));
                            for channel in 0..channels {
                                for (row, by) in self.nodes[node].heard(self.sampling, channel, age, self.time).enumerate() {
                                    let weight = self.weights[(node, from)] * by;
                                    for (sum, entry) in heard.row_mut(node * law_rows + row).iter_mut().zip(store.row(first + channel)) {
                                        *sum += weight * entry;
                                    }
                                }
                            }
                        }
                    }
                    let pushed = match rows[node].device {
                        Some(device) => {
                            instrument.see(node, at, z.row(device + 1));
                            instrument.push(node, at, &mut push[inputs..])
                        }
                        None => false,
                    };
                    let mut hand = pushed.then_some(push.as_slice());
                    if let Some(sight) = sights.iter_mut().find(|sight| sight.node == node) {
                        let held = |from: usize| held[node * nodes + from].map(|(first, _)| first);
                        sight.tick(&mut z, rows[node], &mut store, held, &mut pulled);
                        // An instrument may push the hand of an operator too.
                        if pushed {
                            pulled.iter_mut().zip(&push).for_each(|(pulled, push)| *pulled += push);
                        }
                        hand = Some(&pulled);
                    }
                    let [touches, stands] = instrument.touch(node, &z, rows[node], [&mut coupling[inputs..], &mut wall[inputs..]]);
                    let external = External { hand, coupling: touches.then_some(coupling.as_slice()), wall: stands.then_some(wall.as_slice()) };
                    let heard = |row: usize| heard.row(node * law_rows + row);
                    self.nodes[node].tick(&mut z, rows[node], heard, external, (span, exchanges), scale, &mut scratch);
                    rounding.tick(norm(&z, rows[node], self.nodes[node].states()));
                }
            }
        }
        let mut displacements = Vec::with_capacity(count);
        for (node, rows) in self.nodes.iter().zip(&rows) {
            let first = rows.device.unwrap_or(rows.object);
            displacements.extend((first..first + node.states()).map(|row| node.displacement(*rows, row, self.time)));
        }
        Some(FrameMap {
            states: z,
            displacements,
            reference,
            sent: tail(&store, used.len()),
            first_sent: first_sent.iter().map(|first| first - used.len()).collect(),
            used,
            depth: {
                let sampled = self.timetable.depth.iter().map(|depth| if silent { 0 } else { depth * channels });
                sampled.chain(sights.iter().map(|sight| sight.operator.lag)).collect()
            },
            translations: (0..channels).map(|channel| self.sampling.translation(channel, self.time)).collect(),
            error: if instrument.inputs() == 0 {
                rounding.bound(|| self.error())
            } else {
                // The closer bound does not cover the columns of inputs.
                rounding.bound(|| f64::INFINITY)
            },
        })
    }

    /// Tells whether the law of a node uses the ages of samples. The force of the same sample then changes from tick to tick.
    fn ages_matter(&self) -> bool {
        self.nodes.iter().any(|node| node.law.horizon.is_some())
    }

    /// Returns the numbers of samples of earlier frames used in this frame, ordered by node and then by age: see [`FrameMap::used`].
    fn used(&self) -> Vec<(usize, usize)> {
        let deliveries = self.timetable.events.iter().filter_map(|event| match event {
            Event::Deliver { from, to, sample } => Some((*to, *from, *sample)),
            Event::Sample { .. } | Event::Tick { .. } => None,
        });
        let all = self.timetable.held.iter().copied().chain(deliveries);
        // Only samples with a weight other than zero are unknowns; the mean of a node without senders holds no sample.
        let mut used: Vec<(usize, usize)> = all
            .filter(|(to, from, _)| self.weights[(*to, *from)] != 0.0)
            .filter_map(|(_, from, sample)| usize::try_from(-sample).ok().filter(|age| *age > 0).map(|age| (from, age)))
            .flat_map(|(from, age)| {
                let channels = self.sampling.channels();
                (0..channels).map(move |channel| (from, age * channels - channel))
            })
            .collect();
        // Several receivers may use the same sample. The order by sender and age lets `dedup` find the repetitions.
        used.sort_unstable_by_key(|(from, age)| (*from, age.div_ceil(self.sampling.channels()), std::cmp::Reverse(*age)));
        used.dedup();
        used
    }
}

impl FrameMap {
    /// Returns the matrix from the relative state at the beginning of a frame to the relative state at its end: the states without the reference, then for each
    /// node the samples of earlier frames, and for each operator the seen places, the newest first.
    pub fn monodromy(&self) -> Matrix {
        self.driven(0)
    }

    /// Returns [`FrameMap::monodromy`] with further columns for the first `inputs` inputs.
    pub fn driven(&self, inputs: usize) -> Matrix {
        let count = self.states.rows();
        let kept: Vec<usize> = (0..count).filter(|row| Some(*row) != self.reference).collect();
        let states = kept.len();
        let (places, first) = self.places(inputs);
        let size = states + self.history();
        let mut matrix = Matrix::zeros(size, size + inputs);
        // A row moved by a translation is taken relative to the reference at the end of the frame, so the reference's row is subtracted.
        let mut put = |row: usize, source: &[f64], moved: f64| {
            for (place, entry) in places.iter().zip(source) {
                matrix[(row, *place)] += entry;
            }
            if let Some(reference) = self.reference {
                for (place, entry) in places.iter().zip(self.states.row(reference)) {
                    matrix[(row, *place)] -= moved * entry;
                }
            }
        };
        for (row, source) in kept.iter().enumerate() {
            put(row, self.states.row(*source), self.displacements[*source]);
        }
        let mut shifted = Vec::new();
        for (node, depth) in self.depth.iter().enumerate() {
            let sent = self.sent_by(node);
            for age in 1..=*depth {
                let row = first[node] + age - 1;
                if age <= sent.len() {
                    put(row, self.sent.row(sent.end - age), self.translation(age));
                } else {
                    put(row, &[], self.translation(age));
                    shifted.push((row, first[node] + age - sent.len() - 1));
                }
            }
        }
        // A sample older than all samples of the frame stays a state, and becomes older by the number of sent samples.
        for (row, column) in shifted {
            matrix[(row, column)] += 1.0;
        }
        matrix
    }

    /// Returns the distance by which a translation of everything by 1 moves a number of a sample, `age` numbers before the first number of the frame.
    pub fn translation(&self, age: usize) -> f64 {
        let channels = self.translations.len();
        // Numbers of a sample stand channel by channel, so the distance from the frame's first number gives the channel.
        self.translations[(channels - age % channels) % channels]
    }

    /// Returns the count of numbers of samples and seen places of earlier frames among the states.
    pub(crate) fn history(&self) -> usize {
        self.depth.iter().sum()
    }

    /// Returns the rows of `sent` of a node or a series of seen places, ordered by time and then by the numbers of a sample.
    pub fn sent_by(&self, node: usize) -> std::ops::Range<usize> {
        let end = self.first_sent.get(node + 1).copied().unwrap_or_else(|| self.sent.rows());
        self.first_sent[node]..end
    }

    /// Returns the number of states among the unknowns.
    pub fn state_unknowns(&self) -> usize {
        self.states.rows() - usize::from(self.reference.is_some())
    }

    /// Returns the row of the reference of all positions; `None` if the motion is tied to ground.
    pub const fn reference(&self) -> Option<usize> {
        self.reference
    }

    /// Marks a row as unmoved by a translation: the row of a body tied to ground and not to the other bodies.
    pub fn tie(&mut self, row: usize) {
        self.displacements[row] = 0.0;
    }

    /// Returns the distance by which a translation of everything by 1 moves a row of `states`.
    pub fn displacement(&self, row: usize) -> f64 {
        self.displacements[row]
    }

    /// Returns the column of [`FrameMap::driven`] for each unknown of the frame and each of the first `inputs` inputs; and the first column of each node's
    /// samples.
    pub fn places(&self, inputs: usize) -> (Vec<usize>, Vec<usize>) {
        let states = self.state_unknowns();
        let mut first = Vec::with_capacity(self.depth.len());
        let mut size = states;
        for depth in &self.depth {
            first.push(size);
            size += depth;
        }
        let used = self.used.iter().map(|(node, age)| first[*node] + age - 1);
        let places = (0..states).chain(used).chain(size..size + inputs).collect();
        (places, first)
    }
}

/// Returns the largest sum of absolute values of a row, over the `count` rows of one node.
fn norm(z: &Matrix, rows: Rows, count: usize) -> f64 {
    let first = rows.device.unwrap_or(rows.object);
    (first..first + count).map(|row| z.row(row).iter().map(|entry| entry.abs()).sum::<f64>()).fold(0.0, f64::max)
}

/// Returns the rows from `first` on.
fn tail(matrix: &Matrix, first: usize) -> Matrix {
    Matrix::from_fn(matrix.rows() - first, matrix.columns(), |row, column| matrix[(first + row, column)])
}
