//! Spectral radius of a positive operator, enclosed by two checked bounds.
//!
//! L maps positive semidefinite matrices to positive semidefinite matrices. By the theorem of Krein & Rutman (1948) its spectral radius ρ is an
//! eigenvalue. Let Y be a matrix with γY − L(Y) positive definite.
//!
//! - If Y is positive definite, then L(Y) < γY, and L maps the interval −Y ≤ X ≤ Y into γ' times itself for a γ' < γ: **ρ < γ**.
//! - If γ > ρ, then Y = Σ L^k(γY − L(Y))/γ^(k+1) is positive definite. So if Y is not positive definite, **γ ≤ ρ**.
//!
//! Both bounds are decided by signs alone, whatever the origin of Y and the condition of the eigenvectors of L. In the Krylov space of a fixed positive
//! definite E, Y is the element with γY − L(Y) nearest to E. The space is the same for every γ, so one Arnoldi factorisation serves all γ.
//!
//! # Rounding
//!
//! A computation of sums, products and constants changes each of its terms by at most as many roundings as the term goes through. If at most K
//! (`roundings`) roundings change a term, and S are the sizes of the terms of each entry, added up (`sizes`), then the computed image is within γ_K·S of the
//! exact image (Higham 2002, Section 3.1). Cholesky's factorisation with Rump's criterion (`definite`) shows that γY − L(Y) is positive definite despite these
//! errors. A diagonal entry of Y below zero shows, without any rounding, that Y is not positive definite. So the bounds hold for the operator with the
//! coefficients as stored. The bounds hold for the exact operator as far as the errors of the coefficients are counted among the roundings. Numbers that
//! underflow are not counted.

use crate::definite::is_positive;
use crate::rounding::{gamma, outward};
use crate::{Matrix, Radius, Watch};

/// Linear operator on symmetric matrices, or on tuples of symmetric matrices, with positive semidefinite images of positive semidefinite elements.
/// An element is given by its vector of coordinates.
pub trait Positive: Sync {
    /// Returns the number of coordinates of an element.
    fn unknowns(&self) -> usize;
    /// Returns a positive definite element, the start of the Krylov space.
    fn base(&self) -> Vec<f64>;
    /// Returns the image of an element.
    fn apply(&self, element: &[f64]) -> Vec<f64>;
    /// Returns, for each coordinate, the sum of the absolute values of the terms of [`apply`](Self::apply). `element` has no negative coordinate.
    fn sizes(&self, element: &[f64]) -> Vec<f64>;
    /// Returns an upper bound of the number of roundings of a term of `apply`, the roundings of the coefficients included.
    fn roundings(&self) -> usize;
    /// Returns symmetric matrices. All are positive definite if and only if the element is positive definite.
    fn matrices(&self, element: &[f64]) -> Vec<Matrix>;
}

/// Distance of both bounds, relative to the upper one, at which the search ends.
const GOOD: f64 = 1e-11;
/// Distance of the first candidate for a bound from the guess, relative to the guess.
const NEAREST: f64 = 1e-12;
/// Factor by which the distance of the next candidate grows if a candidate is no bound.
const FARTHER: f64 = 2.0;
/// Largest relative change of a settled guess since the previous look at the guess.
const SETTLED: f64 = 1e-12;
/// Largest number of `f64` in the basis of a Krylov space.
const MOST_NUMBERS: usize = 1 << 26;
/// Largest dimension of a Krylov space.
const MOST_STEPS: usize = 400;
/// Share of an image's norm below which the part outside the Krylov space counts as rounding.
const BREAKDOWN: f64 = 1e-14;

/// Returns the spectral radius with its error; `None` if the watcher ends the computation. One image takes `operations` operations.
///
/// If no lower bound is found, the error covers the whole interval from zero. If numbers overflow, the operator is divided by a power of two, without rounding.
/// If numbers overflow even then, the result has an infinite error.
pub fn radius_watched(operator: &impl Positive, operations: f64, watch: &dyn Watch) -> Option<Radius> {
    let watched = Images { operator, factor: 1.0, operations, watch };
    match within_range(&watched, watch) {
        Ok(radius) => Some(radius),
        Err(Ended::Stopped) => None,
        Err(Ended::Overflow) => {
            let largest = operator.apply(&operator.base()).into_iter().fold(1.0_f64, |largest, entry| largest.max(entry.abs()));
            // The sizes of terms may be larger than the entries, hence 64 more. The exponent stays at most 1000, so that the factor is not subnormal.
            let exponent = (libm::log2(largest).ceil() + 64.0).min(1000.0);
            match within_range(&Images { factor: libm::exp2(-exponent), ..watched }, watch) {
                Ok(radius) => Some(radius.scaled(libm::exp2(exponent))),
                Err(Ended::Stopped) => None,
                Err(Ended::Overflow) => Some(Radius::UNKNOWN),
            }
        }
    }
}

