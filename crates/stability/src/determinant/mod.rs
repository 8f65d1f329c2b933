//! Stability of loops with long delays, from a small determinant instead of a large matrix.
//!
//! In a matrix, a delay of j steps adds j states for each delayed signal. In the characteristic equation the same delay is only a factor z^−j. The roots of
//! that equation outside a circle are counted by the argument principle. The outermost root is found by Newton's method and then certified by two counts.

mod contour;
mod delayed_loop;
mod kernel;
mod point;
mod search;

#[cfg(test)]
mod tests;

use num_complex::Complex64;

use crate::Watch;
use crate::rounding::real;
use contour::Circle;
pub use delayed_loop::{DelayedLoop, DelayedLoopError};
pub use kernel::Kernel;

/// The approximate number of points per step of delay, on all circles together, measured for delays of 250 to 4000 frames.
const POINTS_A_STEP: f64 = 60.0;
/// Operations for an entry of the matrix at a point besides products: kernels, lengths and allocations.
const OF_AN_ENTRY: f64 = 20.0;

impl DelayedLoop {
    /// Returns the number of roots with |z| > `radius`, each as often as its multiplicity, if it is the same for all loops whose matrices are each within
    /// `perturbation` of these in the 2-norm; `None` if a root is so near to the circle that rounding or the perturbation hides its side, if |z|^−j overflows
    /// on the circle, or if `radius` is not positive and finite.
    ///
    /// F has no poles but z = 0 and is close to z^n far away, so that the number of roots outside is n minus the turns of F along the circle.
    fn count(&self, radius: f64, perturbation: f64, watch: &dyn Watch) -> Option<usize> {
        if !(radius > 0.0 && radius.is_finite()) {
            return None;
        }
        self.roots_beyond(self.trip(Circle { centre: Complex64::default(), radius }, perturbation, watch).turns?)
    }

    /// Returns the approximate number of operations of [`DelayedLoop::bounded_radius`]: the number of points grows like the steps of delay.
    #[must_use]
    pub(crate) fn operations(&self) -> f64 {
        POINTS_A_STEP * real(usize::try_from(self.steps()).unwrap_or(usize::MAX)) * self.operations_of_a_point()
    }

    /// Returns the operations for the characteristic matrix at one point, its inverse and the distances that follow from the inverse.
    fn operations_of_a_point(&self) -> f64 {
        let size = real(self.now.rows());
        // A complex multiplication counts as four operations. The inverse is one product, and each term is another.
        4.0 * size * size * (size + size * real(self.terms.len()) + OF_AN_ENTRY)
    }

    /// Returns the sum of the steps of all kernels.
    fn steps(&self) -> u64 {
        self.terms.iter().map(|term| u64::from(term.kernel.steps())).sum()
    }

    fn roots_beyond(&self, turns: i64) -> Option<usize> {
        usize::try_from(i64::try_from(self.now.rows()).ok()? - turns).ok()
    }
}
