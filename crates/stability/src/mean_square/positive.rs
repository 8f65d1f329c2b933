//! The spectral radius of a positive operator, between two bounds that are checked.
//!
//! L maps positive semidefinite matrices to positive semidefinite matrices. By the theorem of Krein & Rutman (1948) its spectral radius ρ is an
//! eigenvalue. Let Y be such that γY − L(Y) is positive definite.
//!
//! - If Y is positive definite, then L(Y) < γY, and L maps the interval −Y ≤ X ≤ Y into γ' times itself for a γ' < γ: **ρ < γ**.
//! - If γ > ρ, then Y = Σ L^k(γY − L(Y))/γ^(k+1), which is positive definite. So if Y is not, **γ ≤ ρ**.
//!
//! Both are decided by looking at signs, however Y was found and however ill-conditioned the eigenvectors of L are. Y is found as the Y for which
//! γY − L(Y) is nearest to a fixed positive definite E, in the Krylov space of E, which is the same for every γ: one Arnoldi factorisation answers for all.
//!
//! # Rounding
//!
//! A computation of sums, products and constants changes each of its terms by at most as many roundings as the term goes through. If these are at most K
//! (`roundings`) and S are the sizes of the terms of each entry, added up (`sizes`), then the computed image is within γ_K·S of the exact image (Higham 2002,
//! Section 3.1). That γY − L(Y) is positive definite whatever these errors are is shown by Cholesky's factorisation with Rump's criterion
//! (`definite`). That Y is not is shown by an entry of its diagonal below zero, with no rounding at all. So the bounds hold for the operator with
//! the coefficients as stored, and as far as the errors of these are counted among the roundings for the exact one; numbers that underflow are not counted.

use crate::definite::is_positive;
use crate::rounding::{gamma, outward};
use crate::{Matrix, Radius, Watch};

/// An operator on symmetric matrices, or tuples of them, that maps positive ones to positive ones. Elements are vectors of coordinates.
pub trait Positive: Sync {
    /// How many coordinates there are.
    fn unknowns(&self) -> usize;
    /// A positive definite element of norm about 1.
    fn base(&self) -> Vec<f64>;
    /// The image of an element.
    fn apply(&self, element: &[f64]) -> Vec<f64>;
    /// The image of an element without signs if no coefficient had a sign: for each coordinate, the terms that [`apply`](Self::apply) adds up.
    fn sizes(&self, element: &[f64]) -> Vec<f64>;
    /// How many roundings a term of `apply` goes through at most, those of the coefficients included.
    fn roundings(&self) -> usize;
    /// The symmetric matrices that are all positive definite if and only if an element is.
    fn matrices(&self, element: &[f64]) -> Vec<Matrix>;
}

/// Both bounds within this of each other, relative to the radius, are good enough.
const GOOD: f64 = 1e-11;
/// Where the bounds are first looked for, relative to the radius.
const NEAREST: f64 = 1e-12;
/// How much farther each time.
const FARTHER: f64 = 2.0;
/// The guess is settled if it changed by no more than this, relative, since it was last looked at.
const SETTLED: f64 = 1e-12;
/// The numbers that a Krylov space may take in memory.
const MOST_NUMBERS: usize = 1 << 26;
/// Its largest dimension.
const MOST_STEPS: usize = 400;
/// A direction that is left with less than this is nothing but rounding.
const BREAKDOWN: f64 = 1e-14;

/// The spectral radius. The error covers the whole interval from zero where no lower bound is found. Where numbers overflow, the operator is divided by a
/// power of two, which is exact; where that does not help either, nothing is known.
///
/// One image takes a number of `operations`; `None` if the watch ends it.
pub fn radius_watched(operator: &impl Positive, operations: f64, watch: &dyn Watch) -> Option<Radius> {
    let watched = Images { operator, factor: 1.0, operations, watch };
    match within_range(&watched, watch) {
        Ok(radius) => Some(radius),
        Err(Ended::Stopped) => None,
        Err(Ended::Overflow) => {
            let largest = operator.apply(&operator.base()).into_iter().fold(1.0_f64, |largest, entry| largest.max(entry.abs()));
            // The sizes may be larger than the entries; and no number is larger than 2^1024.
            let exponent = (libm::log2(largest).ceil() + 64.0).min(1000.0);
            match within_range(&Images { factor: libm::exp2(-exponent), ..watched }, watch) {
                Ok(radius) => Some(radius.scaled(libm::exp2(exponent))),
                Err(Ended::Stopped) => None,
                Err(Ended::Overflow) => Some(Radius::UNKNOWN),
            }
        }
    }
}

