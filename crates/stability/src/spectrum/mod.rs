//! Eigenvalues of real matrices, and spectral radii with bounds of their errors.
//!
//! Matrices are reduced to Hessenberg form and then iterated; small matrices are copied to arrays on the stack, without an allocation ([`radius_small`]).
//! Reduction and iteration are backward stable: the computed eigenvalues are exactly those of a matrix that differs from the given matrix by a small
//! multiple of n·ε·|A|. The effect of that difference on the radius is computed, not assumed: see [`bounded_radius`].

mod enclosure;
mod francis;
mod hessenberg;
mod schur;
mod square;
mod triangle;
mod vectors;

#[cfg(test)]
mod tests;

use num_complex::Complex64;

use crate::rounding::real;
use crate::{Matrix, Radius};
use enclosure::{Enclosure, Interval};
pub(crate) use schur::Schur;
use square::{balance, exponent_of, power_of_two};
use triangle::Triangle;
pub use vectors::eigenvector;

/// The backward error of reduction and iteration as a multiple of n·ε·|A|, with the Frobenius norm |A|. The proven constants are larger: Higham 2002,
/// Section 19.3, gives a multiple of n² for n reflections of length n, as if all errors pointed the same way. Measured errors are below 1.
const BACKWARD_ERROR: f64 = 4.0;

/// Evaluates an expression with the matrix copied to an array of its size; `None` if the matrix has more than 16 rows, or none.
macro_rules! on_the_stack {
    ($matrix:expr, $array:ident => $body:expr) => {
        on_the_stack!(@ $matrix, $array => $body; 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16)
    };
    (@ $matrix:expr, $array:ident => $body:expr; $($size:literal)*) => {
        match $matrix.rows() {
            $($size => {
                let mut $array = [[0.0; $size]; $size];
                for (row, entries) in $array.iter_mut().enumerate() {
                    entries.copy_from_slice($matrix.row(row));
                }
                Some($body)
            })*
            _ => None,
        }
    };
}

/// Buffers of the computations, to be used again. The radius of a small matrix, without a bound, needs no allocation.
///
/// Results do not depend on earlier computations with the same workspace.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    eigenvalues: Vec<Complex64>,
    scratch: Matrix,
    triangle: Triangle,
    enclosure: Enclosure,
}

/// Returns all eigenvalues, each as often as its multiplicity as a root of the characteristic polynomial: by falling modulus, then by falling real part,
/// then by falling imaginary part. Empty if an entry is infinite or NaN.
///
/// # Panics
///
/// If the matrix is not square.
#[must_use]
pub fn eigenvalues(matrix: &Matrix) -> Vec<Complex64> {
    let mut workspace = Workspace::default();
    workspace.eigenvalues(matrix);
    workspace.eigenvalues
}

/// Returns the spectral radius, without a bound of its error; 0 for the empty matrix, NaN if an entry is NaN, infinite if an entry is infinite.
///
/// For many small matrices use [`radius_small`].
///
/// # Panics
///
/// If the matrix is not square.
#[must_use]
pub fn radius(matrix: &Matrix) -> f64 {
    Workspace::default().radius(matrix)
}

/// Returns an interval that contains the spectral radius of every matrix within `perturbation` of `matrix` in the 2-norm.
///
/// The interval also covers the error of the computation: the radius of A + E is within value ± error for every real E with
/// |E|₂ ≤ `perturbation` + 4·n·ε·|A|. To first order the error is that bound times the condition number 1/|yᴴx| of the outermost eigenvalue. But
/// all eigenvalues count, no eigenvalue is assumed simple, and second-order effects are covered: the bound comes from the norm of the resolvent along circles
/// (Stewart & Sun 1990, Section IV.1; Trefethen & Embree 2005, Theorem 2.1), taken from the Schur form by blocks (Golub & Van Loan 2013, Section 7.6.3).
/// A defective eigenvalue of multiplicity m gets its true error, of size |E|^(1/m).
///
/// Matrices whose entries are too large for products of them are scaled by a power of two, which is exact. The error is infinite if an entry is infinite
/// or NaN, or if `perturbation` is.
///
/// # Panics
///
/// If the matrix is not square.
#[must_use]
pub fn bounded_radius(matrix: &Matrix, perturbation: f64) -> Radius {
    Workspace::default().bounded_radius(matrix, perturbation)
}

