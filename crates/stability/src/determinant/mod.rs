//! Stability of loops with long delays from a small determinant instead of a large matrix.
//!
//! A delay of j steps adds j times as many states to a matrix as signals are delayed, but to the characteristic equation only a factor z^−j. The
//! roots of that equation outside a circle are counted by the argument principle, and the outermost is found by Newton's method and then certified by
//! two counts.

mod contour;
mod delayed_loop;
mod kernel;
mod point;
mod search;

#[cfg(test)]
mod tests;

use num_complex::Complex64;

use crate::rounding::real;
use crate::{Unwatched, Watch};
use contour::Circle;
pub use delayed_loop::{DelayedLoop, DelayedLoopError};
pub use kernel::Kernel;

/// About how many points are looked at for each step of delay, on all circles together: measured, of delays of 250 to 4000 frames.
const POINTS_A_STEP: f64 = 60.0;
/// Operations for an entry of the matrix of a point besides products: kernels, lengths and allocations.
const OF_AN_ENTRY: f64 = 20.0;

impl DelayedLoop {
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
        POINTS_A_STEP * real(usize::try_from(self.steps()).unwrap_or(usize::MAX)) * self.operations_of_a_point()
    }

    /// Returns the operations for the characteristic matrix at one point, its inverse and the distances that follow from the inverse.
    fn operations_of_a_point(&self) -> f64 {
        let size = real(self.now.rows());
        // A multiplication of complex numbers is four; a product with each term beside the inverse.
        4.0 * size * size * (size + size * real(self.terms.len()) + OF_AN_ENTRY)
    }

    /// The steps of all kernels.
    fn steps(&self) -> u64 {
        self.terms.iter().map(|term| u64::from(term.kernel.steps())).sum()
    }

    fn roots_beyond(&self, turns: i64) -> Option<usize> {
        usize::try_from(i64::try_from(self.now.rows()).ok()? - turns).ok()
    }
}
