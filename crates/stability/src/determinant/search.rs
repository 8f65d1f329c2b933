//! The search for the outermost root of a loop with delays, and its certification by counts.

use num_complex::Complex64;

use super::contour::Circle;
use super::{DelayedLoop, Kernel};
use crate::{Matrix, Radius, Unwatched, Watch};

/// The largest number of rows of an explicit matrix. A small explicit matrix is as cheap, and its bound is better at multiple roots.
const EXPLICIT: usize = 40;
/// The largest number of halvings of the bracket, in the logarithm of the radius.
const HALVINGS: u32 = 60;
/// Factor from a distance without a certificate to the next distance.
const GROWTH: f64 = 3.0;

impl DelayedLoop {
    /// Returns the modulus of the outermost root. For every loop with matrices within `perturbation` of these matrices in the 2-norm, the modulus is within
    /// value ± error.
    ///
    /// The upper end is certified by a count of no root outside, the lower end by a count of at least one root within a small circle (or outside the
    /// lower end). Both counts hold for all such loops and include the rounding of the evaluation. The distances of the circles begin with the first-order
    /// sensitivity |A⁻¹|·|F/F'| of the root and grow threefold until the counts succeed.
    ///
    /// If |z|^−j overflows at all roots, far inside, the interval reaches from 0 to the smallest radius of a count. The error is infinite if no count
    /// succeeded.
    #[must_use]
    pub fn bounded_radius(&self, perturbation: f64) -> Radius {
        self.bounded_radius_watched(perturbation, &Unwatched).unwrap_or(Radius::UNKNOWN)
    }

    /// Computes [`DelayedLoop::bounded_radius`] with a watch, asked at each point of each circle; `None` if the watch stops the computation.
    #[must_use]
    pub(crate) fn bounded_radius_watched(&self, perturbation: f64, watch: &dyn Watch) -> Option<Radius> {
        let radius = self.searched(perturbation, watch);
        // A stopped count looks like a count too near to a root, so the radius of a stopped search may be wrong and is no answer.
        (!watch.stops()).then_some(radius)
    }

    fn searched(&self, perturbation: f64, watch: &dyn Watch) -> Radius {
        let longest = self.terms.iter().map(|term| term.kernel.steps()).max().unwrap_or(0);
        if self.now.rows().saturating_mul(longest as usize + 1) <= EXPLICIT {
            return self.explicit_radius(longest as usize, perturbation);
        }
        let Some(mut high) = self.outer(perturbation) else {
            return Radius::UNKNOWN;
        };
        let longest = longest.max(1);
        // At the floor |z|^−j is 1e60. The floor rises to each radius of a failed count, and no smaller radius is tried.
        let mut floor = libm::pow(10.0, -60.0 / f64::from(longest));
        let mut low: f64 = 0.0;
        let mut trial = high;
        for _ in 0..HALVINGS {
            if watch.stops() {
                break;
            }
            let trip = self.trip(Circle { centre: Complex64::default(), radius: trial }, perturbation, watch);
            match trip.turns.and_then(|turns| self.roots_beyond(turns)) {
                Some(0) => high = high.min(trial),
                Some(_) => low = low.max(trial),
                None => floor = floor.max(trial),
            }
            // From outside, the root nearest to the circle is usually the outermost root. The modulus of any root is a lower bound.
            if low < trial
                && let Some(root) = self.polished(trip.nearest)
            {
                let modulus = root.norm();
                if modulus >= low && modulus < high {
                    let reached = low.max(self.certified_low(root, perturbation, watch));
                    if let Some(sure) = self.certified_high(root, high, perturbation, watch) {
                        return interval(reached, high.min(sure), modulus);
                    }
                    low = reached;
                }
            }
            if high <= floor * (1.0 + 1e-9) || high - low <= 1e-12 * high {
                break;
            }
            // The geometric mean, because the bracket can span many orders of magnitude.
            trial = (low.max(floor) * high).sqrt();
        }
        interval(low, high, 0.5 * (low + high))
    }

    /// Returns the radius of the explicit matrix of a loop with short delays. The states are the newest x and the `depth` older x in the reach of the kernels.
    fn explicit_radius(&self, depth: usize, perturbation: f64) -> Radius {
        let size = self.now.rows();
        let mut whole = Matrix::zeros(size * (depth + 1), size * (depth + 1));
        // A row of k blocks with the same perturbation is perturbed by √k times the norm of one block's perturbation, in the 2-norm.
        let mut copies = 1.0;
        for row in 0..size {
            whole.row_mut(row)[..size].copy_from_slice(self.now.row(row));
        }
        for term in &self.terms {
            let last = term.kernel.steps() as usize;
            let first = match term.kernel {
                Kernel::Delay(_) => last,
                Kernel::Sum(_) => 1,
            };
            for step in first..=last {
                for row in 0..size {
                    for column in 0..size {
                        whole[(row, step * size + column)] += term.matrix[(row, column)];
                    }
                }
            }
            copies += f64::from(term.kernel.steps().max(1)).sqrt();
        }
        // Companion form: each older x is the next newer x of the step before.
        for place in 0..size * depth {
            whole[(place + size, place)] = 1.0;
        }
        crate::bounded_radius(&whole, perturbation * copies)
    }