/// γ as it is chosen for a spectral radius, nearly that of the operator, and some Y for which γY − L(Y) is nearly the base; whether it is has to be checked.
pub fn solution(operator: &impl Positive, gamma: impl Fn(f64) -> f64) -> Option<(f64, Vec<f64>)> {
    let mut krylov = Krylov::new(operator.base());
    let most = MOST_STEPS.min(operator.unknowns());
    let mut next = 8;
    loop {
        let going = krylov.steps() < most && krylov.step(operator);
        if going && krylov.steps() < next {
            continue;
        }
        next = krylov.steps() + krylov.steps() / 4 + 2;
        let gamma = gamma(krylov.largest_real()?);
        let (solution, left) = krylov.solve(gamma)?;
        if !going || left <= NEARLY * krylov.norm {
            return Some((gamma, solution));
        }
    }
}

/// Whether γY − L(Y) is positive definite whatever was rounded.
pub fn leaves_less(operator: &impl Positive, factor: f64, solution: &[f64]) -> bool {
    let image = operator.apply(solution);
    let left: Vec<f64> = solution.iter().zip(&image).map(|(solution, image)| factor * solution - image).collect();
    let absolute: Vec<f64> = solution.iter().map(|entry| entry.abs()).collect();
    // The product with γ and the difference round too; the sizes were computed with as many roundings.
    let share = gamma(operator.roundings() + 2);
    let sizes = operator.sizes(&absolute);
    let error: Vec<f64> = absolute.iter().zip(&sizes).map(|(entry, size)| outward(share * (1.0 + share) * (factor * entry + size))).collect();
    let (left, error) = (operator.matrices(&left), operator.matrices(&error));
    left.iter().zip(&error).all(|(left, error)| is_positive(left, error))
}

/// As near as this to the base, relative to it, is near enough for a solution that is checked over a box.
const NEARLY: f64 = 1e-6;

/// Why there is no radius.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Ended {
    /// Numbers overflowed.
    Overflow,
    /// The watcher ended it.
    Stopped,
}

/// An operator times a power of two, each image of which is shown to the watcher.
struct Images<'a, O> {
    operator: &'a O,
    factor: f64,
    operations: f64,
    watch: &'a dyn Watch,
}

impl<O> Images<'_, O> {
    fn seen(&self, image: Vec<f64>) -> Vec<f64> {
        self.watch.done(self.operations);
        // A product with 1 changes nothing.
        image.into_iter().map(|entry| self.factor * entry).collect()
    }
}

impl<O: Positive> Positive for Images<'_, O> {
    fn unknowns(&self) -> usize {
        self.operator.unknowns()
    }

    fn base(&self) -> Vec<f64> {
        self.operator.base()
    }

    fn apply(&self, element: &[f64]) -> Vec<f64> {
        self.seen(self.operator.apply(element))
    }

    fn sizes(&self, element: &[f64]) -> Vec<f64> {
        self.seen(self.operator.sizes(element))
    }

    fn roundings(&self) -> usize {
        self.operator.roundings()
    }

    fn matrices(&self, element: &[f64]) -> Vec<Matrix> {
        self.operator.matrices(element)
    }
}

