//! The complex Schur form of a small matrix, together with rows and columns that are transformed along with the matrix.
//!
//! With a unitary Q that makes T = Q*·A·Q upper triangular, Q*·B and C·Q are what an input B and an output C are in the coordinates of T. Q itself is not
//! formed: the transformations of the rows are made on the columns of B too, those of the columns on the rows of C.
//!
//! The method is the single-shift QR iteration (Golub & Van Loan 2013, Sections 7.4 and 7.5) with Wilkinson's shift, in complex numbers throughout. The
//! result is triangular at once; a quasi-triangular form would have blocks of two that have to be split afterwards.

use num_complex::Complex64;

/// The largest number of sweeps for one eigenvalue; two or three are usual.
const SWEEPS: u32 = 60;

/// A square matrix A with further columns (inputs B) and further rows (outputs C), transformed in place. Meant to be loaded again and again: the memory of
/// earlier matrices is reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct Schur {
    size: usize,
    rows: usize,
    columns: usize,
    entries: Vec<Complex64>,
}

impl Schur {
    /// Loads [A B; C 0], where A has `size` rows; `entry` returns A, B and C by row and column.
    pub(crate) fn load(&mut self, size: usize, (outputs, inputs): (usize, usize), entry: impl Fn(usize, usize) -> f64) {
        self.size = size;
        self.rows = size + outputs;
        self.columns = size + inputs;
        self.entries.clear();
        for row in 0..self.rows {
            for column in 0..self.columns {
                let corner = row >= size && column >= size;
                self.entries.push(Complex64::new(if corner { 0.0 } else { entry(row, column) }, 0.0));
            }
        }
    }

    /// Returns an entry of T, of Q*·B (columns beyond those of T) or of C·Q (rows beyond those of T).
    #[inline]
    pub(crate) fn at(&self, row: usize, column: usize) -> Complex64 {
        self.entries[row * self.columns + column]
    }

    /// Makes the matrix triangular. Returns false if the iteration does not converge, or if an entry is not finite.
    pub(crate) fn triangularise(&mut self) -> bool {
        if !self.entries.iter().all(|entry| entry.re.is_finite()) {
            return false;
        }
        self.reduce();
        let mut end = self.size;
        let mut sweeps = 0;
        let norm: f64 = (0..self.size).flat_map(|row| (0..self.size).map(move |column| (row, column))).map(|(r, c)| self.at(r, c).l1_norm()).sum();
        while end > 1 {
            let last = end - 1;
            let mut first = last;
            while first > 0 {
                let below = self.at(first, first - 1).l1_norm();
                let beside = self.at(first - 1, first - 1).l1_norm() + self.at(first, first).l1_norm();
                // The entry is compared with the whole matrix if both diagonal neighbours are zero, or if the iteration is slow because several eigenvalues
                // are zero.
                let beside = if beside == 0.0 || sweeps > 10 { beside.max(norm) } else { beside };
                if below <= 0.5 * f64::EPSILON * beside {
                    self.put(first, first - 1, Complex64::default());
                    break;
                }
                first -= 1;
            }
            if first == last {
                end = last;
                sweeps = 0;
                continue;
            }
            if sweeps == SWEEPS {
                return false;
            }
            sweeps += 1;
            self.sweep(first, last, sweeps);
        }
        self.entries.iter().all(|entry| entry.is_finite())
    }

    #[inline]
    fn put(&mut self, row: usize, column: usize, entry: Complex64) {
        self.entries[row * self.columns + column] = entry;
    }

    /// Reduces the matrix to Hessenberg form, with zeros below the first subdiagonal, by rotations of neighbouring rows and columns.
    fn reduce(&mut self) {
        for column in 0..self.size.saturating_sub(2) {
            // From the bottom up: each rotation makes one entry zero and touches no zero made before.
            for row in (column + 2..self.size).rev() {
                let (upper, lower) = (self.at(row - 1, column), self.at(row, column));
                if let Some(rotation) = Rotation::of(upper, lower) {
                    self.rotate(row - 1, column, self.size, rotation);
                    self.put(row, column, Complex64::default());
                }
            }
        }
    }

    /// Makes one sweep over the rows `first..=last`; `count` is the number of sweeps for this eigenvalue, this one among them.
    fn sweep(&mut self, first: usize, last: usize, count: u32) {
        let shift = if count.is_multiple_of(12) {
            // An arbitrary shift in every twelfth sweep breaks cycles.
            self.at(last, last) + self.at(last, last - 1).l1_norm()
        } else {
            nearer(self.at(last - 1, last - 1), self.at(last - 1, last), self.at(last, last - 1), self.at(last, last))
        };
        for place in first..last {
            let (upper, lower) = if place == first {
                (self.at(first, first) - shift, self.at(first + 1, first))
            } else {
                (self.at(place, place - 1), self.at(place + 1, place - 1))
            };
            // The first rotation brings the shift in, the next rotations move the entry below the subdiagonal out at the bottom.
            let Some(rotation) = Rotation::of(upper, lower) else { continue };
            self.rotate(place, place.saturating_sub(usize::from(place > first)), (place + 3).min(last + 1), rotation);
            if place > first {
                self.put(place + 1, place - 1, Complex64::default());
            }
        }
    }

