//! One frame of the lifted system: where it leads, as a linear function of where it began.

use super::node::{External, Node, Rows, Scale, Scratch};
use super::rounding::Rounding;
use super::system::Lifted;
use crate::timetable::{Event, Instants};
use crate::{Matrix, Unwatched, Watch};

/// The inputs and outputs within a frame.
pub trait Instrument {
    /// How many inputs there are, each a column more.
    fn inputs(&self) -> usize {
        0
    }

    /// Sets the hand's force on the device of a node at a tick, `at` ns into the frame, as a function of the inputs \[N\]; answers whether there is one.
    fn push(&mut self, _node: usize, _at: u64, _inputs: &mut [f64]) -> bool {
        false
    }

    /// Sees the velocity of the device of a node at a tick, before it moves; multiplied by the common time.
    fn see(&mut self, _node: usize, _at: u64, _velocity: &[f64]) {}

    /// Sees all rows at a tick of a node, whose own are `rows`, before it moves. Sets what replaces the force of its coupling (first) and of its wall on the
    /// copy, as functions of the inputs \[N\]; answers which of them are replaced.
    fn touch(&mut self, _node: usize, _z: &Matrix, _rows: Rows, _inputs: [&mut [f64]; 2]) -> [bool; 2] {
        [false; 2]
    }
}

/// Nothing is pushed or looked at.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Autonomous;

impl Instrument for Autonomous {}

/// Where a frame leads.
///
/// The unknowns, one column each: the states at the beginning, but for the reference; then the samples of earlier frames that are used; then inputs.
/// A sample is one number or two, as [`Sampling`](super::Sampling) says, each with a place of its own: with c numbers a sample, number i of sample s has the place c·s + i.
#[derive(Clone, PartialEq, Debug)]
pub struct FrameMap {
    /// The states at the end, one row each, the reference among them, in positions as they are.
    pub states: Matrix,
    /// How far a translation by 1 moves each of the rows: 1 for positions.
    displacements: Vec<f64>,
    /// The row of the position that all others are relative to.
    reference: Option<usize>,
    /// The samples sent in the frame: for each node, its rows in `sent`.
    pub sent: Matrix,
    first_sent: Vec<usize>,
    /// The samples of earlier frames that are used: of which node, how many samples before this frame's first.
    pub used: Vec<(usize, usize)>,
    depth: Vec<usize>,
    /// How far a translation by 1 moves each number of a sample.
    translations: Vec<f64>,
    /// A bound of the rounding errors of all rows, in the largest sum of sizes of a row.
    pub error: f64,
}

/// After how many entries that are worked on it is asked whether to go on: some ten milliseconds.
const LOOK: usize = 1_000_000;

