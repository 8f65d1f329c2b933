//! Stability of loops with long delays from a small determinant instead of a large matrix.
//!
//! A delay of j steps adds j times as many states to a matrix as signals are delayed, but to the characteristic equation only a factor z^−j. The
//! roots of that equation outside a circle are counted by the argument principle, and the outermost is found by Newton's method and then certified by
//! two counts.

mod contour;
mod kernel;
mod point;
mod search;

#[cfg(test)]
mod tests;

use num_complex::Complex64;

use crate::structure::count;
use crate::{Matrix, Unwatched, Watch};
use contour::Circle;
pub use kernel::Kernel;

/// About how many points are looked at for each step of delay, on all circles together: measured, of delays of 250 to 4000 frames.
const POINTS_A_STEP: f64 = 60.0;
/// Operations for an entry of the matrix of a point besides products: kernels, lengths and allocations.
const OF_AN_ENTRY: f64 = 20.0;

/// x(t+1) = now·x(t) + Σ matrix·(what a kernel makes of x at t and before): the characteristic function is
/// F(z) = det(z − now − Σ kernel(z)·matrix), and an eigenvalue of the loop is a root of it.
///
/// `Kernel::Delay(j)` in it stands for x(t−j), and `Kernel::Sum(j)` for x(t−1) + … + x(t−j).
#[derive(Clone, PartialEq, Debug)]
pub struct DelayedLoop {
    now: Matrix,
    now_norm: f64,
    terms: Vec<Term>,
}

#[derive(Clone, PartialEq, Debug)]
struct Term {
    kernel: Kernel,
    matrix: Matrix,
    norm: f64,
}

/// Why matrices make no loop.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum DelayedLoopError {
    /// Not all matrices are square and of one size.
    #[error("a matrix of a delayed loop has {rows} rows and {columns} columns, expected {size} of each, at least 1")]
    Shape {
        /// Rows of that matrix.
        rows: usize,
        /// Columns of that matrix.
        columns: usize,
        /// The rows of the first matrix.
        size: usize,
    },
    /// A delay has more steps than are counted.
    #[error("a delay of {steps} steps: expected fewer than 2^32")]
    TooLong {
        /// The steps.
        steps: usize,
    },
    /// An entry is infinite or NaN.
    #[error("an entry of a matrix of a delayed loop is not finite")]
    NotFinite,
}

impl DelayedLoop {
    /// The loop. Terms that are zero are left out.
    ///
    /// # Errors
    ///
    /// If the matrices are empty, not square, not all of one size, or not finite.
    pub fn new(now: Matrix, terms: Vec<(Kernel, Matrix)>) -> Result<Self, DelayedLoopError> {
        let size = now.rows();
        for matrix in terms.iter().map(|(_, matrix)| matrix).chain([&now]) {
            let (rows, columns) = (matrix.rows(), matrix.columns());
            if rows != size || columns != size || size == 0 {
                return Err(DelayedLoopError::Shape { rows, columns, size });
            }
            if !matrix.is_finite() {
                return Err(DelayedLoopError::NotFinite);
            }
        }
        let terms = terms.into_iter().filter(|(kernel, matrix)| matrix.largest() > 0.0 && *kernel != Kernel::Sum(0));
        let terms = terms.map(|(kernel, matrix)| Term { kernel, norm: matrix.frobenius_norm(), matrix }).collect();
        Ok(Self { now_norm: now.frobenius_norm(), now, terms })
    }

    /// The number of roots with |z| > `radius`, each as often as its multiplicity; `None` if one is so near to the circle that rounding hides on
    /// which side it is, or if |z|^−j leaves the range of numbers on it.
    ///
    /// F has no poles but z = 0 and is z^n far away, so that the roots outside are n less the turns of F along the circle.
    #[must_use]
    pub fn roots_outside(&self, radius: f64) -> Option<usize> {
        self.count(radius, 0.0, &Unwatched)
    }

    /// [`DelayedLoop::roots_outside`] for all loops whose matrices are each within `perturbation` of these in the 2-norm.
    fn count(&self, radius: f64, perturbation: f64, watch: &dyn Watch) -> Option<usize> {
        if !(radius > 0.0 && radius.is_finite()) {
            return None;
        }
        self.roots_beyond(self.trip(Circle { centre: Complex64::default(), radius }, perturbation, watch).turns?)
    }

    /// How many operations [`DelayedLoop::bounded_radius`] takes, about: the points of a circle are as many as the steps of delay.
    #[must_use]
    pub fn operations(&self) -> f64 {
        POINTS_A_STEP * count(usize::try_from(self.steps()).unwrap_or(usize::MAX)) * self.operations_of_a_point()
    }

    /// Returns the operations for the characteristic matrix at one point, its inverse and the distances that follow from the inverse.
    fn operations_of_a_point(&self) -> f64 {
        let size = count(self.now.rows());
        // A multiplication of complex numbers is four; a product with each term beside the inverse.
        4.0 * size * size * (size + size * count(self.terms.len()) + OF_AN_ENTRY)
    }

    /// The steps of all kernels.
    fn steps(&self) -> u64 {
        self.terms.iter().map(|term| u64::from(term.kernel.steps())).sum()
    }

    fn roots_beyond(&self, turns: i64) -> Option<usize> {
        usize::try_from(i64::try_from(self.now.rows()).ok()? - turns).ok()
    }
}
