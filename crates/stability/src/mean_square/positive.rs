//! The spectral radius of a positive operator, between two bounds that are checked.
//!
//! L maps positive semidefinite matrices to positive semidefinite matrices. By the theorem of Krein & Rutman (1948) its spectral radius ρ is an
//! eigenvalue. Let E be positive definite and γY − L(Y) = E + R with a remainder that leaves E + R positive definite.
//!
//! - If Y is positive definite, then L(Y) < γY, and L maps the interval −Y ≤ X ≤ Y into γ' times itself for a γ' < γ: **ρ < γ**.
//! - If γ > ρ, then Y = Σ L^k(E + R)/γ^(k+1), which is positive definite. So if Y is not, **γ ≤ ρ**.
//!
//! Both are decided by looking at signs, however Y was found and however ill-conditioned the eigenvectors of L are. Y is found in the Krylov space of E,
//! which is the same for every γ: one Arnoldi factorisation answers for all of them.

use crate::{Matrix, Radius};

/// An operator on symmetric matrices, or tuples of them, that maps positive ones to positive ones. Elements are vectors of coordinates.
pub(crate) trait Positive: Sync {
    /// How many coordinates there are.
    fn unknowns(&self) -> usize;
    /// A positive definite element of norm about 1.
    fn base(&self) -> Vec<f64>;
    /// The image of an element.
    fn apply(&self, element: &[f64]) -> Vec<f64>;
    /// Whether an element is positive definite.
    fn is_definite(&self, element: &[f64]) -> bool;
    /// A bound of the rounding of `apply`, relative to the size of the element.
    fn rounding(&self) -> f64;
}

/// Both bounds within this of each other, relative to the radius, are good enough.
const GOOD: f64 = 1e-11;
/// The numbers that a Krylov space may take in memory.
const MOST_NUMBERS: usize = 1 << 26;
/// Its largest dimension.
const MOST_STEPS: usize = 400;
/// A direction that is left with less than this is nothing but rounding.
const BREAKDOWN: f64 = 1e-14;

/// The spectral radius. The error is infinite where the numbers overflow, and covers the whole interval from zero where no lower bound is found.
pub(crate) fn radius_of_positive(operator: &impl Positive) -> Radius {
    let unknowns = operator.unknowns();
    if unknowns == 0 {
        return Radius { value: 0.0, error: 0.0 };
    }
    let most = (MOST_NUMBERS / unknowns).clamp(2, MOST_STEPS).min(unknowns);
    let mut krylov = Krylov::new(operator.base());
    let mut best: Option<(f64, f64)> = None;
    let mut next = 8;
    while krylov.steps() < most {
        let going = krylov.step(operator);
        let steps = krylov.steps();
        if going && steps < next && steps < most {
            continue;
        }
        next = steps + steps / 4 + 2;
        let Some(guess) = krylov.largest_real() else {
            return Radius { value: f64::INFINITY, error: f64::INFINITY };
        };
        let (low, high) = krylov.bounds(operator, guess);
        best = Some(best.map_or((low, high), |(before_low, before_high)| (before_low.max(low), before_high.min(high))));
        if !going || best.is_some_and(|(low, high)| high - low <= 4.0 * GOOD * high) {
            break;
        }
    }
    let (low, high) = best.unwrap_or((0.0, f64::INFINITY));
    let value = if high.is_finite() { 0.5 * (low + high) } else { low };
    Radius { value, error: (high - value).max(value - low) }
}

/// An orthonormal basis of the space of E, L(E), L²(E), …, in which L is an upper Hessenberg matrix.
struct Krylov {
    base: Vec<f64>,
    norm: f64,
    basis: Vec<Vec<f64>>,
    /// The columns of the Hessenberg matrix, each with one entry more than the one before.
    columns: Vec<Vec<f64>>,
}

impl Krylov {
    fn new(base: Vec<f64>) -> Self {
        let norm = dot(&base, &base).sqrt();
        let first = base.iter().map(|entry| entry / norm).collect();
        Self { base, norm, basis: vec![first], columns: Vec::new() }
    }

    fn steps(&self) -> usize {
        self.columns.len()
    }

    /// One more dimension; answers whether there is another.
    fn step(&mut self, operator: &impl Positive) -> bool {
        let mut image = operator.apply(&self.basis[self.columns.len()]);
        let size = dot(&image, &image).sqrt();
        let mut column = vec![0.0; self.basis.len() + 1];
        // Twice is enough (Giraud, Langou & Rozložník 2005).
        for _ in 0..2 {
            for (entry, direction) in column.iter_mut().zip(&self.basis) {
                let part = dot(&image, direction);
                *entry += part;
                for (image, direction) in image.iter_mut().zip(direction) {
                    *image -= part * direction;
                }
            }
        }
        let left = dot(&image, &image).sqrt();
        let last = self.basis.len();
        let going = left > BREAKDOWN * size;
        if going {
            column[last] = left;
            image.iter_mut().for_each(|entry| *entry /= left);
            self.basis.push(image);
        }
        self.columns.push(column);
        going
    }

    /// The largest real eigenvalue of the Hessenberg matrix, which tends to the radius from what E contains of its eigenvector.
    fn largest_real(&self) -> Option<f64> {
        let size = self.columns.len();
        if self.columns.iter().flatten().any(|entry| !entry.is_finite()) {
            return None;
        }
        let matrix = faer::Mat::<f64>::from_fn(size, size, |row, column| self.columns[column].get(row).copied().unwrap_or(0.0));
        let values = matrix.eigenvalues().ok()?;
        let scale = values.iter().map(|value| libm::hypot(value.re, value.im)).fold(0.0, f64::max);
        let real = values.iter().filter(|value| value.im.abs() <= 1e-9 * scale).map(|value| value.re).fold(0.0, f64::max);
        Some(if real > 0.0 { real } else { scale })
    }

