//! Access to a square matrix for the eigenvalue methods. One source serves arrays of a size known to the compiler and matrices of any size.

use std::ops::Range;

use crate::Matrix;

/// A square matrix, transformed in place.
pub(super) trait Square {
    /// Returns the number of rows, equal to the number of columns.
    fn size(&self) -> usize;
    fn at(&self, row: usize, column: usize) -> f64;
    fn put(&mut self, row: usize, column: usize, entry: f64);

    /// Reflects the three rows from `top` on, in the given columns: subtracts factor·v·(vᵀ·rows) from the rows, with v = (1, v1, v2).
    #[inline]
    fn reflect_rows(&mut self, top: usize, columns: Range<usize>, factor: f64, v1: f64, v2: f64) {
        let (f1, f2) = (factor * v1, factor * v2);
        for column in columns {
            let (a, b, c) = (self.at(top, column), self.at(top + 1, column), self.at(top + 2, column));
            let sum = a + v1 * b + v2 * c;
            self.put(top, column, a - factor * sum);
            self.put(top + 1, column, b - f1 * sum);
            self.put(top + 2, column, c - f2 * sum);
        }
    }

    /// Reflects the three columns from `left` on, in the given rows: subtracts factor·(columns·v)·vᵀ from the columns, with v = (1, v1, v2).
    #[inline]
    fn reflect_columns(&mut self, left: usize, rows: Range<usize>, factor: f64, v1: f64, v2: f64) {
        let (f1, f2) = (factor * v1, factor * v2);
        for row in rows {
            let (a, b, c) = (self.at(row, left), self.at(row, left + 1), self.at(row, left + 2));
            let sum = a + v1 * b + v2 * c;
            self.put(row, left, a - factor * sum);
            self.put(row, left + 1, b - f1 * sum);
            self.put(row, left + 2, c - f2 * sum);
        }
    }

    /// Reflects the rows after row `column`, in the columns after `column`, and then the columns after `column`, in all rows: a reflection subtracts factor·v
    /// times the product of vᵀ with the rows, or of the columns with v. The vector v is 1 followed by the entries of `column` from row `column + 2` on.
    #[inline]
    fn reflect_below(&mut self, column: usize, factor: f64) {
        // From the left: each column loses factor·v times its product with v. From the right the same holds for the rows.
        let (size, pivot) = (self.size(), column + 1);
        for other in pivot..size {
            let mut sum = self.at(pivot, other);
            for row in pivot + 1..size {
                sum += self.at(row, column) * self.at(row, other);
            }
            sum *= factor;
            self.put(pivot, other, self.at(pivot, other) - sum);
            for row in pivot + 1..size {
                self.put(row, other, self.at(row, other) - sum * self.at(row, column));
            }
        }
        for row in 0..size {
            let mut sum = self.at(row, pivot);
            for other in pivot + 1..size {
                sum += self.at(row, other) * self.at(other, column);
            }
            sum *= factor;
            self.put(row, pivot, self.at(row, pivot) - sum);
            for other in pivot + 1..size {
                self.put(row, other, self.at(row, other) - sum * self.at(other, column));
            }
        }
    }
}

impl<const N: usize> Square for [[f64; N]; N] {
    #[inline]
    fn size(&self) -> usize {
        N
    }

    #[inline]
    fn at(&self, row: usize, column: usize) -> f64 {
        self[row][column]
    }

    #[inline]
    fn put(&mut self, row: usize, column: usize, entry: f64) {
        self[row][column] = entry;
    }
}

impl Square for Matrix {
    #[inline]
    fn size(&self) -> usize {
        self.rows()
    }

    #[inline]
    fn at(&self, row: usize, column: usize) -> f64 {
        self[(row, column)]
    }

    #[inline]
    fn put(&mut self, row: usize, column: usize, entry: f64) {
        self[(row, column)] = entry;
    }

