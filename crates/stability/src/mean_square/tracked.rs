//! A matrix that is made tick by tick, with a bound of its rounding errors.
//!
//! A tick adds up, for each entry of each row, terms whose sizes are together at most those of |T| + 2·I, T being the matrix of the tick: all gains are
//! zero or more, so that forces on one state have one sign, and only "what was there" may have the other. Each term is taken to have at most [`TICK`]
//! roundings, the coefficients of the step maps included. So if P is made of ticks and G is carried on with them by
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

/// The roundings of a term in a tick: a dozen of the operations, and room for coefficients that are good to some units in the last place.
const TICK: usize = 48;

/// A share of the terms as small as this does not outgrow the entries: those of a tick are at most |T| + 2·I, and the diagonal of T is near 1.
const SHARE: usize = 4;

/// The columns are the states to begin with and, last, each number of the sample held.
#[derive(Clone, Debug)]
pub(crate) struct Tracked {
    pub(crate) value: Matrix,
    terms: Matrix,
    held: usize,
    events: usize,
}

impl Tracked {
    /// The first rows are the states as they are; the rows below are zero.
    pub(crate) fn new(rows: usize, columns: usize, held: usize) -> Self {
        let value = Matrix::from_fn(rows, columns + held, |row, column| if row == column && column < columns { 1.0 } else { 0.0 });
        Self { value, terms: Matrix::zeros(rows, columns + held), held, events: 0 }
    }

    /// A tick of the node whose states are the first rows, and whose samples held are extrapolated to that tick.
    pub(crate) fn tick(&mut self, node: &Node, lifted: &Lifted<'_>, span: Duration, scale: Scale) {
        let states = node.states();
        let held = self.held;
        let heard: Vec<Vec<f64>> = (0..held).map(|number| node.heard(lifted.sampling, number, 0.0, lifted.time).collect()).collect();
        let turn = |matrix: &mut Matrix| {
            let mut scratch = Scratch::default();
            scratch.resize(matrix.columns());
            let columns = matrix.columns() - held;
            let of = |row: usize, column: usize| column.checked_sub(columns).map_or(0.0, |number| heard[number][row]);
            let heard = Matrix::from_fn(1 + node.law.memory.len(), columns + held, of);
            node.tick(matrix, node.rows(0), |row| heard.row(row), External::default(), span, scale, &mut scratch);
        };
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

    /// A row becomes that combination of two others.
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

    /// At least the size of each entry, and a [`SHARE`]-th of the terms that it was added up from, on average over the events. Little more than the former:
    /// a coefficient that is larger here grows from step to step.
    pub(crate) fn sizes(&self) -> Matrix {
        let share = 1.0 / crate::rounding::real(SHARE * self.events.max(1));
        Matrix::from_fn(self.value.rows(), self.value.columns(), |row, column| self.value[(row, column)].abs().max(self.terms[(row, column)] * share))
    }

    /// The number of roundings of the [`sizes`](Self::sizes) cover all errors.
    pub(crate) const fn roundings(&self) -> usize {
        SHARE * TICK * self.events
    }
}