/// Returns γ and a Y with γY − L(Y) near the base. The function `gamma` chooses γ for an estimate of the spectral radius. The result is not proven:
/// the caller must check that γY − L(Y) is positive definite. `None` if numbers overflow.
pub fn solution(operator: &impl Positive, gamma: impl Fn(f64) -> f64) -> Option<(f64, Vec<f64>)> {
    let mut krylov = Krylov::new(operator.base());
    let most = MOST_STEPS.min(operator.unknowns());
    let mut next = 8;
    loop {
        let going = krylov.steps() < most && krylov.step(operator);
        if going && krylov.steps() < next {
            continue;
        }
        // An estimate of the radius costs the eigenvalues of the Hessenberg matrix. The distances between estimates grow with the space.
        next = krylov.steps() + krylov.steps() / 4 + 2;
        let gamma = gamma(krylov.largest_real()?);
        let (solution, left) = krylov.solve(gamma)?;
        if !going || left <= NEARLY * krylov.norm {
            return Some((gamma, solution));
        }
    }
}

/// Returns whether γY − L(Y) is shown to be positive definite despite all rounding errors, with γ = `factor` and Y = `solution`.
pub fn leaves_less(operator: &impl Positive, factor: f64, solution: &[f64]) -> bool {
    // γY − L(Y) is computed with rounding. A bound of the error of each entry goes with the difference, and the criterion takes the error into account.
    let image = operator.apply(solution);
    let left: Vec<f64> = solution.iter().zip(&image).map(|(solution, image)| factor * solution - image).collect();
    let absolute: Vec<f64> = solution.iter().map(|entry| entry.abs()).collect();
    // Two more roundings for the product with γ and for the difference. The sizes themselves are rounded as often, hence the factor 1 + share.
    let share = gamma(operator.roundings() + 2);
    let sizes = operator.sizes(&absolute);
    let error: Vec<f64> = absolute.iter().zip(&sizes).map(|(entry, size)| outward(share * (1.0 + share) * (factor * entry + size))).collect();
    let (left, error) = (operator.matrices(&left), operator.matrices(&error));
    left.iter().zip(&error).all(|(left, error)| is_positive(left, error))
}

/// Distance of γY − L(Y) from the base, relative to the base, at which [`solution`] ends. Near enough, because Y is then checked over a box of operators.
const NEARLY: f64 = 1e-6;

/// Reason for the absence of a radius.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Ended {
    /// Numbers overflowed.
    Overflow,
    /// The watcher ended the computation.
    Stopped,
}

/// Operator times a power of two. The watcher hears of each image.
struct Images<'a, O> {
    operator: &'a O,
    factor: f64,
    operations: f64,
    watch: &'a dyn Watch,
}

impl<O> Images<'_, O> {
    fn seen(&self, image: Vec<f64>) -> Vec<f64> {
        self.watch.done(self.operations);
        // A product with a power of two, 1 included, is exact unless the number underflows.
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

/// Returns the spectral radius, or the error `Overflow` if a number overflows.
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
        // `going` is false once the space is invariant. A larger space does not exist then, so the present guess is the last one.
        let going = krylov.step(operator);
        let steps = krylov.steps();
        let last = !going || steps == most;
        if steps < next && !last {
            continue;
        }
        // The distance to the next look grows with the space: eigenvalues of the Hessenberg matrix cost the third power of its size.
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
        // If a larger space did not halve the width, rounding limits the bounds, and a still larger space does not help.
        let no_better = width.is_finite() && high - low > 0.5 * width;
        if last || no_better || high - low <= GOOD * high {
            break;
        }
    }
    if !high.is_finite() {
        return Ok(Radius::at_least(low));
    }
    let value = 0.5 * (low + high);
    // The middle of the two bounds is rounded too, which the last term covers.
    // The radius lies between `low` and `high`, so the larger half is the error of the middle.
    Ok(Radius { value, error: outward((high - value).max(value - low)) + f64::EPSILON * value })
}

/// Krylov space of E, L(E), L²(E), …, with an orthonormal basis. In the basis L is an upper Hessenberg matrix.
struct Krylov {
    /// Coordinates of E.
    base: Vec<f64>,
    /// Norm of E.
    norm: f64,
    /// Orthonormal basis; the first vector is E divided by its norm.
    basis: Vec<Vec<f64>>,
    /// Columns of the Hessenberg matrix. Each column is longer by one entry than the column before.
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