/// The spectral radius, as far as numbers go.
fn within_range(operator: &impl Positive, watch: &dyn Watch) -> Result<Radius, Ended> {
    let unknowns = operator.unknowns();
    if unknowns == 0 {
        return Ok(Radius { value: 0.0, error: 0.0 });
    }
    let most = (MOST_NUMBERS / unknowns).clamp(2, MOST_STEPS).min(unknowns);
    let mut krylov = Krylov::new(operator.base());
    let (mut low, mut high) = (0.0_f64, f64::INFINITY);
    let mut next = 8;
    let mut before = f64::NAN;
    while krylov.steps() < most {
        if watch.stops() {
            return Err(Ended::Stopped);
        }
        let going = krylov.step(operator);
        let steps = krylov.steps();
        let last = !going || steps == most;
        if steps < next && !last {
            continue;
        }
        next = steps + steps / 4 + 2;
        let guess = krylov.largest_real().ok_or(Ended::Overflow)?;
        let settled = (guess - before).abs() <= SETTLED * guess;
        before = guess;
        if !(settled || last) {
            continue;
        }
        let width = high - low;
        let (below, above) = krylov.bounds(operator, guess, watch).ok_or(Ended::Stopped)?;
        (low, high) = (low.max(below), high.min(above));
        // Where rounding sets the limit a larger space does not help.
        let no_better = width.is_finite() && high - low > 0.5 * width;
        if last || no_better || high - low <= GOOD * high {
            break;
        }
    }
    if !high.is_finite() {
        return Ok(Radius::at_least(low));
    }
    let value = 0.5 * (low + high);
    // The middle of the two rounds.
    Ok(Radius { value, error: outward((high - value).max(value - low)) + f64::EPSILON * value })
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
        let values = crate::eigenvalues(&Matrix::from_fn(size, size, |row, column| self.columns[column].get(row).copied().unwrap_or(0.0)));
        // The iteration has not converged.
        if values.iter().any(|value| value.is_nan()) {
            return None;
        }
        let scale = values.iter().map(|value| libm::hypot(value.re, value.im)).fold(0.0, f64::max);
        let real = values.iter().filter(|value| value.im.abs() <= 1e-9 * scale).map(|value| value.re).fold(0.0, f64::max);
        Some(if real > 0.0 { real } else { scale })
    }

    /// The tightest bounds around a guess that can be checked in this space; `None` if the watcher ends it.
    fn bounds(&self, operator: &impl Positive, guess: f64, watch: &dyn Watch) -> Option<(f64, f64)> {
        let mut low = 0.0;
        let mut apart = NEAREST;
        while apart < 1.0 && low == 0.0 {
            if watch.stops() {
                return None;
            }
            let candidate = guess * (1.0 - apart);
            if self.check(operator, candidate, &is_indefinite) {
                low = candidate;
            }
            apart *= FARTHER;
        }
        let mut high = f64::INFINITY;
        apart = NEAREST;
        while apart < 1e3 && high == f64::INFINITY {
            if watch.stops() {
                return None;
            }
            // Where everything dies out within some frames, the guess is zero or rounding.
            let candidate = (guess * (1.0 + apart)).max(apart * 1e-3);
            if self.check(operator, candidate, &is_definite) {
                high = candidate;
            }
            apart *= FARTHER;
        }
        Some((low, high))
    }

    /// Whether this space has a Y of that kind for which γY − L(Y) is positive definite whatever was rounded.
    fn check(&self, operator: &impl Positive, candidate: f64, kind: &dyn Fn(&[Matrix]) -> bool) -> bool {
        let Some((solution, _)) = self.solve(candidate) else {
            return false;
        };
        kind(&operator.matrices(&solution)) && leaves_less(operator, candidate, &solution)
    }

    /// The combination of the basis for which γY − L(Y) − E is least, and how large that is: a least-squares problem with a Hessenberg matrix, by rotations.
    fn solve(&self, candidate: f64) -> Option<(Vec<f64>, f64)> {
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
        let left = right[size].abs();
        let mut solution = vec![0.0; self.base.len()];
        for (weight, direction) in weights.iter().zip(&self.basis) {
            for (sum, entry) in solution.iter_mut().zip(direction) {
                *sum += weight * entry;
            }
        }
        Some((solution, left))
    }
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

/// Returns whether all matrices are shown to be positive definite.
#[must_use]
pub fn is_definite(matrices: &[Matrix]) -> bool {
    matrices.iter().all(|matrix| is_positive(matrix, &Matrix::zeros(matrix.rows(), matrix.columns())))
}

/// Whether a diagonal has an entry below zero: eᵀYe < 0.
pub fn is_indefinite(matrices: &[Matrix]) -> bool {
    matrices.iter().any(|matrix| (0..matrix.rows()).any(|place| matrix[(place, place)] < 0.0))
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