    /// Rotates the rows `top` and `top + 1` from column `left` on, and the columns of the same numbers in the rows before `bottom`. The inputs of the two rows
    /// and the outputs of the two columns are rotated along.
    fn rotate(&mut self, top: usize, left: usize, bottom: usize, rotation: Rotation) {
        let Rotation { cosine, sine } = rotation;
        let (upper, lower) = self.entries[top * self.columns..(top + 2) * self.columns].split_at_mut(self.columns);
        for (a, b) in upper[left..].iter_mut().zip(&mut lower[left..]) {
            (*a, *b) = (*a * cosine + sine * *b, *b * cosine - sine.conj() * *a);
        }
        let mut column = |row: usize| {
            let place = row * self.columns + top;
            let (a, b) = (self.entries[place], self.entries[place + 1]);
            self.entries[place] = a * cosine + sine.conj() * b;
            self.entries[place + 1] = b * cosine - sine * a;
        };
        // A Hessenberg matrix has zeros in the two columns below row `bottom`. The rows after `size` are outputs and always take part.
        (0..bottom).for_each(&mut column);
        (self.size..self.rows).for_each(&mut column);
    }
}

/// The unitary matrix [c s; −s* c] that turns a pair into one whose second entry is zero.
#[derive(Clone, Copy, Debug)]
struct Rotation {
    cosine: f64,
    sine: Complex64,
}

impl Rotation {
    /// Returns the rotation for a pair; `None` if the second entry is zero already.
    fn of(upper: Complex64, lower: Complex64) -> Option<Self> {
        if lower == Complex64::default() {
            return None;
        }
        let square = upper.norm_sqr();
        let length = (square + lower.norm_sqr()).sqrt();
        // A phase of a zero entry is not defined, and an exchange of the two entries is the rotation then.
        if square == 0.0 {
            return Some(Self { cosine: 0.0, sine: lower.conj() / length });
        }
        let size = square.sqrt();
        Some(Self { cosine: size / length, sine: upper / size * lower.conj() / length })
    }
}

/// Returns the eigenvalue of [a b; c d] that is nearer to d (Wilkinson's shift).
fn nearer(a: Complex64, b: Complex64, c: Complex64, d: Complex64) -> Complex64 {
    let half = 0.5 * (a - d);
    let product = b * c;
    // The eigenvalues are d + half ± root. The larger of half ± root is free of cancellation, and the product of both is −b·c.
    let root = (half * half + product).sqrt();
    let far = if (half.conj() * root).re >= 0.0 { half + root } else { half - root };
    if far == Complex64::default() { d } else { d - product / far }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Matrix, eigenvalues};

    /// Returns a matrix without a pattern, from the digits of a linear congruence.
    fn some(size: usize, seed: u32) -> Matrix {
        let mut state = seed;
        Matrix::from_fn(size, size, |_, _| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 23) - 1.0
        })
    }

    /// Checks that the impulse response C·A^k·B of inputs B and outputs C is the same in the coordinates of T, which it is if Q is unitary and T = Q*AQ.
    #[test]
    fn the_eigenvalues_and_the_impulse_response_stay() {
        for size in 1..=12 {
            for seed in 0..20 {
                let (matrix, carried) = (some(size, seed), some(size, seed + 1000));
                let mut schur = Schur::default();
                schur.load(size, (1, 1), |row, column| {
                    if row == size {
                        carried[(0, column)]
                    } else if column == size {
                        carried[(row, size - 1)]
                    } else {
                        matrix[(row, column)]
                    }
                });
                assert!(schur.triangularise());
                let mut found: Vec<Complex64> = (0..size).map(|place| schur.at(place, place)).collect();
                let norm = matrix.frobenius_norm();
                // The tolerance covers backward errors of some n·ε·|A| for up to twelve rows, times condition numbers of up to 10⁴ of these matrices.
                for value in eigenvalues(&matrix) {
                    let (place, distance) = found.iter().map(|other| (other - value).norm()).enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
                    assert!(distance < 1e-9 * norm, "{size} {seed}: {value} is {distance:e} off");
                    found.swap_remove(place);
                }
                let mut state: Vec<f64> = (0..size).map(|row| carried[(row, size - 1)]).collect();
                let mut other: Vec<Complex64> = (0..size).map(|row| schur.at(row, size)).collect();
                for _ in 0..4 {
                    let seen: f64 = state.iter().enumerate().map(|(place, entry)| carried[(0, place)] * entry).sum();
                    let again: Complex64 = other.iter().enumerate().map(|(place, entry)| schur.at(size, place) * entry).sum();
                    let length = state.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
                    // The method is backward stable: n sweeps of n rotations have an error of 10⁻¹⁶ of the length each.
                    assert!((again - seen).norm() < 1e-13 * (1.0 + norm).powi(4) * (1.0 + length), "{size} {seed}: {again} for {seen}");
                    state = matrix.times_column(&state);
                    other = (0..size).map(|row| (row..size).map(|column| schur.at(row, column) * other[column]).sum()).collect();
                }
                for row in 1..size {
                    assert!((0..row).all(|column| schur.at(row, column) == Complex64::default()));
                }
            }
        }
    }

    #[test]
    fn blocks_that_are_triangular_or_zero_already_are_left_so() {
        let mut schur = Schur::default();
        schur.load(3, (0, 0), |_, _| 0.0);
        assert!(schur.triangularise());
        schur.load(3, (0, 0), |row, column| if column == row + 1 { 1.0 } else { 0.0 });
        assert!(schur.triangularise() && schur.at(0, 1).norm() > 0.9);
        schur.load(2, (0, 0), |_, _| f64::NAN);
        assert!(!schur.triangularise());
    }
}
