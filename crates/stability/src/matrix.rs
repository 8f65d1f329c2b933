//! Dense matrices, stored row by row: products, norms, and access to single rows. The module does not know what the entries mean.

use std::ops::{Add, Index, IndexMut, Mul, Range};

use num_complex::Complex64;

/// A dense real matrix, stored row by row. The analysis works on matrices of this type.
pub type Matrix = Dense<f64>;

/// A dense complex matrix, stored row by row.
pub type ComplexMatrix = Dense<Complex64>;

/// A dense matrix of numbers `T`, stored row by row. Users of the crate see real matrices: [`Matrix`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Dense<T> {
    rows: usize,
    columns: usize,
    entries: Vec<T>,
}

impl<T: Copy + Default> Dense<T> {
    /// Returns a matrix of that shape whose entries are all zero.
    #[must_use]
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self { rows, columns, entries: vec![T::default(); rows * columns] }
    }

    /// Returns the matrix whose entries are `entry(row, column)`.
    #[must_use]
    pub fn from_fn(rows: usize, columns: usize, mut entry: impl FnMut(usize, usize) -> T) -> Self {
        let entries = (0..rows * columns).map(|place| entry(place / columns, place % columns)).collect();
        Self { rows, columns, entries }
    }

    /// Returns the number of rows.
    #[must_use]
    pub const fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the number of columns.
    #[must_use]
    pub const fn columns(&self) -> usize {
        self.columns
    }

    /// Returns a row.
    ///
    /// # Panics
    ///
    /// If there is no such row.
    #[must_use]
    #[inline]
    pub fn row(&self, row: usize) -> &[T] {
        &self.entries[row * self.columns..(row + 1) * self.columns]
    }

    /// Returns a row for changes.
    ///
    /// # Panics
    ///
    /// If there is no such row.
    #[inline]
    pub fn row_mut(&mut self, row: usize) -> &mut [T] {
        &mut self.entries[row * self.columns..(row + 1) * self.columns]
    }

    /// Returns all entries, row by row.
    #[must_use]
    pub fn entries(&self) -> &[T] {
        &self.entries
    }

    /// Returns the transposed matrix: rows and columns exchanged.
    #[must_use]
    pub fn transposed(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |row, column| self[(column, row)])
    }
}

impl Matrix {
    /// Makes this matrix one of that shape with all entries zero, and reuses the memory of the old entries.
    pub(crate) fn reset(&mut self, rows: usize, columns: usize) {
        self.entries.clear();
        self.entries.resize(rows * columns, 0.0);
        (self.rows, self.columns) = (rows, columns);
    }

    /// Returns the identity matrix: ones on the diagonal, zeros elsewhere.
    #[must_use]
    pub fn identity(size: usize) -> Self {
        Self::from_fn(size, size, |row, column| if row == column { 1.0 } else { 0.0 })
    }

    /// Returns all entries, row by row, to be changed.
    pub(crate) fn entries_mut(&mut self) -> &mut [f64] {
        &mut self.entries
    }

    /// Returns the row `row` and the next row, to be changed together. Panics if the matrix has no such rows.
    #[inline]
    pub(crate) fn two_rows_mut(&mut self, row: usize) -> (&mut [f64], &mut [f64]) {
        self.entries[row * self.columns..(row + 2) * self.columns].split_at_mut(self.columns)
    }

    /// Returns the row `row` and the next two rows, to be changed together. Panics if the matrix has no such rows.
    #[inline]
    pub(crate) fn three_rows_mut(&mut self, row: usize) -> (&mut [f64], &mut [f64], &mut [f64]) {
        let (first, others) = self.entries[row * self.columns..(row + 3) * self.columns].split_at_mut(self.columns);
        let (second, third) = others.split_at_mut(self.columns);
        (first, second, third)
    }

    /// Copies the rows `rows` to the rows from `to` on. Source and target may overlap.
    ///
    /// # Panics
    ///
    /// If the matrix has no such rows.
    pub(crate) fn move_rows(&mut self, rows: Range<usize>, to: usize) {
        self.entries.copy_within(rows.start * self.columns..rows.end * self.columns, to * self.columns);
    }

    /// The product of the two.
    ///
    /// # Panics
    ///
    /// If the number of columns of this matrix is not the number of rows of the other.
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        product(self, other)
    }

    /// Returns the product of this matrix and a column.
    ///
    /// # Panics
    ///
    /// If the number of entries of the column is not the number of columns of this matrix.
    #[must_use]
    pub fn times_column(&self, column: &[f64]) -> Vec<f64> {
        assert_eq!(self.columns, column.len(), "the shapes of a product fit");
        (0..self.rows).map(|row| self.row(row).iter().zip(column).map(|(a, b)| a * b).sum()).collect()
    }

    /// Returns the matrix with every entry multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { rows: self.rows, columns: self.columns, entries: self.entries.iter().map(|entry| entry * factor).collect() }
    }

    /// Returns the Frobenius norm, the square root of the sum of the squares of all entries. The Frobenius norm bounds the 2-norm.
    #[must_use]
    pub fn frobenius_norm(&self) -> f64 {
        let largest = self.largest();
        if largest == 0.0 || !largest.is_finite() {
            return largest;
        }
        // Entries are divided by the largest before they are squared, so that squares neither overflow nor vanish.
        largest * self.entries.iter().map(|entry| (entry / largest).powi(2)).sum::<f64>().sqrt()
    }

    /// Returns the largest absolute value of an entry; NaN if an entry is NaN, 0 for an empty matrix.
    #[must_use]
    pub fn largest(&self) -> f64 {
        // After a NaN no comparison is true, so that the NaN stays unless a later NaN takes its place.
        self.entries.iter().fold(0.0, |largest: f64, entry| if entry.abs() > largest || entry.is_nan() { entry.abs() } else { largest })
    }

    /// Returns whether every entry is a finite number.
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

/// Returns the product of two matrices. The methods that call this function are not generic, so that users of the crate do not compile the product again,
/// perhaps without optimisation. Panics if the shapes do not fit.
fn product<T: Copy + Default + Add<Output = T> + Mul<Output = T>>(one: &Dense<T>, other: &Dense<T>) -> Dense<T> {
    assert_eq!(one.columns, other.rows, "the shapes of a product fit");
    let mut product = Dense::zeros(one.rows, other.columns);
    for row in 0..one.rows {
        // The inner loop runs along rows of `other` and of the product, whose entries are next to each other in memory.
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