impl Lifted<'_> {
    /// Steps through the frame with all unknowns at once.
    #[expect(clippy::missing_panics_doc, reason = "nothing ends what nobody watches")]
    pub fn frame(&self, instrument: &mut impl Instrument) -> FrameMap {
        self.frame_watched(instrument, &Unwatched).expect("without a watch nothing ends it")
    }

    /// [`Lifted::frame`]; `None` if the watch ends it.
    pub(crate) fn frame_watched(&self, instrument: &mut impl Instrument, watch: &dyn Watch) -> Option<FrameMap> {
        let (channels, silent) = (self.sampling.channels(), self.sampling.is_silent(self.time));
        let rows = self.rows();
        let count = self.nodes.iter().map(Node::states).sum::<usize>();
        let reference = (!self.tied).then(|| rows[0].object);
        let used = if silent { Vec::new() } else { self.used() };
        let states = count - usize::from(reference.is_some());
        let inputs = states + used.len();
        let columns = inputs + instrument.inputs();
        let scale = Scale { time: self.time, compliance: self.nodes[0].compliance(self.time) };

        let mut z = Matrix::zeros(count, columns);
        for row in 0..count {
            match reference {
                Some(reference) if row == reference => {}
                Some(reference) if row > reference => z[(row, row - 1)] = 1.0,
                _ => z[(row, row)] = 1.0,
            }
        }
        // Samples: those used of earlier frames, then those sent in this one.
        let mut first_sent = Vec::with_capacity(self.nodes.len());
        let mut samples = used.len();
        for sent in &self.timetable.sent {
            first_sent.push(samples);
            samples += sent * channels;
        }
        let mut store = Matrix::zeros(samples, columns);
        for place in 0..used.len() {
            store[(place, states + place)] = 1.0;
        }
        let mut next_sent = first_sent.clone();
        let nodes = self.nodes.len();
        // The row of the first number of a sample; those of its others follow.
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
        // What each row of a node's law hears.
        let law_rows = 1 + self.nodes.iter().map(|node| node.law.memory.len()).max().unwrap_or(0);
        let mut heard = Matrix::zeros(nodes * law_rows, columns);
        let instants = self.ages_matter().then(|| Instants::of(self.timetable));
        let mut stale = vec![true; nodes];
        let mut scratch = Scratch::default();
        scratch.resize(columns);
        let mut push = vec![0.0; columns];
        let [mut coupling, mut wall] = [vec![0.0; columns], vec![0.0; columns]];
        let step = self.nodes.iter().map(|node| node.step_norm(scale)).fold(1.0, f64::max);
        let mut rounding = Rounding::new(step);
        let mut since = 0;
        for event in &self.timetable.events {
            // An event takes some operations in each column.
            since += columns;
            if since > LOOK {
                since = 0;
                if watch.stops() {
                    return None;
                }
            }
            match *event {
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
                Event::Tick { node, at, span } => {
                    if std::mem::take(&mut stale[node]) || instants.is_some() {
                        (0..law_rows).for_each(|row| heard.row_mut(node * law_rows + row).fill(0.0));
                        for from in 0..nodes {
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
                    let [touches, stands] = instrument.touch(node, &z, rows[node], [&mut coupling[inputs..], &mut wall[inputs..]]);
                    let external = External {
                        hand: pushed.then_some(push.as_slice()),
                        coupling: touches.then_some(coupling.as_slice()),
                        wall: stands.then_some(wall.as_slice()),
                    };
                    let heard = |row: usize| heard.row(node * law_rows + row);
                    self.nodes[node].tick(&mut z, rows[node], heard, external, span, scale, &mut scratch);
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
            depth: self.timetable.depth.iter().map(|depth| if silent { 0 } else { depth * channels }).collect(),
            translations: (0..channels).map(|channel| self.sampling.translation(channel, self.time)).collect(),
            error: if instrument.inputs() == 0 {
                rounding.bound(|| self.error())
            } else {
                // Nothing that is pushed is among the rows of the closer bound.
                rounding.bound(|| f64::INFINITY)
            },
        })
    }

    /// Whether the law of a node uses the ages of samples, so that the same sample is heard differently from tick to tick.
    fn ages_matter(&self) -> bool {
        self.nodes.iter().any(|node| node.law.horizon.is_some())
    }

    /// The numbers of samples of earlier frames that are used in this one, by node and then by age.
    fn used(&self) -> Vec<(usize, usize)> {
        let deliveries = self.timetable.events.iter().filter_map(|event| match event {
            Event::Deliver { from, to, sample } => Some((*to, *from, *sample)),
            Event::Sample { .. } | Event::Tick { .. } => None,
        });
        let all = self.timetable.held.iter().copied().chain(deliveries);
        // Only samples that weigh something are unknowns; a mean over nobody holds none.
        let mut used: Vec<(usize, usize)> = all
            .filter(|(to, from, _)| self.weights[(*to, *from)] != 0.0)
            .filter_map(|(_, from, sample)| usize::try_from(-sample).ok().filter(|age| *age > 0).map(|age| (from, age)))
            .flat_map(|(from, age)| {
                let channels = self.sampling.channels();
                (0..channels).map(move |channel| (from, age * channels - channel))
            })
            .collect();
        used.sort_unstable_by_key(|(from, age)| (*from, age.div_ceil(self.sampling.channels()), std::cmp::Reverse(*age)));
        used.dedup();
        used
    }
}

impl FrameMap {
    /// The matrix that one frame multiplies the relative state by: states but for the reference, then for each node the samples of earlier frames, the
    /// newest first.
    pub fn monodromy(&self) -> Matrix {
        self.driven(0)
    }

    /// The same with a column for each of the first `inputs` inputs behind.
    pub fn driven(&self, inputs: usize) -> Matrix {
        let count = self.states.rows();
        let kept: Vec<usize> = (0..count).filter(|row| Some(*row) != self.reference).collect();
        let states = kept.len();
        let (places, first) = self.places(inputs);
        let size = states + self.history();
        let mut matrix = Matrix::zeros(size, size + inputs);
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
        for (row, column) in shifted {
            matrix[(row, column)] += 1.0;
        }
        matrix
    }

    /// How far a translation by 1 moves a number of a sample that has that place before the first of the frame.
    pub fn translation(&self, age: usize) -> f64 {
        let channels = self.translations.len();
        self.translations[(channels - age % channels) % channels]
    }

    /// How many numbers of samples of earlier frames are states.
    pub(crate) fn history(&self) -> usize {
        self.depth.iter().sum()
    }

    /// The rows of `sent` that a node sent, in order of time and then of the numbers of a sample.
    pub fn sent_by(&self, node: usize) -> std::ops::Range<usize> {
        let end = self.first_sent.get(node + 1).copied().unwrap_or_else(|| self.sent.rows());
        self.first_sent[node]..end
    }

    /// How many unknowns are states.
    pub fn state_unknowns(&self) -> usize {
        self.states.rows() - usize::from(self.reference.is_some())
    }

    /// The row of the position that all others are relative to.
    pub const fn reference(&self) -> Option<usize> {
        self.reference
    }

    /// A translation leaves a row as it is: that of a body which something ties to ground and nothing to the others.
    pub fn tie(&mut self, row: usize) {
        self.displacements[row] = 0.0;
    }

    /// How far a translation by 1 moves a row.
    pub fn displacement(&self, row: usize) -> f64 {
        self.displacements[row]
    }

    /// Where the unknowns of the frame, and of this number of inputs, stand among the columns of [`FrameMap::driven`]; and where the samples of each node do.
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

/// The largest sum of the sizes of a row, over the rows of one node.
fn norm(z: &Matrix, rows: Rows, count: usize) -> f64 {
    let first = rows.device.unwrap_or(rows.object);
    (first..first + count).map(|row| z.row(row).iter().map(|entry| entry.abs()).sum::<f64>()).fold(0.0, f64::max)
}

/// The rows from `first` on.
fn tail(matrix: &Matrix, first: usize) -> Matrix {
    Matrix::from_fn(matrix.rows() - first, matrix.columns(), |row, column| matrix[(first + row, column)])
}
