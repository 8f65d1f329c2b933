//! Operator on the second moment for any peers over any links, applied event by event through a frame.
//!
//! Only deliveries are random, and each delivery concerns one held sample h_ij, the sample that peer i holds of peer j. So the operator is a product of simple
//! operators. Motion and sampling act as X ← T·X·Tᵀ on the rows and columns of one peer. A delivery mixes X with the matrix in which the row and column of
//! h_ij are replaced by the row and column of the sample. No matrix of n² × n² is formed.
//!
//! A link may have a chain: of losses, or of the held sample if samples overtake. The operator then has one moment for each joint state of all chains,
//! V_s = E\[z·zᵀ·1(state = s)\], and a delivery changes the part of the joint state that belongs to its link. Moments per state of one link do not suffice for
//! many links: the effect of a peer's force on E\[z·zᵀ·1(s_l)\] depends on all samples that the peer holds, and the next change of each depends on the chain of
//! its own link.

use super::arrivals::Outcome;
use super::positive::{Positive, pack, unpack};
use crate::Matrix;

/// Mode of a computation: with the signs of all terms, or with the sizes of all terms added up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Signs {
    Kept,
    Dropped,
}

impl Signs {
    /// Returns the factor of a subtracted term: −1 with signs, 1 for sizes.
    pub(crate) const fn minus(self) -> f64 {
        match self {
            Self::Kept => -1.0,
            Self::Dropped => 1.0,
        }
    }
}

/// Operator of one frame.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Events {
    /// Number of rows of a moment within a frame.
    pub(crate) rows: usize,
    /// Steps of the frame in order.
    pub(crate) steps: Vec<Step>,
    /// Number of states of each link's chain, indexed by link; 1 for a link without a chain.
    pub(crate) chains: Vec<usize>,
    /// For each state between frames, its row at the end of a frame and its row at the beginning of the next frame.
    pub(crate) kept: Vec<(usize, usize)>,
    /// Row of the reference position, and the displacement of each kept state per unit of the reference, indexed as `kept`. `None` if the scene is tied to the
    /// ground.
    pub(crate) reference: Option<(usize, Vec<f64>)>,
    /// Sum of the roundings of the maps of all steps.
    pub(crate) roundings: usize,
}

/// Step of a frame.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Step {
    /// Motion of a node: the rows from `first` on become `map` times (these rows, then the weighted sum of each number of the held samples). `sizes` bounds the
    /// terms of `map`; `held` lists, for each number, the rows of the held samples with their weights.
    Move { first: usize, map: Matrix, sizes: Matrix, held: Vec<Vec<(usize, f64)>> },
    /// Sampling: `row` becomes the linear combination `of` of two rows, given as (row, factor).
    Sample { row: usize, of: [(usize, f64); 2] },
    /// Delivery on a link: the `numbers` rows of the held sample, from `row` on, may become the rows of another sample. `outcomes` are sorted by final state,
    /// then by initial state.
    Deliver { link: usize, row: usize, numbers: usize, outcomes: Vec<Arrive> },
}