/// Returns the [`radius`] of an array, and overwrites the array. Meant for sizes up to about 12. NaN if the iteration does not converge, which no test has
/// found.
#[must_use]
pub fn radius_small<const N: usize>(matrix: &mut [[f64; N]; N]) -> f64 {
    let Some(exponent) = normalise(matrix.as_flattened_mut()) else {
        return unusual(matrix);
    };
    balance(matrix, |_, _| {});
    hessenberg::reduce(matrix);
    if !francis::iterate::<false, _>(matrix) {
        return f64::NAN;
    }
    let mut square: f64 = 0.0;
    francis::each(matrix, |value| square = square.max(value.norm_sqr()));
    square.sqrt() * power_of_two(exponent)
}

impl Workspace {
    /// Like the function [`eigenvalues`], in the memory of the workspace. The slice holds until the next call.
    ///
    /// # Panics
    ///
    /// If the matrix is not square.
    pub(crate) fn eigenvalues(&mut self, matrix: &Matrix) -> &[Complex64] {
        assert_eq!(matrix.rows(), matrix.columns(), "a matrix with eigenvalues is square");
        self.eigenvalues.clear();
        if matrix.rows() == 0 || !matrix.is_finite() {
            return &self.eigenvalues;
        }
        let list = &mut self.eigenvalues;
        let converged = on_the_stack!(matrix, array => {
            let scale = power_of_two(normalise(array.as_flattened_mut()).unwrap_or(0));
            balance(&mut array, |_, _| {});
            hessenberg::reduce(&mut array);
            let converged = francis::iterate::<false, _>(&mut array);
            francis::each(&array, |value| list.push(value * scale));
            converged
        });
        let converged = converged.unwrap_or_else(|| self.large_eigenvalues(matrix));
        if !converged {
            self.give_up(matrix.rows());
        }
        self.eigenvalues.sort_by(|a, b| {
            // `total_cmp` has a place for NaN too, so that the order is total.
            let modulus = b.norm().total_cmp(&a.norm());
            modulus.then(b.re.total_cmp(&a.re)).then(b.im.total_cmp(&a.im))
        });
        &self.eigenvalues
    }

    /// Like the function [`radius`], in the memory of the workspace.
    ///
    /// # Panics
    ///
    /// If the matrix is not square.
    pub(crate) fn radius(&mut self, matrix: &Matrix) -> f64 {
        assert_eq!(matrix.rows(), matrix.columns(), "a matrix with eigenvalues is square");
        on_the_stack!(matrix, array => radius_small(&mut array)).unwrap_or_else(|| self.large_radius(matrix))
    }

    /// Like the function [`bounded_radius`], in the memory of the workspace.
    ///
    /// # Panics
    ///
    /// If the matrix is not square.
    pub(crate) fn bounded_radius(&mut self, matrix: &Matrix, perturbation: f64) -> Radius {
        assert_eq!(matrix.rows(), matrix.columns(), "a matrix with eigenvalues is square");
        let size = matrix.rows();
        if size == 0 {
            return Radius { value: 0.0, error: 0.0 };
        }
        let largest = matrix.largest().max(perturbation);
        // The comparison with a range is false for a perturbation that is NaN, too.
        if !(matrix.is_finite() && (0.0..f64::INFINITY).contains(&perturbation)) {
            return Radius { value: self.radius(matrix), error: f64::INFINITY };
        }
        // Products of entries beyond this size could overflow.
        if largest > 1e60 {
            let exponent = exponent_of(largest).min(1000);
            let down = power_of_two(-exponent);
            // An entry that underflows changes by less than the least normal number.
            let lost = real(size) * f64::MIN_POSITIVE;
            return self.bounded_radius(&matrix.scaled(down), perturbation * down + lost).scaled(power_of_two(exponent));
        }
        let norm = matrix.frobenius_norm();
        if norm < 1e-100 {
            return Radius { value: 0.0, error: norm + perturbation };
        }
        let own = BACKWARD_ERROR * real(size) * f64::EPSILON;
        let mut found = self.enclosed(matrix, perturbation + own * norm);
        // The matrix may be badly scaled. Balancing lowers the effect of rounding, but the perturbation may grow by the ratio of the scales, and no condition
        // number falls by more than that ratio. So balancing gains nothing where the perturbation is larger than the rounding.
        let is_rounding = own * norm > perturbation;
        if found.as_ref().is_none_or(|(value, interval)| is_rounding && interval.width() > 1e-9 * value) {
            let mut balanced = matrix.clone();
            let mut exponents = vec![0; size];
            balance(&mut balanced, |place, exponent| exponents[place] += exponent);
            let range = exponents.iter().max().unwrap_or(&0) - exponents.iter().min().unwrap_or(&0);
            let grown = if perturbation > 0.0 { perturbation * power_of_two(range) } else { 0.0 };
            if range > 0
                && let Some((better, other)) = self.enclosed(&balanced, grown + own * balanced.frobenius_norm())
            {
                found = Some(match found {
                    Some((value, interval)) => (if other.width() < interval.width() { better } else { value }, interval.and(other)),
                    None => (better, other),
                });
            }
        }
        let Some((value, interval)) = found else {
            return Radius { value: self.radius(matrix), error: norm + perturbation };
        };
        // The radius is at most the norm.
        let high = interval.high.min((norm + perturbation) * (1.0 + own));
        let value = value.clamp(interval.low.min(high), high);
        // The last term covers the rounding of moduli and of these differences.
        Radius { value, error: (high - value).max(value - interval.low) + 4.0 * f64::EPSILON * value }
    }

