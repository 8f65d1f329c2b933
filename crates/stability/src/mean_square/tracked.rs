//! Product of the matrices of ticks, with a bound of the product's rounding errors.
//!
//! A tick adds up, for each entry of each row, terms whose sizes are together at most the entries of |T| + 2·I, with T the matrix of the tick: all gains are
//! zero or more, so the forces on one state have one sign, and only the term of the state's previous value may have the other sign. Each term is assumed to
//! have at most [`TICK`] roundings, the coefficients of the step maps included. Let P be the product of ticks, and G a matrix that follows P by
//!
//! ```text
//! P ← T·P,    G ← |T|·G + (|T| + 2·I)·|P|,
//! ```
//!
//! then, but for squares of rounding errors, P is within `TICK`·u·G of the product of the exact matrices.

use std::time::Duration;

use crate::Matrix;
use crate::lifted::node::{External, Scale, Scratch};
use crate::lifted::{Lifted, Node};

/// Number of roundings of a term in a tick: a dozen for the operations, and the rest for coefficients whose errors are some units in the last place.
const TICK: usize = 48;

/// Divisor of the terms in [`sizes`](Tracked::sizes). With 4 the divided terms rarely exceed the entries: the terms of a tick are at most |T| + 2·I, and the
/// diagonal of T is near 1.
const SHARE: usize = 4;

/// Map from the states at its beginning, followed by each number of the held sample (columns), to the present states (rows).
#[derive(Clone, Debug)]
pub(crate) struct Tracked {
    /// Computed product P.
    pub(crate) value: Matrix,
    /// Sizes G of the terms of `value`, added up over the events.
    terms: Matrix,
    /// Number of columns for the held sample.
    held: usize,
    /// Number of ticks and combinations so far.
    events: usize,
}

impl Tracked {
    /// Returns the map before any event. The first `columns` rows are the identity, the rows below are zero.
    pub(crate) fn new(rows: usize, columns: usize, held: usize) -> Self {
        let value = Matrix::from_fn(rows, columns + held, |row, column| if row == column && column < columns { 1.0 } else { 0.0 });
        Self { value, terms: Matrix::zeros(rows, columns + held), held, events: 0 }
    }

    /// Applies a tick of the node whose states are the first rows. The node's held samples must already be extrapolated to the instant of the tick.
    pub(crate) fn tick(&mut self, node: &Node, lifted: &Lifted<'_>, of_tick: (Duration, bool), scale: Scale) {
        let states = node.states();
        let held = self.held;
        let heard: Vec<Vec<f64>> = (0..held).map(|number| node.heard(lifted.sampling, number, 0.0, lifted.time).collect()).collect();
        let turn = |matrix: &mut Matrix| {
            let mut scratch = Scratch::default();
            scratch.resize(matrix.columns());
            let columns = matrix.columns() - held;
            let of = |row: usize, column: usize| column.checked_sub(columns).map_or(0.0, |number| heard[number][row]);
            let heard = Matrix::from_fn(1 + node.law.memory.len(), columns + held, of);
            node.tick(matrix, node.rows(0), |row| heard.row(row), External::default(), of_tick, scale, &mut scratch);
        };
        // The matrix T of this tick alone. Its terms must be computed before `value` changes, because they need P from before the tick.
        let mut single = Self::new(states, states, held).value;
        turn(&mut single);
        let columns = self.value.columns() - held;
        let terms = Matrix::from_fn(states, columns + held, |row, column| {
            let of_states: f64 = (0..states)
                .map(|state| {
                    let size = single[(row, state)].abs();
                    let kept = if row == state { 2.0 } else { 0.0 };
                    size * self.terms[(state, column)] + (size + kept) * self.value[(state, column)].abs()
                })
                .sum();
            of_states + column.checked_sub(columns).map_or(0.0, |number| single[(row, states + number)].abs())
        });
        for row in 0..states {
            self.terms.row_mut(row).copy_from_slice(terms.row(row));
        }
        turn(&mut self.value);
        self.events += 1;
    }

    /// Replaces row `row` by the linear combination `of` of two rows, given as (row, factor).
    pub(crate) fn combine(&mut self, row: usize, of: [(usize, f64); 2]) {
        for column in 0..self.value.columns() {
            let sum = |matrix: &Matrix| of.iter().map(|(from, factor)| factor * matrix[(*from, column)]).sum::<f64>();
            let size: f64 = of.iter().map(|(from, factor)| (factor * self.value[(*from, column)]).abs()).sum();
            let (value, terms) = (sum(&self.value), sum(&self.terms) + size);
            self.value[(row, column)] = value;
            self.terms[(row, column)] = terms;
        }
        self.events += 1;
    }

    /// Returns a matrix of bounds: for each entry the larger of its size and the size of its terms divided by [`SHARE`] and by the number of events. The bound
    /// should exceed the size rarely, because a larger coefficient makes the sizes of later steps grow from step to step.
    pub(crate) fn sizes(&self) -> Matrix {
        let share = 1.0 / crate::rounding::real(SHARE * self.events.max(1));
        Matrix::from_fn(self.value.rows(), self.value.columns(), |row, column| self.value[(row, column)].abs().max(self.terms[(row, column)] * share))
    }

    /// Returns the number of roundings of the [`sizes`](Self::sizes) that covers all errors of `value`.
    pub(crate) const fn roundings(&self) -> usize {
        SHARE * TICK * self.events
    }
}