    /// The tightest bounds around a guess that can be checked in this space.
    fn bounds(&self, operator: &impl Positive, guess: f64) -> (f64, f64) {
        let mut low = 0.0;
        let mut high = f64::INFINITY;
        let mut apart = GOOD;
        while apart < 1.0 && low == 0.0 {
            if self.is_below(operator, guess * (1.0 - apart)) {
                low = guess * (1.0 - apart);
            }
            apart *= 4.0;
        }
        apart = GOOD;
        while apart < 1e3 && high == f64::INFINITY {
            // Where everything dies out within some frames, the guess is zero or rounding.
            let candidate = (guess * (1.0 + apart)).max(apart * 1e-3);
            if self.is_above(operator, candidate) {
                high = candidate;
            }
            apart *= 4.0;
        }
        (low, high)
    }

    fn is_above(&self, operator: &impl Positive, candidate: f64) -> bool {
        self.check(operator, candidate).is_some_and(|solution| operator.is_definite(&solution))
    }

    fn is_below(&self, operator: &impl Positive, candidate: f64) -> bool {
        // Against a positive definite element a positive one has a positive product. Beyond rounding.
        let negative = |solution: &Vec<f64>| {
            let size = dot(solution, solution).sqrt();
            dot(solution, &self.base) < -1e-9 * size * self.norm
        };
        self.check(operator, candidate).as_ref().is_some_and(negative)
    }

    /// A Y for which γY − L(Y) is positive definite beyond rounding, if this space has one.
    fn check(&self, operator: &impl Positive, candidate: f64) -> Option<Vec<f64>> {
        let solution = self.solve(candidate)?;
        let image = operator.apply(&solution);
        let size = dot(&solution, &solution).sqrt();
        let rounding = operator.rounding() * size;
        let mut left: Vec<f64> = solution.iter().zip(&image).map(|(solution, image)| candidate * solution - image).collect();
        // A remainder of rounding's size, times the number of its entries' root, may be hidden in each.
        if !(rounding.is_finite() && rounding < 0.5) {
            return None;
        }
        for (left, base) in left.iter_mut().zip(&self.base) {
            *left -= rounding * base;
        }
        operator.is_definite(&left).then_some(solution)
    }

    /// The combination of the basis for which γY − L(Y) − E is least: a least-squares problem with a Hessenberg matrix, by rotations.
    fn solve(&self, candidate: f64) -> Option<Vec<f64>> {
        let size = self.columns.len();
        let mut matrix = Matrix::from_fn(size + 1, size, |row, column| {
            let entry = -self.columns[column].get(row).copied().unwrap_or(0.0);
            if row == column { candidate + entry } else { entry }
        });
        let mut right = vec![0.0; size + 1];
        right[0] = self.norm;
        for place in 0..size {
            let (above, below) = (matrix[(place, place)], matrix[(place + 1, place)]);
            let length = libm::hypot(above, below);
            if !(length > 0.0 && length.is_finite()) {
                return None;
            }
            let (cosine, sine) = (above / length, below / length);
            for column in place..size {
                let (one, two) = (matrix[(place, column)], matrix[(place + 1, column)]);
                matrix[(place, column)] = cosine * one + sine * two;
                matrix[(place + 1, column)] = cosine * two - sine * one;
            }
            let (one, two) = (right[place], right[place + 1]);
            right[place] = cosine * one + sine * two;
            right[place + 1] = cosine * two - sine * one;
        }
        let mut weights = vec![0.0; size];
        for row in (0..size).rev() {
            let known: f64 = (row + 1..size).map(|column| matrix[(row, column)] * weights[column]).sum();
            weights[row] = (right[row] - known) / matrix[(row, row)];
        }
        let mut solution = vec![0.0; self.base.len()];
        for (weight, direction) in weights.iter().zip(&self.basis) {
            for (sum, entry) in solution.iter_mut().zip(direction) {
                *sum += weight * entry;
            }
        }
        Some(solution)
    }
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

/// Whether a symmetric matrix is positive definite: whether Cholesky's factorisation exists.
pub(crate) fn is_definite(mut matrix: Matrix) -> bool {
    let size = matrix.rows();
    for pivot in 0..size {
        let head = matrix[(pivot, pivot)];
        if !(head > 0.0 && head.is_finite()) {
            return false;
        }
        for row in pivot + 1..size {
            let factor = matrix[(row, pivot)] / head;
            for column in pivot + 1..=row {
                let entry = factor * matrix[(column, pivot)];
                matrix[(row, column)] -= entry;
            }
        }
    }
    true
}

/// The lower half of a symmetric matrix, row by row, appended.
pub(crate) fn pack(matrix: &Matrix, into: &mut Vec<f64>) {
    for row in 0..matrix.rows() {
        into.extend_from_slice(&matrix.row(row)[..=row]);
    }
}

/// The symmetric matrix of a lower half, and what follows it.
pub(crate) fn unpack(size: usize, from: &[f64]) -> (Matrix, &[f64]) {
    let mut matrix = Matrix::zeros(size, size);
    let mut rest = from;
    for row in 0..size {
        let (entries, after) = rest.split_at(row + 1);
        rest = after;
        for (column, entry) in entries.iter().enumerate() {
            matrix[(row, column)] = *entry;
            matrix[(column, row)] = *entry;
        }
    }
    (matrix, rest)
}
