//! The parts of matrix inequalities.

use cohaptic_stability::Matrix;

/// A row over the unknowns of a part.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Row {
    pub(crate) entries: Vec<f64>,
    /// A bound of the sum of the sizes of its entries' errors.
    pub(crate) error: f64,
}

/// A product of two rows, of which a multiplier is taken times a weight.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Product {
    pub(crate) factors: [usize; 2],
    pub(crate) multiplier: usize,
    pub(crate) weight: f64,
}

/// The rows that a shape measures.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Measured {
    pub(crate) shape: usize,
    pub(crate) rows: Vec<usize>,
}

/// One inequality.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Part {
    pub(crate) rows: Vec<Row>,
    pub(crate) before: Measured,
    pub(crate) after: Measured,
    pub(crate) products: Vec<Product>,
    /// The number of unknowns.
    pub(crate) unknowns: usize,
}

impl Part {
    /// Nothing yet, from one shape to another.
    pub(crate) const fn empty(before: usize, after: usize) -> Self {
        let before = Measured { shape: before, rows: Vec::new() };
        let after = Measured { shape: after, rows: Vec::new() };
        Self { rows: Vec::new(), before, after, products: Vec::new(), unknowns: 0 }
    }

    /// Adds a row; answers its number.
    pub(crate) fn put(&mut self, row: Row) -> usize {
        self.rows.push(row);
        self.rows.len() - 1
    }
}

/// All parts, which share shapes and multipliers.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Inequality {
    /// The number of rows of each shape.
    pub(crate) shapes: Vec<usize>,
    pub(crate) parts: Vec<Part>,
    /// For each multiplier, whether it may be below zero.
    pub(crate) free: Vec<bool>,
}

/// Shapes and multipliers.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Solution {
    pub(crate) shapes: Vec<Matrix>,
    pub(crate) multipliers: Vec<f64>,
}
