//! The complex Schur form, and the sensitivity of its diagonal blocks to a perturbation: bounds of the resolvent for the enclosure of the radius.

use num_complex::Complex64;

use super::francis::pair;
use super::square::Square;
use crate::rounding::real;

/// A generous bound of the relative rounding error of one complex product, sum or quotient: a product has √5 half-units (Brent, Percival & Zimmermann 2007),
/// a quotient about twice as much (Higham 2002, Lemma 3.5).
const COMPLEX_ROUNDING: f64 = 4.0 * f64::EPSILON;

/// An upper triangular matrix T, divided into diagonal blocks T_c.
///
/// With X_c and W_c that solve the Sylvester equations of Golub & Van Loan (2013), Section 7.6.3, its resolvent is exactly
///
/// ```text
/// (z − T)⁻¹ = Σ_c [X_c; 1; 0]·(z − T_c)⁻¹·[0, 1, W_c]
/// ```
///
/// so that |(z − T)⁻¹| ≤ Σ_c π_c·|(z − T_c)⁻¹| with π_c = √(1 + |X_c|²)·√(1 + |W_c|²). For a block of one, π_c is the eigenvalue's condition number
/// 1/|yᴴx|.
#[derive(Clone, Debug, Default)]
pub(super) struct Triangle {
    size: usize,
    entries: Vec<Complex64>,
    /// First row of each block, and the size of the matrix as the last entry.
    pub(super) starts: Vec<usize>,
    /// π_c, rounded upward, indexed by block.
    pub(super) amplification: Vec<f64>,
    /// Solutions of the Sylvester equations of the block at hand: X_c with one row for each column of the block, W_c in the rows and columns of T.
    solution: Vec<Complex64>,
    /// Bounds of the rounding errors of `solution`.
    doubt: Vec<f64>,
    /// Bounds of row or column sums within the block at hand.
    column: Vec<f64>,
    /// Moduli of the entries within blocks of more than one row, row by row; entries elsewhere have no meaning.
    moduli: Vec<f64>,
    /// |Re| + |Im| of every entry of the matrix, row by row.
    weights: Vec<f64>,
    /// |Re| + |Im| of every entry of `solution`.
    solved: Vec<f64>,
}

impl Triangle {
    /// Loads the triangular form that is unitarily similar to the quasi-triangular matrix `quasi`, with a block for each row.
    pub(super) fn load<S: Square>(&mut self, quasi: &S) {
        let size = quasi.size();
        self.size = size;
        self.entries.clear();
        for row in 0..size {
            for column in 0..size {
                let zero = column + 1 < row;
                self.entries.push(Complex64::new(if zero { 0.0 } else { quasi.at(row, column) }, 0.0));
            }
        }
        for row in 1..size {
            let top = row - 1;
            let below = quasi.at(row, top);
            if below != 0.0 {
                let (a, b, d) = (quasi.at(top, top), quasi.at(top, row), quasi.at(row, row));
                let [first, second] = pair(a, b, below, d);
                // Both rows of the block give an eigenvector of `first`; the longer vector has lost fewer digits.
                let (from_top, from_below) = ((Complex64::from(b), first - a), (first - d, Complex64::from(below)));
                let longer =
                    if from_top.0.l1_norm() + from_top.1.l1_norm() > from_below.0.l1_norm() + from_below.1.l1_norm() { from_top } else { from_below };
                self.rotate(top, longer.0, longer.1);
                self.entries[top * size + top] = first;
                self.entries[row * size + row] = second;
                self.entries[row * size + top] = Complex64::default();
            }
        }
        self.starts.clear();
        self.starts.extend(0..=size);
    }

    /// Applies the unitary similarity transform of the rows and columns `top`, `top + 1` whose first column is along (p, q).
    fn rotate(&mut self, top: usize, p: Complex64, q: Complex64) {
        let size = self.size;
        let length = (p.norm_sqr() + q.norm_sqr()).sqrt();
        if length == 0.0 {
            return;
        }
        let (p, q) = (p / length, q / length);
        for column in 0..size {
            let (a, b) = (self.entries[top * size + column], self.entries[(top + 1) * size + column]);
            self.entries[top * size + column] = p.conj() * a + q.conj() * b;
            self.entries[(top + 1) * size + column] = p * b - q * a;
        }
        for row in 0..size {
            let (a, b) = (self.entries[row * size + top], self.entries[row * size + top + 1]);
            self.entries[row * size + top] = a * p + b * q;
            self.entries[row * size + top + 1] = b * p.conj() - a * q.conj();
        }
    }

    pub(super) fn size(&self) -> usize {
        self.size
    }