    // The result equals the default method's to the bit. Loops over slices let the compiler work on several entries of a row at a time.
    #[inline]
    fn reflect_rows(&mut self, top: usize, columns: Range<usize>, factor: f64, v1: f64, v2: f64) {
        let (f1, f2) = (factor * v1, factor * v2);
        let (first, second, third) = self.three_rows_mut(top);
        let others = second[columns.clone()].iter_mut().zip(&mut third[columns.clone()]);
        for (a, (b, c)) in first[columns].iter_mut().zip(others) {
            let sum = *a + v1 * *b + v2 * *c;
            *a -= factor * sum;
            *b -= f1 * sum;
            *c -= f2 * sum;
        }
    }

    // The result equals the default method's to the bit. The loops go row after row, because entries of one column of a large matrix are far apart in memory.
    fn reflect_below(&mut self, column: usize, factor: f64) {
        let (size, pivot) = (self.rows(), column + 1);
        let vector: Vec<f64> = (pivot..size).map(|row| if row == pivot { 1.0 } else { self[(row, column)] }).collect();
        let mut sums = self.row(pivot)[pivot..].to_vec();
        for (row, v) in (pivot + 1..size).zip(&vector[1..]) {
            for (sum, entry) in sums.iter_mut().zip(&self.row(row)[pivot..]) {
                *sum += v * entry;
            }
        }
        sums.iter_mut().for_each(|sum| *sum *= factor);
        for (row, v) in (pivot..size).zip(&vector) {
            for (entry, sum) in self.row_mut(row)[pivot..].iter_mut().zip(&sums) {
                *entry -= sum * v;
            }
        }
        for row in 0..size {
            let entries = &mut self.row_mut(row)[pivot..];
            let sum: f64 = entries.iter().zip(&vector).skip(1).fold(entries[0], |sum, (entry, v)| sum + entry * v) * factor;
            for (entry, v) in entries.iter_mut().zip(&vector) {
                *entry -= sum * v;
            }
        }
    }
}

/// Makes each row about as large as the column of the same number, by an exact similarity transform with powers of two (Parlett & Reinsch 1969). Calls
/// `scaled` with each place of a column multiplied by a power of two, and the exponent; a place may come several times.
///
/// A row and a column within a factor of eight of each other are left as they are. The test needs no division.
#[inline]
pub(super) fn balance<S: Square>(matrix: &mut S, mut scaled: impl FnMut(usize, i32)) {
    let size = matrix.size();
    // Each change of a row lowers the norm, so the passes end by themselves. The limit cuts off passes with little gain.
    for _ in 0..16 {
        let mut changed = false;
        for place in 0..size {
            let (mut row, mut column) = (0.0, 0.0);
            for other in 0..size {
                row += matrix.at(place, other).abs();
                column += matrix.at(other, place).abs();
            }
            let own = matrix.at(place, place).abs();
            (row, column) = (row - own, column - own);
            // A row or a column with a single entry, on the diagonal, belongs to an isolated eigenvalue: no factor can balance the row. (The rest of
            // the sum may be rounding of the difference.)
            if row <= own * f64::EPSILON || column <= own * f64::EPSILON || (row < 8.0 * column && column < 8.0 * row) {
                continue;
            }
            // The exponent of the power of two near √(row/column), by which the column is multiplied and the row divided.
            let exponent = ((exponent_of(row) - exponent_of(column)) / 2).clamp(-100, 100);
            if exponent == 0 {
                continue;
            }
            let (up, down) = (power_of_two(exponent), power_of_two(-exponent));
            for other in 0..size {
                if other != place {
                    matrix.put(place, other, matrix.at(place, other) * down);
                    matrix.put(other, place, matrix.at(other, place) * up);
                }
            }
            scaled(place, exponent);
            changed = true;
        }
        if !changed {
            break;
        }
    }
}

/// Returns the binary exponent of a positive normal number.
pub(super) fn exponent_of(number: f64) -> i32 {
    i32::try_from((number.to_bits() >> 52) & 0x7ff).unwrap_or(0) - 1023
}

/// Returns 2^exponent; exponents below −1022 and above 1023 are clamped.
pub(super) fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(u64::try_from((exponent + 1023).clamp(1, 2046)).unwrap_or(1) << 52)
}
