//! Any peers over any links: the second moment carried through a frame event by event.
//!
//! The only things left to chance are deliveries, and each concerns one scalar, what i holds of j. So the operator is a product of simple ones: motion and
//! sampling act as X ← T·X·Tᵀ on the rows and columns of one peer, and a delivery mixes X with what it becomes when the row and column of h_ij are
//! replaced by those of the sample. No matrix of n² × n² is formed.
//!
//! Where a link remembers (a chain of losses, or which sample is held when samples overtake) the moments are kept apart by the joint state of all chains,
//! V_s = E\[z·zᵀ·1(state = s)\], and a delivery acts on the factor of its own link. Fewer numbers would not do for many links: what a peer's force does to
//! E\[z·zᵀ·1(s_l)\] depends on all that it holds, whose next change depends on the chains of the other links, and so on until all are joined.

use super::arrivals::Outcome;
use super::positive::{Positive, pack, unpack};
use crate::Matrix;

/// Whether a computation keeps its signs, or adds up the sizes of all terms.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Signs {
    Kept,
    Dropped,
}

impl Signs {
    /// What stands before a term that is subtracted.
    pub(crate) const fn minus(self) -> f64 {
        match self {
            Self::Kept => -1.0,
            Self::Dropped => 1.0,
        }
    }
}

/// One frame.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Events {
    /// How many rows there are within a frame.
    pub(crate) rows: usize,
    pub(crate) steps: Vec<Step>,
    /// How many states the chain of each link has.
    pub(crate) chains: Vec<usize>,
    /// For each state between frames, the row that it is at the end of one; and its row at the beginning.
    pub(crate) kept: Vec<(usize, usize)>,
    /// The row that positions are relative to, and how far each kept state moves with it.
    pub(crate) reference: Option<(usize, Vec<f64>)>,
    /// How many roundings the maps of all steps have together.
    pub(crate) roundings: usize,
}

#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Step {
    /// The rows from `first` on become `map` times (those rows and, last, the mean of each number of the samples held); `sizes` are those of the terms of the
    /// map.
    Move { first: usize, map: Matrix, sizes: Matrix, held: Vec<Vec<(usize, f64)>> },
    /// The row becomes that combination.
    Sample { row: usize, of: [(usize, f64); 2] },
    /// The rows of a held sample, as many as a sample has numbers, may become those of another sample: `take` is its first row. Outcomes are in the order of
    /// their ends, and of their beginnings where these are equal.
    Deliver { link: usize, row: usize, numbers: usize, outcomes: Vec<Arrive> },
}

/// An outcome with the row that it takes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Arrive {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) take: Option<usize>,
    pub(crate) probability: f64,
}

impl Arrive {
    pub(crate) fn new(outcome: Outcome, row_of: impl Fn(i64) -> usize) -> Self {
        let Outcome { from, to, take, probability } = outcome;
        Self { from, to, take: take.map(row_of), probability }
    }
}

impl Events {
    /// How many joint states the chains have; `None` beyond measure.
    pub(crate) fn joint(&self) -> Option<usize> {
        self.chains.iter().try_fold(1_usize, |product, states| product.checked_mul(*states))
    }

    fn states(&self) -> usize {
        self.chains.iter().product()
    }

    /// Returns how many moments deliveries on links that remember add up in a frame.
    pub(crate) fn sums(&self) -> usize {
        let of = |step: &Step| match step {
            Step::Deliver { link, outcomes, .. } if self.chains[*link] > 1 => ways(outcomes).count() * (self.states() / self.chains[*link]),
            Step::Move { .. } | Step::Sample { .. } | Step::Deliver { .. } => 0,
        };
        self.steps.iter().map(of).sum()
    }

    /// Delivers on a link that remembers. `after` is room of the size of `moments`, which is taken once for all deliveries of a frame: thousands of moments that
    /// were made and dropped at each of them took as long as their sums.
    fn deliver(&self, moments: &mut Vec<Matrix>, after: &mut Vec<Matrix>, link: usize, (row, numbers): (usize, usize), outcomes: &[Arrive]) {
        let inner: usize = self.chains[link + 1..].iter().product();
        let own = self.chains[link];
        after.resize_with(moments.len(), || Matrix::zeros(self.rows, self.rows));
        // Chains with many places have a thousand outcomes and more, which each joint state would look through.
        let ways: Vec<(&[Arrive], f64)> = ways(outcomes).map(|way| (way, way.iter().map(|outcome| outcome.probability).sum())).collect();
        for (joint, sum) in after.iter_mut().enumerate() {
            let to = joint / inner % own;
            let base = joint - to * inner;
            sum.entries_mut().fill(0.0);
            let mut taken = Taken::new(numbers, self.rows);
            let first = ways.partition_point(|(way, _)| way[0].to < to);
            for (way, whole) in ways[first..].iter().take_while(|(way, _)| way[0].to == to) {
                let source = &moments[base + way[0].from * inner];
                way.iter().for_each(|outcome| taken.add(source, outcome, row));
                add_upper(sum, source, *whole);
            }
            mirror(sum);
            taken.put(sum, row);
        }
        std::mem::swap(moments, after);
    }