    /// Returns a radius beyond which there is no root, because |z| > |now| + Σ |kernel|·|matrix| makes A regular; `None` if no radius below 10¹² suffices.
    fn outer(&self, perturbation: f64) -> Option<f64> {
        // Starting small gives a small first circle for loops with a small radius. The factor 1.5 reaches 10¹² in some seventy steps.
        let mut radius = 0.25;
        while radius < 1e12 {
            let mut reach = self.now_norm + perturbation;
            for term in &self.terms {
                reach += term.kernel.limits(radius).0 * (term.norm + perturbation);
            }
            if reach < radius {
                return Some(radius);
            }
            radius *= 1.5;
        }
        None
    }

    /// Returns the root found by Newton's method from `start`; the last digits of a multiple root may be wrong. `None` if the method does not converge.
    fn polished(&self, start: Complex64) -> Option<Complex64> {
        let mut z = start;
        let mut last = f64::INFINITY;
        for _ in 0..80 {
            let Some(point) = self.point(z) else {
                // The matrix is singular to the last digit next to a root, or z is far inside and entries overflow: only a small last step means a root.
                return (last < 1e-6 * z.norm()).then_some(z);
            };
            let step = self.newton_step(&point);
            let length = step.norm();
            if !length.is_finite() {
                return None;
            }
            // The step is within rounding, or small and no longer shrinking: the iteration has converged.
            if length <= 4.0 * f64::EPSILON * z.norm() || (length < 1e-6 * z.norm() && length > 0.9 * last) {
                // A root this close to the real axis is taken to be real, because half circles are cheaper. The counts that follow decide.
                return Some(if z.im.abs() < 1e-14 * z.norm() { Complex64::from(z.re) } else { z });
            }
            last = length;
            z -= step;
        }
        None
    }

    /// Returns the first-order error of a root, as the distance of the first circle. Next to the root |A⁻¹| is its sensitivity divided by the distance, so
    /// the sensitivity follows from a point nearby.
    fn first_distance(&self, root: Complex64, perturbation: f64) -> f64 {
        let longest = f64::from(self.terms.iter().map(|term| term.kernel.steps()).max().unwrap_or(0).max(1));
        let offset = 1e-6 / longest * root.norm();
        let smallest = 4.0 * f64::EPSILON * root.norm();
        let Some(point) = self.point(root + offset) else { return smallest };
        let mut blur = perturbation + point.rounding;
        for (term, size) in self.terms.iter().zip(&point.sizes) {
            blur += size * (perturbation + term.kernel.rounding() * term.norm);
        }
        let first = 1.5 * blur * point.nuclear(self.now.rows()) * offset;
        if first.is_finite() { first.max(smallest) } else { smallest }
    }

    /// Returns a radius with at least one root on it or outside, by counts on circles around the computed root; 0 if no count succeeds.
    fn certified_low(&self, root: Complex64, perturbation: f64, watch: &dyn Watch) -> f64 {
        let mut distance = self.first_distance(root, perturbation);
        while distance < 0.9 * root.norm() && !watch.stops() {
            // A circle across the real axis may contain the conjugate root too. The count is then larger, and the bound still holds.
            if self.trip(Circle { centre: root, radius: distance }, perturbation, watch).turns.is_some_and(|turns| turns > 0) {
                return (root.norm() - distance) * (1.0 - 4.0 * f64::EPSILON);
            }
            distance *= GROWTH;
        }
        0.0
    }

    /// Returns a radius below `high` without a root on it or outside, as little above the modulus of `root` as counts allow; `None` if there is a root outside,
    /// or if no count succeeds.
    fn certified_high(&self, root: Complex64, high: f64, perturbation: f64, watch: &dyn Watch) -> Option<f64> {
        let modulus = root.norm();
        let mut distance = self.first_distance(root, perturbation);
        while modulus + distance < high && !watch.stops() {
            match self.count(modulus + distance, perturbation, watch) {
                Some(0) => return Some((modulus + distance) * (1.0 + 4.0 * f64::EPSILON)),
                Some(_) => return None,
                None => distance *= GROWTH,
            }
        }
        None
    }
}

fn interval(low: f64, high: f64, value: f64) -> Radius {
    let value = value.clamp(low, high);
    Radius { value, error: (high - value).max(value - low) * (1.0 + 4.0 * f64::EPSILON) }
}
