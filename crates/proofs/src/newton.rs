//! Newton's method on a barrier: the one solver behind the searches of shapes and multipliers.
//!
//! A barrier is a convex function that grows beyond all bounds at the edge of its domain, so that its minimum, the *centre*, lies well within. Both searches follow
//! centres: that for matrix inequalities ([`inequality`](crate::inequality)) while the weight of a margin grows, that for quadratic certificates
//! ([`worst_case`](crate::worst_case)) while a rate falls. Nothing here has to be right: each finding is checked.

use cohaptic_stability::numerics::{cholesky, solve};
use cohaptic_stability::{Matrix, Watch};

/// A barrier, and the points that it is a function of.
pub(crate) trait Barrier {
    /// A point of its domain.
    type Point;

    /// Returns the value; `None` outside of the domain.
    fn value(&self, point: &Self::Point) -> Option<f64>;

    /// Returns the gradient and the upper triangle of the Hessian; `None` where rounding got the better of them.
    fn derivatives(&self, point: &Self::Point) -> Option<(Vec<f64>, Matrix)>;

    /// Returns the point that is so far from another in a direction.
    fn moved(&self, point: &Self::Point, direction: &[f64], length: f64) -> Self::Point;
}

/// The steps that are taken.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Steps {
    /// The most steps to a centre.
    pub(crate) most: u32,
    /// Newton's decrement below which a centre is near enough.
    pub(crate) centred: f64,
    /// The shortest part of a step that is tried.
    pub(crate) shortest: Shortest,
}

/// The shortest part of a step of Newton's that is tried where the whole step does not lower the value.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Shortest {
    /// 1/(1 + δ), with δ the decrement, which always goes well, but for rounding (Nesterov & Nemirovskii 1994): it is taken even if it does not lower the value.
    Damped,
    /// A share of the step.
    Share(f64),
}

/// The point that was reached, and whether the steps ended because none of them, or no derivative, could be had there.
pub(crate) struct Reached<P> {
    pub(crate) point: P,
    pub(crate) is_stuck: bool,
}

/// The minimum of a barrier near a point of its domain; `None` if the watch ends it, or the point is outside.
pub(crate) fn centre<B: Barrier>(barrier: &B, start: B::Point, steps: Steps, watch: &dyn Watch) -> Option<Reached<B::Point>> {
    let mut value = barrier.value(&start)?;
    let mut point = start;
    for _ in 0..steps.most {
        if watch.stops() {
            return None;
        }
        let Some((gradient, factor)) = barrier.derivatives(&point).and_then(|(gradient, hessian)| Some((gradient, cholesky(&hessian)?))) else {
            return Some(Reached { point, is_stuck: true });
        };
        let direction = solve(&factor, &gradient);
        let decrease: f64 = gradient.iter().zip(&direction).map(|(a, b)| a * b).sum();
        let decrement = decrease.max(0.0).sqrt();
        let damped = 1.0 / (1.0 + decrement);
        let mut length = 1.0;
        loop {
            let moved = barrier.moved(&point, &direction, -length);
            let (is_shortest, is_taken, shorter) = match steps.shortest {
                Shortest::Damped => (length <= damped, length <= damped, (0.5 * length).max(damped)),
                Shortest::Share(share) => (length < share, false, 0.5 * length),
            };
            match barrier.value(&moved).filter(|reached| *reached <= value - 0.1 * length * decrease || is_taken) {
                Some(reached) => {
                    (point, value) = (moved, reached);
                    break;
                }
                None if is_shortest => return Some(Reached { point, is_stuck: true }),
                None => length = shorter,
            }
        }
        if decrement < steps.centred {
            break;
        }
    }
    Some(Reached { point, is_stuck: false })
}

/// The logarithm of the determinant of RᵀR, for a triangle R.
pub(crate) fn log_determinant(triangle: &Matrix) -> f64 {
    2.0 * (0..triangle.rows()).map(|place| libm::log(triangle[(place, place)])).sum::<f64>()
}

/// The places of the upper triangle.
pub(crate) fn upper(size: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..size).flat_map(move |i| (i..size).map(move |j| (i, j)))
}
