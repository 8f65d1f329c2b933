//! The data of matrix inequalities: rows, products, parts and solutions.

use cohaptic_stability::Matrix;

/// A row over the unknowns of a part.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Row {
    pub(crate) entries: Vec<f64>,
    /// Upper bound of the sum of the absolute errors of the row's entries.
    pub(crate) error: f64,
}

/// A product of two rows, which enters the inequality with the factor multiplier·weight.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Product {
    /// Indices of the two rows in [`Part::rows`].
    pub(crate) factors: [usize; 2],
    /// Index of the multiplier in [`Solution::multipliers`].
    pub(crate) multiplier: usize,
    pub(crate) weight: f64,
}

/// The rows that a shape measures.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Measured {
    /// Index of the shape in [`Solution::shapes`].
    pub(crate) shape: usize,
    /// Indices of the rows in [`Part::rows`], one per row of the shape.
    pub(crate) rows: Vec<usize>,
}

/// One matrix inequality M < 0.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Part {
    pub(crate) rows: Vec<Row>,
    pub(crate) before: Measured,
    pub(crate) after: Measured,
    pub(crate) products: Vec<Product>,
    /// Number of entries of every row.
    pub(crate) unknowns: usize,
}

impl Part {
    /// Returns a part without rows and products, with the indices of the shapes before and after the step.
    pub(crate) const fn empty(before: usize, after: usize) -> Self {
        let before = Measured { shape: before, rows: Vec::new() };
        let after = Measured { shape: after, rows: Vec::new() };
        Self { rows: Vec::new(), before, after, products: Vec::new(), unknowns: 0 }
    }

    /// Adds a row and returns the index of the row.
    pub(crate) fn put(&mut self, row: Row) -> usize {
        self.rows.push(row);
        self.rows.len() - 1
    }
}

/// All parts of an inequality, with common shapes and multipliers.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Inequality {
    /// Number of rows of each shape.
    pub(crate) shapes: Vec<usize>,
    pub(crate) parts: Vec<Part>,
    /// `true` if a multiplier may be below zero, indexed by multiplier.
    pub(crate) free: Vec<bool>,
}

/// Values of all shapes and multipliers.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Solution {
    pub(crate) shapes: Vec<Matrix>,
    pub(crate) multipliers: Vec<f64>,
}