    fn step(&self, moments: &mut Vec<Matrix>, spare: &mut Vec<Matrix>, step: &Step, signs: Signs) {
        match step {
            Step::Move { first, map, sizes, held } => {
                let map = if signs == Signs::Kept { map } else { sizes };
                for moment in moments {
                    advance(moment, *first, map, held);
                }
            }
            Step::Sample { row, of: [(x, position), (v, velocity)] } => {
                for moment in moments {
                    let mut line: Vec<f64> = moment.row(*x).iter().zip(moment.row(*v)).map(|(x, v)| position * x + velocity * v).collect();
                    line[*row] = position * line[*x] + velocity * line[*v];
                    set_line(moment, *row, &line);
                }
            }
            Step::Deliver { link, row, numbers, outcomes } => match (self.chains[*link], outcomes.as_slice()) {
                // Nothing to keep apart: in place.
                (1, _) => {
                    for moment in moments {
                        let mut taken = Taken::new(*numbers, self.rows);
                        outcomes.iter().for_each(|outcome| taken.add(moment, outcome, *row));
                        taken.put(moment, *row);
                    }
                }
                (_, outcomes) => self.deliver(moments, spare, *link, (*row, *numbers), outcomes),
            },
        }
    }

    /// The states between frames at the end of one, relative to the reference.
    fn at_end(&self, moment: &Matrix, signs: Signs) -> Matrix {
        let minus = signs.minus();
        let size = self.kept.len();
        let with = |place: usize, other: usize| moment[(self.kept[place].0, self.kept[other].0)];
        match &self.reference {
            None => Matrix::from_fn(size, size, with),
            Some((reference, moved)) => {
                let line = moment.row(*reference);
                let square = line[*reference];
                Matrix::from_fn(size, size, |row, column| {
                    with(row, column)
                        + minus * (moved[row] * line[self.kept[column].0] + line[self.kept[row].0] * moved[column])
                        + moved[row] * moved[column] * square
                })
            }
        }
    }

    fn run(&self, element: &[f64], signs: Signs) -> Vec<f64> {
        let mut moments = Vec::with_capacity(self.states());
        for packed in self.matrices(element) {
            let mut moment = Matrix::zeros(self.rows, self.rows);
            for (row, (_, place)) in self.kept.iter().enumerate() {
                for (column, (_, other)) in self.kept.iter().enumerate() {
                    moment[(*place, *other)] = packed[(row, column)];
                }
            }
            moments.push(moment);
        }
        let mut spare = Vec::new();
        for step in &self.steps {
            self.step(&mut moments, &mut spare, step, signs);
        }
        let mut packed = Vec::with_capacity(element.len());
        for moment in &moments {
            pack(&self.at_end(moment, signs), &mut packed);
        }
        packed
    }
}

impl Positive for Events {
    fn unknowns(&self) -> usize {
        self.states() * self.kept.len() * (self.kept.len() + 1) / 2
    }

    fn base(&self) -> Vec<f64> {
        let mut base = Vec::with_capacity(self.unknowns());
        for _ in 0..self.states() {
            pack(&Matrix::identity(self.kept.len()), &mut base);
        }
        base
    }

    fn apply(&self, element: &[f64]) -> Vec<f64> {
        self.run(element, Signs::Kept)
    }

    fn sizes(&self, element: &[f64]) -> Vec<f64> {
        self.run(element, Signs::Dropped)
    }

    /// All steps one after the other, as if every term went through all of them.
    fn roundings(&self) -> usize {
        let of = |step: &Step| match step {
            // Twice a product with the map, of whose columns the last is a weighted sum, and the mean of the two triangles.
            Step::Move { map, held, .. } => 2 * (map.columns() + 2 * held.iter().map(Vec::len).sum::<usize>() + 2) + 2,
            // Two products, a sum, and the factors' own: twice.
            Step::Sample { .. } => 12,
            // A term goes into one end alone.
            Step::Deliver { outcomes, .. } => 2 * outcomes.chunk_by(|one, other| one.to == other.to).map(<[Arrive]>::len).max().unwrap_or(0) + 4,
        };
        self.steps.iter().map(of).sum::<usize>() + 2 * self.roundings + 8
    }