    #[inline]
    pub(super) fn at(&self, row: usize, column: usize) -> Complex64 {
        self.entries[row * self.size + column]
    }

    #[inline]
    pub(super) fn eigenvalue(&self, place: usize) -> Complex64 {
        self.at(place, place)
    }

    /// Returns the number of the block that the eigenvalue at `place` on the diagonal belongs to.
    pub(super) fn block_of(&self, place: usize) -> usize {
        self.starts.partition_point(|start| *start <= place) - 1
    }

    /// Reorders the diagonal so that eigenvalues with the same label stand together, and makes each group of one label a block (Golub & Van Loan 2013,
    /// Section 7.6.2: exchanges by rotations). `labels` has one label for each place on the diagonal and is reordered along with the eigenvalues.
    pub(super) fn gather(&mut self, labels: &mut [usize]) {
        let size = self.size;
        self.starts.clear();
        let mut place = 0;
        while place < size {
            self.starts.push(place);
            let label = labels[place];
            place += 1;
            while let Some(offset) = labels[place..].iter().position(|other| *other == label) {
                for upper in (place..place + offset).rev() {
                    let (first, second) = (self.eigenvalue(upper), self.eigenvalue(upper + 1));
                    self.rotate(upper, self.at(upper, upper + 1), second - first);
                    self.entries[upper * size + upper] = second;
                    self.entries[(upper + 1) * size + upper + 1] = first;
                    self.entries[(upper + 1) * size + upper] = Complex64::default();
                    labels.swap(upper, upper + 1);
                }
                place += 1;
            }
        }
        self.starts.push(size);
    }

    /// Computes π_c of every block; infinite if an eigenvalue of the block equals an eigenvalue of another block.
    ///
    /// The triangular solves carry a running bound of their rounding error (Higham 2002, Section 8.2), so that π_c is not too small.
    pub(super) fn amplify(&mut self) {
        let size = self.size;
        self.amplification.clear();
        self.solution.resize(size * size, Complex64::default());
        self.doubt.resize(size * size, 0.0);
        self.column.resize(size, 0.0);
        self.weights.clear();
        self.weights.extend(self.entries.iter().map(Complex64::l1_norm));
        self.solved.resize(size * size, 0.0);
        self.moduli.resize(size * size, 0.0);
        for block in self.starts.windows(2).filter(|block| block[1] - block[0] > 1) {
            for row in block[0]..block[1] {
                for column in row + 1..block[1] {
                    self.moduli[row * size + column] = self.entries[row * size + column].norm_sqr().sqrt();
                }
            }
        }
        for block in 0..self.starts.len() - 1 {
            let (start, end) = (self.starts[block], self.starts[block + 1]);
            let right = self.right(start, end);
            let left = self.left(start, end);
            // NaN arises from 0·∞ if eigenvalues of different blocks coincide.
            let product = ((1.0 + right) * (1.0 + left)).sqrt() * (1.0 + 1e-12);
            self.amplification.push(if product.is_nan() { f64::INFINITY } else { product });
        }
    }

    /// Returns |X_c|² of the block `start..end`. Solves (T₁₁ − t_qq)·X_q = Σ_{p<q} X_p·t_pq − T_1q, column by column, from the bottom row up.
    fn right(&mut self, start: usize, end: usize) -> f64 {
        let size = self.size;
        let mut sum = 0.0;
        for q in start..end {
            for row in (0..start).rev() {
                let (mut value, mut carried, mut magnitude) = (-self.at(row, q), 0.0, self.weights[row * size + q]);
                // Terms of T₁₁ right of the diagonal are subtracted. Column q of the solution is stored as row q, so that both slices are contiguous.
                let (beyond, column) = (row * size + row + 1..row * size + start, q * size + row + 1..q * size + start);
                let known = self.solution[column.clone()].iter().zip(&self.doubt[column.clone()]).zip(&self.solved[column]);
                for ((entry, weight), ((known, doubt), size)) in self.entries[beyond.clone()].iter().zip(&self.weights[beyond]).zip(known) {
                    value -= known * entry;
                    carried += doubt * weight;
                    magnitude += size * weight;
                }
                // Terms of earlier columns of the block are added.
                for p in start..q {
                    let weight = self.weights[p * size + q];
                    value += self.solution[p * size + row] * self.at(p, q);
                    carried += self.doubt[p * size + row] * weight;
                    magnitude += self.solved[p * size + row] * weight;
                }
                sum += self.divide(q * size + row, value, carried, magnitude, self.at(row, row) - self.at(q, q));
            }
        }
        sum
    }