    /// Adds a column to the Hessenberg matrix, and returns whether the basis could be extended for another column.
    fn step(&mut self, operator: &impl Positive) -> bool {
        let mut image = operator.apply(&self.basis[self.columns.len()]);
        let size = dot(&image, &image).sqrt();
        let mut column = vec![0.0; self.basis.len() + 1];
        // Orthogonalising twice is enough to keep the basis orthogonal to rounding (Giraud, Langou & Rozložník 2005).
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
        // An image inside the space leaves only rounding outside. The space is then invariant, and its eigenvalues are eigenvalues of L.
        let going = left > BREAKDOWN * size;
        if going {
            column[last] = left;
            image.iter_mut().for_each(|entry| *entry /= left);
            self.basis.push(image);
        }
        self.columns.push(column);
        going
    }

    /// Returns the largest real eigenvalue of the Hessenberg matrix, an estimate of the radius; `None` if numbers overflow or the eigenvalues do not converge.
    /// E is positive definite, so E has a part in the direction of the leading eigenvector.
    fn largest_real(&self) -> Option<f64> {
        let size = self.columns.len();
        if self.columns.iter().flatten().any(|entry| !entry.is_finite()) {
            return None;
        }
        let values = crate::eigenvalues(&Matrix::from_fn(size, size, |row, column| self.columns[column].get(row).copied().unwrap_or(0.0)));
        // An eigenvalue iteration that has not converged returns NaN.
        if values.iter().any(|value| value.is_nan()) {
            return None;
        }
        let scale = values.iter().map(|value| libm::hypot(value.re, value.im)).fold(0.0, f64::max);
        let real = values.iter().filter(|value| value.im.abs() <= 1e-9 * scale).map(|value| value.re).fold(0.0, f64::max);
        // Rounding can split a real eigenvalue into a complex pair. The largest modulus is then the better guess.
        Some(if real > 0.0 { real } else { scale })
    }

    /// Returns the tightest provable bounds around a guess in this space; `None` if the watcher ends the search. Without a proof the lower bound is 0
    /// and the upper bound infinite.
    fn bounds(&self, operator: &impl Positive, guess: f64, watch: &dyn Watch) -> Option<(f64, f64)> {
        let mut low = 0.0;
        let mut apart = NEAREST;
        // Candidates leave the guess in steps that double. The first proven candidate is the tightest of the steps.
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
            // If every moment becomes zero within some frames, the guess is zero or rounding, and a candidate relative to the guess stays too small.
            let candidate = (guess * (1.0 + apart)).max(apart * 1e-3);
            if self.check(operator, candidate, &is_definite) {
                high = candidate;
            }
            apart *= FARTHER;
        }
        Some((low, high))
    }

    /// Returns true if the Y of this space for γ = `candidate` is of the wanted `kind`, and γY − L(Y) is shown to be positive definite.
    fn check(&self, operator: &impl Positive, candidate: f64, kind: &dyn Fn(&[Matrix]) -> bool) -> bool {
        let Some((solution, _)) = self.solve(candidate) else {
            return false;
        };
        kind(&operator.matrices(&solution)) && leaves_less(operator, candidate, &solution)
    }

    /// Returns the combination Y of the basis with the least norm of γY − L(Y) − E, and this norm. `None` if the problem is singular or overflows.
    ///
    /// The least-squares problem has a Hessenberg matrix. Givens rotations make this matrix triangular.
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
            // The rotation makes the entry below the diagonal zero. Entries left of `place` are zero already.
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
        // Back substitution. No diagonal entry is zero, since each is a `length` that was checked above.
        for row in (0..size).rev() {
            let known: f64 = (row + 1..size).map(|column| matrix[(row, column)] * weights[column]).sum();
            weights[row] = (right[row] - known) / matrix[(row, row)];
        }
        // The last entry of the rotated right side lies outside the range of the matrix, so its size is the norm of the rest.
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

/// Returns whether the diagonal of any of the matrices has an entry below zero. With e the unit vector of the negative entry, eᵀYe < 0, so Y is not positive
/// definite.
pub fn is_indefinite(matrices: &[Matrix]) -> bool {
    matrices.iter().any(|matrix| (0..matrix.rows()).any(|place| matrix[(place, place)] < 0.0))
}

/// Appends the lower half of a symmetric matrix, row by row.
pub(crate) fn pack(matrix: &Matrix, into: &mut Vec<f64>) {
    for row in 0..matrix.rows() {
        into.extend_from_slice(&matrix.row(row)[..=row]);
    }
}

/// Returns the symmetric matrix of `size` rows with its lower half at the beginning of `from`, and the rest of `from` after that half.
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
