//! The complex Schur form, and how strongly its parts react to a change.

use num_complex::Complex64;

use super::francis::pair;
use super::square::Square;
use crate::rounding::real;

/// The relative rounding error of one complex product, sum or quotient, generously: √5 half-units for a product (Brent, Percival & Zimmermann 2007),
/// about twice that for a quotient (Higham 2002, Lemma 3.5).
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
    /// First rows of the blocks, and the size at the end.
    pub(super) starts: Vec<usize>,
    /// π_c, rounded upward.
    pub(super) amplification: Vec<f64>,
    solution: Vec<Complex64>,
    doubt: Vec<f64>,
    column: Vec<f64>,
    /// Sizes of the entries within blocks of more than one row.
    moduli: Vec<f64>,
    /// |Re| + |Im| of every entry, and of what has been solved for.
    weights: Vec<f64>,
    solved: Vec<f64>,
}

impl Triangle {
    /// The triangular form that is unitarily similar to a quasi-triangular one.
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
                // The eigenvector of `first`, from the row that gives the longer one.
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

    /// The unitary similarity transform of rows and columns `top`, `top + 1` whose first column is along (p, q).
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

    /// The block that an eigenvalue belongs to.
    pub(super) fn block_of(&self, place: usize) -> usize {
        self.starts.partition_point(|start| *start <= place) - 1
    }

    /// Reorders the diagonal so that eigenvalues with the same label stand together, and makes each such group a block (Golub & Van Loan 2013,
    /// Section 7.6.2: exchanges by rotations). `labels` is reordered along.
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

    /// Fills in π_c of every block, infinite where an eigenvalue of one block equals one of another.
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
            // NaN arises from 0·∞ where eigenvalues coincide.
            let product = ((1.0 + right) * (1.0 + left)).sqrt() * (1.0 + 1e-12);
            self.amplification.push(if product.is_nan() { f64::INFINITY } else { product });
        }
    }

    /// |X_c|²: (T₁₁ − t_qq)·X_q = Σ_{p<q} X_p·t_pq − T_1q, column by column, from the bottom row up.
    fn right(&mut self, start: usize, end: usize) -> f64 {
        let size = self.size;
        let mut sum = 0.0;
        for q in start..end {
            for row in (0..start).rev() {
                let (mut value, mut carried, mut magnitude) = (-self.at(row, q), 0.0, self.weights[row * size + q]);
                // Rows of T₁₁ to the right of this one with a minus; the solution in this column is kept in a row of its own.
                let (beyond, column) = (row * size + row + 1..row * size + start, q * size + row + 1..q * size + start);
                let known = self.solution[column.clone()].iter().zip(&self.doubt[column.clone()]).zip(&self.solved[column]);
                for ((entry, weight), ((known, doubt), size)) in self.entries[beyond.clone()].iter().zip(&self.weights[beyond]).zip(known) {
                    value -= known * entry;
                    carried += doubt * weight;
                    magnitude += size * weight;
                }
                // Earlier columns of the block with a plus.
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

    /// |W_c|²: W_pj·(t_jj − t_pp) = T_pj + Σ_{r>p} t_pr·W_rj − Σ_{i<j} W_pi·t_ij, from the last row of the block up, from left to right.
    fn left(&mut self, start: usize, end: usize) -> f64 {
        let size = self.size;
        let mut sum = 0.0;
        for p in (start..end).rev() {
            for column in end..size {
                let (mut value, mut carried, mut magnitude) = (self.at(p, column), 0.0, self.weights[p * size + column]);
                // Of the block itself with a plus, beyond it with a minus.
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

    /// Stores value/difference at `place` with the bound of its error, and gives the square of the largest size it may have.
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

    /// Whether |(z − T)⁻¹| is below `limit` for every z whose distance to each eigenvalue is at least the given one, as far as a bound of it can tell.
    ///
    /// Within a block, the inverse of a triangular matrix is at most, entry by entry, that of its comparison matrix (Higham 2002, Theorem 8.12), and
    /// |·|₂² ≤ |·|₁·|·|∞. It is a refinement of Henrici's bound Σ ν^j/d^(j+1) (1962), which uses only the norm ν of the strict triangle.
    pub(super) fn resolvent_below(&mut self, distances: &[f64], limit: f64) -> bool {
        if distances.iter().any(|distance| *distance <= 0.0) {
            return false;
        }
        let limit = limit * (1.0 - 1e-12);
        let blocks = 0..self.amplification.len();
        let single = |starts: &[usize], block: usize| starts[block + 1] - starts[block] == 1;
        // The cheap part first: it often is too much alone.
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
        // The same of the columns; a row's share is added to all columns beyond it at once.
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
