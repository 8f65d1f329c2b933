//! Counts of roots by the argument principle, with steps along a circle whose change of phase is bounded beforehand.
//!
//! Between two points of the contour A changes by Δ, and det A by the factor det(1 + A⁻¹Δ) = Π (1 + μ). The sum of the |μ| is at most the nuclear norm of
//! A⁻¹Δ (Weyl; Horn & Johnson 1991, Theorem 3.3.13). While that norm is at most q < 1, the phase changes by at most asin q < π/2, because each factor changes
//! the phase by at most asin |μ| and asin is convex. So a step that such discs cover from both ends has a change of phase below π, which follows from the
//! determinants at its ends. Δ includes rounding and the perturbation of the entries, so that a count holds for every system within the perturbation.

use core::f64::consts::PI;

use num_complex::Complex64;

use super::delayed_loop::DelayedLoop;
use super::kernel::Kernel;
use super::point::Point;
use crate::Watch;

/// The largest number of points of one count is `POINTS`, and `POINTS_PER_STEP` more for each step of delay. A root that needs more points is too near.
const POINTS: u64 = 10_000;
const POINTS_PER_STEP: u64 = 60;

/// A circle, or the upper half of one if its centre is real.
#[derive(Clone, Copy, Debug)]
pub(super) struct Circle {
    pub(super) centre: Complex64,
    pub(super) radius: f64,
}

/// The result of one trip around a circle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trip {
    /// Turns of det A around zero; `None` if a root is too near to the circle.
    pub(super) turns: Option<i64>,
    /// Point of the circle where a root seemed to be nearest: the norm of A⁻¹ is largest there, or the trip ended there.
    pub(super) nearest: Complex64,
}

/// Numbers that all points of a circle have in common.
struct Limits {
    /// Smallest modulus of a point of the circle, rounded down.
    inner: f64,
    /// Limits of each kernel and inner^−j, indexed like the terms of the loop.
    kernels: Vec<((f64, f64), f64)>,
    /// Bound of the perturbation of A and of the rounding of the kernels, in the 2-norm.
    blur: f64,
}

impl DelayedLoop {
    /// Counts the turns of det A around zero along the circle, for all systems whose matrices are within `perturbation` of these in the 2-norm. The origin must
    /// be the centre of the circle or outside. No turns are returned if the watch stops the trip.
    pub(super) fn trip(&self, circle: Circle, perturbation: f64, watch: &dyn Watch) -> Trip {
        let centred = circle.centre.norm() == 0.0;
        let inner = (if centred { circle.radius } else { circle.centre.norm() - circle.radius }) * (1.0 - 1e-15);
        let half = circle.centre.im == 0.0;
        let end = if half { PI } else { 2.0 * PI };
        let at = |angle: f64| {
            let z = circle.centre + Complex64::from_polar(circle.radius, angle);
            // The ends of a half circle are real.
            if half && (angle <= 0.0 || angle >= PI) { Complex64::from(z.re) } else { z }
        };
        let mut trip = Trip { turns: None, nearest: at(0.0) };
        if inner <= 0.0 {
            return trip;
        }
        let limits = self.limits(inner, perturbation);
        let Some(mut here) = self.point(at(0.0)) else { return trip };
        let (mut angle, mut phase, mut worst) = (0.0, 0.0, here.nuclear(self.now.rows()));
        let mut reach = self.reach(&here, &limits, circle.radius);
        let operations = self.operations_of_a_point();
        for _ in 0..POINTS + POINTS_PER_STEP * self.steps() {
            let Some(covered) = reach.filter(|_| !watch.stops()) else {
                trip.nearest = here.z;
                return trip;
            };
            let mut step = 1.9 * covered / circle.radius;
            loop {
                let next = if angle + step >= end { end } else { angle + step };
                watch.done(operations);
                let Some(there) = self.point(at(next)) else {
                    trip.nearest = at(next);
                    return trip;
                };
                let back = self.reach(&there, &limits, circle.radius);
                // Two discs whose radii sum to the length of the arc cover all its points, because a chord is shorter than its arc.
                if let Some(back) = back
                    && covered + back >= (next - angle) * circle.radius
                {
                    phase += (there.direction * here.direction.conj()).arg();
                    let closeness = there.nuclear(self.now.rows());
                    if closeness > worst {
                        (worst, trip.nearest) = (closeness, there.z);
                    }
                    (angle, here, reach) = (next, there, Some(back));
                    break;
                }
                step *= 0.5;
                if step * circle.radius <= 0.9 * covered {
                    // The next point lies within the disc of this one, and its own disc is empty or too small: rounding hides the phase.
                    trip.nearest = there.z;
                    return trip;
                }
            }
            if angle >= end {
                // A half circle has half the turns of the circle, because det A is conjugate in the lower half.
                let turns = phase / end;
                trip.turns = Some(rounded(turns));
                return trip;
            }
        }
        trip
    }

    fn limits(&self, inner: f64, perturbation: f64) -> Limits {
        let kernels: Vec<_> = self.terms.iter().map(|term| (term.kernel.limits(inner), Kernel::Delay(term.kernel.steps()).limits(inner).0)).collect();
        let mut blur = perturbation;
        for (term, ((largest, _), _)) in self.terms.iter().zip(&kernels) {
            blur += largest * (perturbation + term.kernel.rounding() * term.norm);
        }
        Limits { inner, kernels, blur }
    }

    /// Returns the distance from a point within which the phase changes by less than a quarter turn, at most `longest`; `None` if the bound fails even at the
    /// point itself.
    fn reach(&self, point: &Point, limits: &Limits, longest: f64) -> Option<f64> {
        let nuclear = point.nuclear(self.now.rows());
        let fixed = (limits.blur + point.rounding) * nuclear;
        if fixed.is_nan() || fixed >= 0.9 {
            return None;
        }
        let weights: Vec<f64> = self.terms.iter().map(|term| point.nuclear_with(&term.matrix)).collect();
        let change = |length: f64| {
            let mut sum = fixed + length * nuclear;
            for (place, term) in self.terms.iter().enumerate() {
                let (bounds, power) = limits.kernels[place];
                sum += weights[place] * term.kernel.change(point.z, length, bounds, power, limits.inner, point.sizes[place]);
            }
            sum
        };
        // The change grows with the length: bisection finds the largest length to within a tenth.
        let mut low = 1e-18 * point.z.norm();
        let mut high = longest;
        let least = change(low);
        if least.is_nan() || least >= 0.999 {
            return None;
        }
        if change(high) < 0.999 {
            return Some(high);
        }
        while high > 1.1 * low {
            let middle = if high > 4.0 * low { (low * high).sqrt() } else { 0.5 * (low + high) };
            if change(middle) < 0.999 {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(low)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a number of turns is at most the number of points")]
fn rounded(turns: f64) -> i64 {
    turns.round() as i64
}