    fn matrices(&self, element: &[f64]) -> Vec<Matrix> {
        let mut rest = element;
        let mut matrices = Vec::with_capacity(self.states());
        for _ in 0..self.states() {
            let (moment, after) = unpack(self.kept.len(), rest);
            rest = after;
            matrices.push(moment);
        }
        matrices
    }
}

/// Outcomes by their end and their beginning.
fn ways(outcomes: &[Arrive]) -> impl Iterator<Item = &[Arrive]> {
    outcomes.chunk_by(|one, other| (one.to, one.from) == (other.to, other.from))
}

/// The rows of a held sample after a delivery, in the making.
struct Taken {
    lines: Vec<Vec<f64>>,
    /// Their products with one another.
    corner: Matrix,
}

impl Taken {
    fn new(numbers: usize, rows: usize) -> Self {
        Self { lines: vec![vec![0.0; rows]; numbers], corner: Matrix::zeros(numbers, numbers) }
    }

    /// Adds an outcome that takes rows of `source`; the held sample stands from `row` on.
    fn add(&mut self, source: &Matrix, outcome: &Arrive, row: usize) {
        let (taken, probability) = (outcome.take.unwrap_or(row), outcome.probability);
        for (number, line) in self.lines.iter_mut().enumerate() {
            line.iter_mut().zip(source.row(taken + number)).for_each(|(line, entry)| *line += probability * entry);
            for other in 0..self.corner.columns() {
                self.corner[(number, other)] += probability * source[(taken + number, taken + other)];
            }
        }
    }

    fn put(mut self, moment: &mut Matrix, row: usize) {
        for (number, line) in self.lines.iter_mut().enumerate() {
            line[row..row + self.corner.columns()].copy_from_slice(self.corner.row(number));
            set_line(moment, row + number, line);
        }
    }
}

/// X ← T·X·Tᵀ for a T that changes a few rows.
fn advance(moment: &mut Matrix, first: usize, map: &Matrix, held: &[Vec<(usize, f64)>]) {
    let (own, size) = (map.rows(), moment.rows());
    // The rows that it depends on: its own and the means of the samples held.
    let mut sources = Matrix::zeros(own + held.len(), size);
    for place in 0..own {
        sources.row_mut(place).copy_from_slice(moment.row(first + place));
    }
    for (number, held) in held.iter().enumerate() {
        for (row, weight) in held {
            sources.row_mut(own + number).iter_mut().zip(moment.row(*row)).for_each(|(sum, entry)| *sum += weight * entry);
        }
    }
    let lines = map.times(&sources);
    // Of the new rows, the columns of the same rows change too.
    let mut corner = Matrix::zeros(own, own + held.len());
    for row in 0..own {
        for place in 0..own {
            corner[(row, place)] = lines[(row, first + place)];
        }
        for (number, held) in held.iter().enumerate() {
            corner[(row, own + number)] = held.iter().map(|(column, weight)| weight * lines[(row, *column)]).sum();
        }
    }
    let corner = corner.times(&map.transposed());
    for row in 0..own {
        for column in 0..size {
            if !(first..first + own).contains(&column) {
                moment[(first + row, column)] = lines[(row, column)];
                moment[(column, first + row)] = lines[(row, column)];
            }
        }
        for place in 0..own {
            moment[(first + row, first + place)] = 0.5 * (corner[(row, place)] + corner[(place, row)]);
        }
    }
}

/// Adds the part of a symmetric matrix on and above the diagonal.
fn add_upper(sum: &mut Matrix, matrix: &Matrix, factor: f64) {
    for row in 0..sum.rows() {
        sum.row_mut(row)[row..].iter_mut().zip(&matrix.row(row)[row..]).for_each(|(sum, entry)| *sum += factor * entry);
    }
}

/// Copies the part above the diagonal to the part below it.
fn mirror(matrix: &mut Matrix) {
    for row in 0..matrix.rows() {
        for column in row + 1..matrix.columns() {
            matrix[(column, row)] = matrix[(row, column)];
        }
    }
}

fn set_line(moment: &mut Matrix, row: usize, line: &[f64]) {
    moment.row_mut(row).copy_from_slice(line);
    for (column, entry) in line.iter().enumerate() {
        moment[(column, row)] = *entry;
    }
}
