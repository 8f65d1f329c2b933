//! Reduction to Hessenberg form by reflections (Golub & Van Loan 2013, Algorithm 7.4.2).

use super::square::Square;

/// Below this a sum of squares has lost digits to underflow.
pub(super) const TINY_SQUARE: f64 = 1e-280;

/// Turns the matrix into one with the same eigenvalues and zeros below the first subdiagonal.
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
            // Entries below 1e-140 compared with a matrix of about unit size: zero.
            for row in pivot + 1..size {
                matrix.put(row, column, 0.0);
            }
            continue;
        }
        let head = matrix.at(pivot, column);
        let norm = (head * head + below).sqrt().copysign(head);
        let inverse = 1.0 / (head + norm);
        let factor = (head + norm) / norm;
        // The reflector's vector, 1 first, is kept where the zeros will be.
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