/// Outcome of a delivery, with the row of the sample in place of its number.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Arrive {
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// First row of the sample that is taken in; `None` if the held sample stays.
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
    /// Returns the number of joint states of all chains; `None` if the number exceeds `usize`.
    pub(crate) fn joint(&self) -> Option<usize> {
        self.chains.iter().try_fold(1_usize, |product, states| product.checked_mul(*states))
    }

    fn states(&self) -> usize {
        self.chains.iter().product()
    }

    /// Returns the number of moments that the deliveries on links with a chain add up in a frame, for the estimate of the cost.
    pub(crate) fn sums(&self) -> usize {
        let of = |step: &Step| match step {
            Step::Deliver { link, outcomes, .. } if self.chains[*link] > 1 => ways(outcomes).count() * (self.states() / self.chains[*link]),
            Step::Move { .. } | Step::Sample { .. } | Step::Deliver { .. } => 0,
        };
        self.steps.iter().map(of).sum()
    }

    /// Delivers on a link with a chain of several states. `after` is a buffer of the size of `moments`, reused by all deliveries of a frame, because the
    /// allocation of thousands of moments per delivery is expensive.
    fn deliver(&self, moments: &mut Vec<Matrix>, after: &mut Vec<Matrix>, link: usize, (row, numbers): (usize, usize), outcomes: &[Arrive]) {
        // Joint states count with the last link fastest: `inner` joint states of later links lie between two neighbouring states of this link.
        let inner: usize = self.chains[link + 1..].iter().product();
        let own = self.chains[link];
        after.resize_with(moments.len(), || Matrix::zeros(self.rows, self.rows));
        // Grouped once for all joint states: chains with many places have a thousand outcomes and more, and a search through them per joint state is avoided.
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
                // With one state no other moment contributes, so that each moment is changed in place.
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

    /// Returns the moment of the kept states at the end of a frame, relative to the reference. `moment` has all rows.
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

    /// Sums the roundings of all steps, as if every term went through every step.
    fn roundings(&self) -> usize {
        let of = |step: &Step| match step {
            // Two products with the map, the weighted sums of the held samples that its last columns multiply, and the mean of the two triangles.
            Step::Move { map, held, .. } => 2 * (map.columns() + 2 * held.iter().map(Vec::len).sum::<usize>() + 2) + 2,
            // Rows and then columns: each has two products, a sum, and the roundings of the factors.
            Step::Sample { .. } => 12,
            // A term contributes to one final state only, so the longest list of outcomes with the same final state counts.
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

/// Returns the groups of outcomes with the same final and initial state.
fn ways(outcomes: &[Arrive]) -> impl Iterator<Item = &[Arrive]> {
    outcomes.chunk_by(|one, other| (one.to, one.from) == (other.to, other.from))
}

/// Rows of a held sample after a delivery, added up outcome by outcome.
struct Taken {
    /// Moments of each number of the held sample with all rows.
    lines: Vec<Vec<f64>>,
    /// Moments of the numbers of the held sample with one another.
    corner: Matrix,
}

impl Taken {
    fn new(numbers: usize, rows: usize) -> Self {
        Self { lines: vec![vec![0.0; rows]; numbers], corner: Matrix::zeros(numbers, numbers) }
    }

    /// Adds an outcome from the moment `source`. The held sample has the rows from `row` on.
    fn add(&mut self, source: &Matrix, outcome: &Arrive, row: usize) {
        let (taken, probability) = (outcome.take.unwrap_or(row), outcome.probability);
        for (number, line) in self.lines.iter_mut().enumerate() {
            line.iter_mut().zip(source.row(taken + number)).for_each(|(line, entry)| *line += probability * entry);
            for other in 0..self.corner.columns() {
                self.corner[(number, other)] += probability * source[(taken + number, taken + other)];
            }
        }
    }

    /// Writes the rows and columns of the held sample into `moment`, from `row` on.
    fn put(mut self, moment: &mut Matrix, row: usize) {
        for (number, line) in self.lines.iter_mut().enumerate() {
            line[row..row + self.corner.columns()].copy_from_slice(self.corner.row(number));
            set_line(moment, row + number, line);
        }
    }
}

/// Computes X ← T·X·Tᵀ for a T that changes the rows of one node only, in place and without forming T.
fn advance(moment: &mut Matrix, first: usize, map: &Matrix, held: &[Vec<(usize, f64)>]) {
    let (own, size) = (map.rows(), moment.rows());
    // Rows that the new rows depend on: the node's own rows and the weighted sums of the held samples.
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
    // The columns of the node's own rows change as well. `lines` has them before the product with Tᵀ.
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

/// Adds `factor` times the part of a symmetric matrix on and above the diagonal.
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

/// Replaces a row of a symmetric matrix and the column of the same index.
fn set_line(moment: &mut Matrix, row: usize, line: &[f64]) {
    moment.row_mut(row).copy_from_slice(line);
    for (column, entry) in line.iter().enumerate() {
        moment[(column, row)] = *entry;
    }
}
