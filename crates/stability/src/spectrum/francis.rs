//! The double-shift QR iteration (Francis 1961/62; Golub & Van Loan 2013, Algorithms 7.5.1 and 7.5.2), for small matrices.

use num_complex::Complex64;

use super::hessenberg::TINY_SQUARE;
use super::square::Square;
use crate::rounding::real;

/// The largest number of sweeps for one eigenvalue. Two to four are usual; several eigenvalues near zero in a badly scaled matrix took 150.
const SWEEPS: u32 = 400;

/// The number of sweeps for one eigenvalue after which a subdiagonal entry counts as zero if it is small compared with the whole matrix.
const PATIENCE: u32 = 6;

/// Turns a Hessenberg matrix into a quasi-triangular matrix: blocks of one and two rows on the diagonal, zeros below.
///
/// With `FULL` the whole matrix is transformed (the real Schur form, up to blocks of two with real eigenvalues); without `FULL` only the diagonal blocks
/// are right, with less work. Returns false if the iteration did not converge.
#[inline]
pub(super) fn iterate<const FULL: bool, S: Square>(matrix: &mut S) -> bool {
    let size = matrix.size();
    let mut end = size;
    let mut sweeps = 0;
    let mut norm = 0.0;
    for row in 0..size {
        for column in row.saturating_sub(1)..size {
            norm += matrix.at(row, column).abs();
        }
    }
    while end > 2 {
        let last = end - 1;
        let mut first = last;
        while first > 0 {
            let below = matrix.at(first, first - 1).abs();
            let beside = matrix.at(first - 1, first - 1).abs() + matrix.at(first, first).abs();
            // In the first sweeps the entry is compared with its two neighbours on the diagonal. If several eigenvalues are zero the entry never becomes so
            // small; so in later sweeps the entry is compared with the whole matrix. The error of a dropped entry is then no larger than an error of the
            // reduction.
            let beside = if sweeps >= PATIENCE || beside == 0.0 { beside.max(norm / real(size)) } else { beside };
            if below <= f64::EPSILON * 0.5 * beside {
                matrix.put(first, first - 1, 0.0);
                break;
            }
            first -= 1;
        }
        // The last one or two rows have split off: `pair` gives the eigenvalues of a block of at most two rows.
        if first + 1 >= last {
            end = first;
            sweeps = 0;
            continue;
        }
        if sweeps == SWEEPS {
            return false;
        }
        sweeps += 1;
        sweep::<FULL, S>(matrix, first, last, sweeps);
    }
    true
}

/// Makes one sweep over the rows `first..=last`, at least three. `count` is the number of sweeps for this eigenvalue, this sweep among them.
#[inline]
fn sweep<const FULL: bool, S: Square>(matrix: &mut S, first: usize, last: usize, count: u32) {
    let size = matrix.size();
    // The shifts are the eigenvalues of the last block of two, given by x, y and the product w. Rarely an arbitrary block takes the place of the last block and
    // breaks cycles; more often it would undo slow progress.
    let (x, y, w) = if count == 10 || count.is_multiple_of(40) {
        let size = matrix.at(last, last - 1).abs() + matrix.at(last - 1, last - 2).abs();
        let middle = 0.75 * size + matrix.at(last, last);
        (middle, middle, -0.4375 * size * size)
    } else {
        (matrix.at(last, last), matrix.at(last - 1, last - 1), matrix.at(last, last - 1) * matrix.at(last - 1, last))
    };
    // (p, q, r) is the first column of (H − s₁)(H − s₂). Only its direction matters.
    let corner = matrix.at(first, first);
    let below = matrix.at(first + 1, first);
    let mut p = (x - corner) * (y - corner) - w + below * matrix.at(first, first + 1);
    let mut q = below * (matrix.at(first + 1, first + 1) + corner - x - y);
    let mut r = below * matrix.at(first + 2, first + 1);
    for place in first..last {
        let three = place + 2 <= last;
        if place > first {
            p = matrix.at(place, place - 1);
            q = matrix.at(place + 1, place - 1);
            r = if three { matrix.at(place + 2, place - 1) } else { 0.0 };
        }
        // The square of small entries can underflow, so small entries are scaled by the largest before the length is taken.
        let mut scale = 1.0;
        let mut square = p * p + (q * q + r * r);
        if square < TINY_SQUARE {
            let largest = p.abs().max(q.abs()).max(r.abs());
            if largest == 0.0 {
                continue;
            }
            scale = largest;
            (p, q, r) = (p / scale, q / scale, r / scale);
            square = p * p + (q * q + r * r);
        }
        // The length takes the sign of p, so the sum p + length has no cancellation.
        let length = square.sqrt().copysign(p);
        let head = p + length;
        let inverse = 1.0 / head;
        let factor = head / length;
        let (v1, v2) = (q * inverse, r * inverse);
        // The reflection makes the two entries below the subdiagonal zero. Setting them exactly keeps the Hessenberg form.
        if place > first {
            matrix.put(place, place - 1, -length * scale);
            matrix.put(place + 1, place - 1, 0.0);
            if three {
                matrix.put(place + 2, place - 1, 0.0);
            }
        }
        // Without the Schur form only the rows and columns of the active block are needed, since blocks outside keep their eigenvalues.
        let (top, right) = if FULL { (0, size) } else { (first, last + 1) };
        let bottom = (place + 3).min(last);
        if three {
            matrix.reflect_rows(place, place..right, factor, v1, v2);
            matrix.reflect_columns(place, top..bottom + 1, factor, v1, v2);
        } else {
            let f1 = factor * v1;
            for column in place..right {
                let (a, b) = (matrix.at(place, column), matrix.at(place + 1, column));
                let sum = a + v1 * b;
                matrix.put(place, column, a - factor * sum);
                matrix.put(place + 1, column, b - f1 * sum);
            }
            for row in top..=bottom {
                let (a, b) = (matrix.at(row, place), matrix.at(row, place + 1));
                let sum = a + v1 * b;
                matrix.put(row, place, a - factor * sum);
                matrix.put(row, place + 1, b - f1 * sum);
            }
        }
    }
}

/// Returns the eigenvalues of [a b; c d]; of a complex pair the eigenvalue with the positive imaginary part first.
#[inline]
pub(super) fn pair(a: f64, b: f64, c: f64, d: f64) -> [Complex64; 2] {
    let half = 0.5 * (a - d);
    let product = b * c;
    let discriminant = half * half + product;
    if discriminant < 0.0 {
        let (real, imaginary) = (0.5 * (a + d), (-discriminant).sqrt());
        return [Complex64::new(real, imaginary), Complex64::new(real, -imaginary)];
    }
    // The sum without cancellation gives the first eigenvalue; the second follows from the product b·c, without cancellation as well.
    let large = half + discriminant.sqrt().copysign(half);
    let other = if large == 0.0 { d } else { d - product / large };
    [Complex64::new(d + large, 0.0), Complex64::new(other, 0.0)]
}

/// Passes each eigenvalue of a quasi-triangular matrix to `take`, from top to bottom.
#[inline]
pub(super) fn each<S: Square>(matrix: &S, mut take: impl FnMut(Complex64)) {
    let size = matrix.size();
    let mut row = 0;
    while row < size {
        if row + 1 < size && matrix.at(row + 1, row) != 0.0 {
            for value in pair(matrix.at(row, row), matrix.at(row, row + 1), matrix.at(row + 1, row), matrix.at(row + 1, row + 1)) {
                take(value);
            }
            row += 2;
        } else {
            take(Complex64::new(matrix.at(row, row), 0.0));
            row += 1;
        }
    }
}