    /// Returns the computed radius and its interval for perturbations up to `epsilon`; `None` if the iteration does not converge.
    fn enclosed(&mut self, matrix: &Matrix, epsilon: f64) -> Option<(f64, Interval)> {
        let triangle = &mut self.triangle;
        let done = on_the_stack!(matrix, array => {
            hessenberg::reduce(&mut array);
            let converged = francis::iterate::<true, _>(&mut array);
            if converged {
                triangle.load(&array);
            }
            converged
        });
        let done = done.unwrap_or_else(|| {
            self.scratch.clone_from(matrix);
            hessenberg::reduce(&mut self.scratch);
            let converged = francis::iterate::<true, _>(&mut self.scratch);
            if converged {
                self.triangle.load(&self.scratch);
            }
            converged
        });
        if !done {
            return None;
        }
        let interval = self.enclosure.enclose(&mut self.triangle, epsilon);
        let value = (0..self.triangle.size()).fold(0.0, |largest: f64, place| largest.max(self.triangle.eigenvalue(place).norm()));
        Some((value, interval))
    }

    fn large_radius(&mut self, matrix: &Matrix) -> f64 {
        if !matrix.is_finite() {
            return if matrix.largest().is_nan() { f64::NAN } else { f64::INFINITY };
        }
        self.eigenvalues.clear();
        if !self.large_eigenvalues(matrix) {
            self.give_up(matrix.rows());
        }
        let larger = |largest: f64, value: &Complex64| if value.norm() > largest || value.is_nan() { value.norm() } else { largest };
        self.eigenvalues.iter().fold(0.0, larger)
    }

    /// Appends the eigenvalues of a matrix of any size to `self.eigenvalues`, in any order. Returns false if the iteration did not converge.
    fn large_eigenvalues(&mut self, matrix: &Matrix) -> bool {
        self.scratch.clone_from(matrix);
        let scale = power_of_two(normalise(self.scratch.entries_mut()).unwrap_or(0));
        balance(&mut self.scratch, |_, _| {});
        hessenberg::reduce(&mut self.scratch);
        let converged = francis::iterate::<false, _>(&mut self.scratch);
        let list = &mut self.eigenvalues;
        francis::each(&self.scratch, |value| list.push(value * scale));
        converged
    }

    /// Replaces the eigenvalues by `size` NaNs, because the iteration has not converged and no eigenvalue is known.
    fn give_up(&mut self, size: usize) {
        self.eigenvalues.clear();
        self.eigenvalues.resize(size, Complex64::new(f64::NAN, f64::NAN));
    }
}

/// Scales the entries of a matrix by a power of two, if the entries are so large or small that their squares would overflow or underflow. Returns the
/// exponent of the power of two that undoes the scaling; `None` if an entry is infinite or NaN.
#[inline]
fn normalise(entries: &mut [f64]) -> Option<i32> {
    let mut sum = 0.0;
    for entry in &*entries {
        sum += entry.abs();
    }
    // The usual case needs one pass only: neither NaN nor an infinite sum is in this range.
    if sum > 1e-60 && sum < 1e60 {
        return Some(0);
    }
    let largest = entries.iter().fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
    if sum == 0.0 {
        return Some(0);
    }
    if sum.is_nan() || largest.is_infinite() {
        return None;
    }
    let exponent = exponent_of(largest).clamp(-1000, 1000);
    for entry in entries {
        *entry *= power_of_two(-exponent);
    }
    Some(exponent)
}

/// Returns the radius of a matrix with an entry that is infinite or NaN.
#[cold]
fn unusual<const N: usize>(matrix: &[[f64; N]; N]) -> f64 {
    if matrix.as_flattened().iter().any(|entry| entry.is_nan()) { f64::NAN } else { f64::INFINITY }
}
