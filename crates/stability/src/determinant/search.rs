//! The outermost root.

use num_complex::Complex64;

use super::contour::Circle;
use super::{DelayedLoop, Kernel};
use crate::{Matrix, Radius, Unwatched, Watch};

/// Up to this many rows the explicit matrix is as cheap, and its bound is better at multiple roots.
const EXPLICIT: usize = 40;
/// Halvings of the bracket, in its logarithm.
const HALVINGS: u32 = 60;
/// Growth of the distances at which a root is certified.
const GROWTH: f64 = 3.0;

impl DelayedLoop {
    /// The modulus of the outermost root: for every loop whose matrices are each within `perturbation` of these in the 2-norm, it is within value ±
    /// error.
    ///
    /// The upper end is certified by a count of no root outside, the lower end by a count of one root at least within a small circle (or outside the
    /// lower end), both for all those loops and with the rounding of the evaluation included; see [`DelayedLoop::roots_outside`]. The circles
    /// start as near as the first-order sensitivity |A⁻¹|·|F/F'| of the root allows and grow threefold until they hold.
    ///
    /// If all roots are so far inside that |z|^−j leaves the range of numbers, the interval reaches from 0 to the smallest radius at which they were
    /// counted. The error is infinite if nothing could be counted.
    #[must_use]
    pub fn bounded_radius(&self, perturbation: f64) -> Radius {
        self.bounded_radius_watched(perturbation, &Unwatched).unwrap_or(Radius::UNKNOWN)
    }

    /// [`DelayedLoop::bounded_radius`], watched: it is asked at each point of each circle; `None` if the watch ends it.
    #[must_use]
    pub(crate) fn bounded_radius_watched(&self, perturbation: f64, watch: &dyn Watch) -> Option<Radius> {
        let radius = self.searched(perturbation, watch);
        // A count that was ended tells nothing, like one that is too near to a root: what came of it is no answer.
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
        // z^−j stays below 1e60; and below a radius at which nothing could be told, nothing is tried again.
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
            // From outside, the root that seems nearest is usually the outermost; if it is not, at least none within it is.
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
            trial = (low.max(floor) * high).sqrt();
        }
        interval(low, high, 0.5 * (low + high))
    }

    /// The radius of the explicit matrix of a short delay: the newest state, and as many older ones as the kernels reach.
    fn explicit_radius(&self, depth: usize, perturbation: f64) -> Radius {
        let size = self.now.rows();
        let mut whole = Matrix::zeros(size * (depth + 1), size * (depth + 1));
        // A row of k blocks, each changed by the same matrix, changes by √k of it in the 2-norm.
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
        for place in 0..size * depth {
            whole[(place + size, place)] = 1.0;
        }
        crate::bounded_radius(&whole, perturbation * copies)
    }

    /// A radius beyond which there is no root: |z| > |now| + Σ |kernel|·|matrix| makes A diagonally dominant in norm.
    fn outer(&self, perturbation: f64) -> Option<f64> {
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

    /// Newton's method from `start`, with the last digits of a multiple root left open; `None` if it does not converge.
    fn polished(&self, start: Complex64) -> Option<Complex64> {
        let mut z = start;
        let mut last = f64::INFINITY;
        for _ in 0..80 {
            let Some(point) = self.point(z) else {
                // Singular to the last digit next to a root; or too far inside for numbers.
                return (last < 1e-6 * z.norm()).then_some(z);
            };
            let step = self.newton_step(&point);
            let length = step.norm();
            if !length.is_finite() {
                return None;
            }
            // Steps that no longer shrink near the rounding of the root: done.
            if length <= 4.0 * f64::EPSILON * z.norm() || (length < 1e-6 * z.norm() && length > 0.9 * last) {
                // A root next to the real axis is one on it, as far as can be told: half circles are cheaper.
                return Some(if z.im.abs() < 1e-14 * z.norm() { Complex64::from(z.re) } else { z });
            }
            last = length;
            z -= step;
        }
        None
    }

    /// The first-order error of a root: |A⁻¹| grows like |root's sensitivity|/distance next to it.
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

    /// A radius that at least one root reaches, from a circle around the computed one; 0 if there is none.
    fn certified_low(&self, root: Complex64, perturbation: f64, watch: &dyn Watch) -> f64 {
        let mut distance = self.first_distance(root, perturbation);
        while distance < 0.9 * root.norm() && !watch.stops() {
            // A circle that comes near the real axis but is not centred there would meet the conjugate root too; that is no harm.
            if self.trip(Circle { centre: root, radius: distance }, perturbation, watch).turns.is_some_and(|turns| turns > 0) {
                return (root.norm() - distance) * (1.0 - 4.0 * f64::EPSILON);
            }
            distance *= GROWTH;
        }
        0.0
    }

    /// A radius that no root reaches, as little above that of `root` as can be told; `None` if there is a root outside, or nothing can be told.
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
