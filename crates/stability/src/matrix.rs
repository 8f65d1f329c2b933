//! Dense matrices, row by row.

use std::ops::{Add, Index, IndexMut, Mul, Range};

use num_complex::Complex64;

/// A dense real matrix, stored row by row: what the analysis works on.
pub type Matrix = Dense<f64>;

/// A dense complex matrix, stored row by row.
pub type ComplexMatrix = Dense<Complex64>;

/// A dense matrix of numbers `T`, stored row by row. Users see real ones: [`Matrix`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Dense<T> {
    rows: usize,
    columns: usize,
    entries: Vec<T>,
}

impl<T: Copy + Default> Dense<T> {
    /// All entries zero.
    #[must_use]
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self { rows, columns, entries: vec![T::default(); rows * columns] }
    }

    /// Each entry from its row and column.
    #[must_use]
    pub fn from_fn(rows: usize, columns: usize, mut entry: impl FnMut(usize, usize) -> T) -> Self {
        let entries = (0..rows * columns).map(|place| entry(place / columns, place % columns)).collect();
        Self { rows, columns, entries }
    }

    /// The number of rows.
    #[must_use]
    pub const fn rows(&self) -> usize {
        self.rows
    }

    /// The number of columns.
    #[must_use]
    pub const fn columns(&self) -> usize {
        self.columns
    }

    /// A row.
    ///
    /// # Panics
    ///
    /// If there is no such row.
    #[must_use]
    #[inline]
    pub fn row(&self, row: usize) -> &[T] {
        &self.entries[row * self.columns..(row + 1) * self.columns]
    }

    /// A row, to be changed.
    ///
    /// # Panics
    ///
    /// If there is no such row.
    #[inline]
    pub fn row_mut(&mut self, row: usize) -> &mut [T] {
        &mut self.entries[row * self.columns..(row + 1) * self.columns]
    }

    /// All entries, row by row.
    #[must_use]
    pub fn entries(&self) -> &[T] {
        &self.entries
    }

    /// Rows and columns exchanged.
    #[must_use]
    pub fn transposed(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |row, column| self[(column, row)])
    }
}

impl Matrix {
    /// Becomes a matrix of that shape, all entries zero, in the memory that it has.
    pub(crate) fn reset(&mut self, rows: usize, columns: usize) {
        self.entries.clear();
        self.entries.resize(rows * columns, 0.0);
        (self.rows, self.columns) = (rows, columns);
    }

    /// Ones on the diagonal.
    #[must_use]
    pub fn identity(size: usize) -> Self {
        Self::from_fn(size, size, |row, column| if row == column { 1.0 } else { 0.0 })
    }

    /// All entries, row by row, to be changed.
    pub(crate) fn entries_mut(&mut self) -> &mut [f64] {
        &mut self.entries
    }

    /// A row and the one after it, to be changed together.
    #[inline]
    pub(crate) fn two_rows_mut(&mut self, row: usize) -> (&mut [f64], &mut [f64]) {
        self.entries[row * self.columns..(row + 2) * self.columns].split_at_mut(self.columns)
    }

    /// A row and the two after it, to be changed together.
    #[inline]
    pub(crate) fn three_rows_mut(&mut self, row: usize) -> (&mut [f64], &mut [f64], &mut [f64]) {
        let (first, others) = self.entries[row * self.columns..(row + 3) * self.columns].split_at_mut(self.columns);
        let (second, third) = others.split_at_mut(self.columns);
        (first, second, third)
    }

    /// Copies rows to where they begin at `to`, also over themselves.
    ///
    /// # Panics
    ///
    /// If there are no such rows.
    pub(crate) fn move_rows(&mut self, rows: Range<usize>, to: usize) {
        self.entries.copy_within(rows.start * self.columns..rows.end * self.columns, to * self.columns);
    }

    /// The product of the two.
    ///
    /// # Panics
    ///
    /// If this matrix has not as many columns as the other has rows.
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        product(self, other)
    }

    /// The product with a column.
    ///
    /// # Panics
    ///
    /// If the column has not as many entries as this matrix has columns.
    #[must_use]
    pub fn times_column(&self, column: &[f64]) -> Vec<f64> {
        assert_eq!(self.columns, column.len(), "the shapes of a product fit");
        (0..self.rows).map(|row| self.row(row).iter().zip(column).map(|(a, b)| a * b).sum()).collect()
    }

    /// Every entry times `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { rows: self.rows, columns: self.columns, entries: self.entries.iter().map(|entry| entry * factor).collect() }
    }

    /// The square root of the sum of the squares of all entries, which bounds the 2-norm.
    #[must_use]
    pub fn frobenius_norm(&self) -> f64 {
        let largest = self.largest();
        if largest == 0.0 || !largest.is_finite() {
            return largest;
        }
        // Scaled, so that squares neither overflow nor vanish.
        largest * self.entries.iter().map(|entry| (entry / largest).powi(2)).sum::<f64>().sqrt()
    }

    /// The size of the largest entry; NaN if any is.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.entries.iter().fold(0.0, |largest: f64, entry| if entry.abs() > largest || entry.is_nan() { entry.abs() } else { largest })
    }

    /// Whether every entry is a finite number.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.entries.iter().all(|entry| entry.is_finite())
    }
}

impl ComplexMatrix {
    /// The product of the two.
    pub fn times(&self, other: &Self) -> Self {
        product(self, other)
    }
}

/// The product of two matrices. The methods that call this are not generic, so that users of the crate do not compile it again, perhaps without optimisation.
fn product<T: Copy + Default + Add<Output = T> + Mul<Output = T>>(one: &Dense<T>, other: &Dense<T>) -> Dense<T> {
    assert_eq!(one.columns, other.rows, "the shapes of a product fit");
    let mut product = Dense::zeros(one.rows, other.columns);
    for row in 0..one.rows {
        for (inner, factor) in one.row(row).iter().enumerate() {
            for (sum, entry) in product.row_mut(row).iter_mut().zip(other.row(inner)) {
                *sum = *sum + *factor * *entry;
            }
        }
    }
    product
}

impl<T> Index<(usize, usize)> for Dense<T> {
    type Output = T;

    #[inline]
    fn index(&self, (row, column): (usize, usize)) -> &T {
        &self.entries[row * self.columns + column]
    }
}

impl<T> IndexMut<(usize, usize)> for Dense<T> {
    #[inline]
    fn index_mut(&mut self, (row, column): (usize, usize)) -> &mut T {
        &mut self.entries[row * self.columns + column]
    }
}
