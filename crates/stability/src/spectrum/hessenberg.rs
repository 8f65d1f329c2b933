//! Reduction to Hessenberg form by reflections (Golub & Van Loan 2013, Algorithm 7.4.2).

use super::square::Square;

/// A sum of squares below this bound may have lost digits to underflow.
pub(super) const TINY_SQUARE: f64 = 1e-280;

/// Transforms the matrix so that all entries below the first subdiagonal are zero and the eigenvalues stay the same.
#[inline]
pub(super) fn reduce<S: Square>(matrix: &mut S) {
    let size = matrix.size();
    for column in 0..size.saturating_sub(2) {
        let pivot = column + 1;
        let mut below = 0.0;
        for row in pivot + 1..size {
            below += matrix.at(row, column) * matrix.at(row, column);
        }
        if below < TINY_SQUARE {
            // The entries are below 1e-140 and the matrix has about unit size: they count as zero.
            for row in pivot + 1..size {
                matrix.put(row, column, 0.0);
            }
            continue;
        }
        let head = matrix.at(pivot, column);
        // With the sign of `head`, the sum head + norm has no cancellation.
        let norm = (head * head + below).sqrt().copysign(head);
        let inverse = 1.0 / (head + norm);
        let factor = (head + norm) / norm;
        // The vector of the reflection has a first entry of 1, which is not stored. Its other entries stand where the zeros will be.
        for row in pivot + 1..size {
            matrix.put(row, column, matrix.at(row, column) * inverse);
        }
        matrix.put(pivot, column, -norm);
        matrix.reflect_below(column, factor);
        for row in pivot + 1..size {
            matrix.put(row, column, 0.0);
        }
    }
}