    /// Returns |W_c|² of the block `start..end`. Solves W_pj·(t_jj − t_pp) = T_pj + Σ_{r>p} t_pr·W_rj − Σ_{i<j} W_pi·t_ij, from the last row of the block up
    /// and from left to right.
    fn left(&mut self, start: usize, end: usize) -> f64 {
        let size = self.size;
        let mut sum = 0.0;
        for p in (start..end).rev() {
            for column in end..size {
                let (mut value, mut carried, mut magnitude) = (self.at(p, column), 0.0, self.weights[p * size + column]);
                // Terms within the block are added, terms after the block are subtracted.
                for i in p + 1..end {
                    let (entry, weight) = (self.at(p, i), self.weights[p * size + i]);
                    value += self.solution[i * size + column] * entry;
                    carried += self.doubt[i * size + column] * weight;
                    magnitude += self.solved[i * size + column] * weight;
                }
                for i in end..column {
                    let (entry, weight) = (self.at(i, column), self.weights[i * size + column]);
                    value -= self.solution[p * size + i] * entry;
                    carried += self.doubt[p * size + i] * weight;
                    magnitude += self.solved[p * size + i] * weight;
                }
                sum += self.divide(p * size + column, value, carried, magnitude, self.at(column, column) - self.at(p, p));
            }
        }
        sum
    }

    /// Stores the quotient value/difference at `place` with the bound of its error, and returns the square of the largest modulus that the exact quotient can
    /// have. `carried` is the error of earlier solutions in `value`, `magnitude` the sum of the sizes of its terms.
    #[inline]
    fn divide(&mut self, place: usize, value: Complex64, carried: f64, magnitude: f64, difference: Complex64) -> f64 {
        let scale = 1.0 / difference.norm_sqr();
        let quotient = value * difference.conj() * scale;
        let terms = real(self.size);
        let doubt = (carried + terms * COMPLEX_ROUNDING * magnitude) * scale.sqrt() + COMPLEX_ROUNDING * quotient.l1_norm();
        self.solution[place] = quotient;
        self.doubt[place] = doubt;
        self.solved[place] = quotient.l1_norm();
        let size = quotient.norm_sqr().sqrt() + doubt;
        size * size
    }

    /// Returns whether a bound of |(z − T)⁻¹| is below `limit` for every z whose distance to each eigenvalue is at least the entry of `distances` at its place.
    /// False also means that the bound cannot tell.
    ///
    /// Within a block, the inverse of a triangular matrix is at most, entry by entry, that of its comparison matrix (Higham 2002, Theorem 8.12), and
    /// |·|₂² ≤ |·|₁·|·|∞. This refines Henrici's bound Σ ν^j/d^(j+1) (1962), which uses only the norm ν of the strict triangle.
    pub(super) fn resolvent_below(&mut self, distances: &[f64], limit: f64) -> bool {
        if distances.iter().any(|distance| *distance <= 0.0) {
            return false;
        }
        let limit = limit * (1.0 - 1e-12);
        let blocks = 0..self.amplification.len();
        let single = |starts: &[usize], block: usize| starts[block + 1] - starts[block] == 1;
        // Blocks of one row are cheap and come first: often their sum alone reaches the limit.
        let mut total = 0.0;
        for block in blocks.clone().filter(|block| single(&self.starts, *block)) {
            total += self.amplification[block] / distances[self.starts[block]];
        }
        for block in blocks {
            if total.is_nan() || total >= limit {
                return false;
            }
            if !single(&self.starts, block) {
                total += self.amplification[block] * self.block_resolvent(self.starts[block], self.starts[block + 1], distances);
            }
        }
        total < limit
    }

    fn block_resolvent(&mut self, start: usize, end: usize, distances: &[f64]) -> f64 {
        let size = self.size;
        let (mut rows, mut columns) = (0.0_f64, 0.0_f64);
        for row in (start..end).rev() {
            let beyond = self.moduli[row * size + row + 1..row * size + end].iter().zip(&self.column[row + 1..end]);
            self.column[row] = (1.0 + beyond.map(|(entry, bound)| entry * bound).sum::<f64>()) / distances[row];
            rows = rows.max(self.column[row]);
        }
        // Sums of the columns: the share of each row is added to all later columns at once, along the row.
        self.column[start..end].fill(1.0);
        for (column, distance) in distances.iter().enumerate().take(end).skip(start) {
            let bound = self.column[column] / distance;
            columns = columns.max(bound);
            let beyond = self.moduli[column * size + column + 1..column * size + end].iter().zip(&mut self.column[column + 1..end]);
            for (entry, sum) in beyond {
                *sum += entry * bound;
            }
        }
        rows.sqrt() * columns.sqrt()
    }
}
