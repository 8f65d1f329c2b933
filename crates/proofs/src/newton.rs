//! Newton's method on a barrier: the solver that all searches of shapes and multipliers use.
//!
//! A barrier is a convex function that grows beyond all bounds at the edge of its domain, so that the minimum of the function, the *centre*, lies well within
//! the domain. Two searches follow centres: the search for matrix inequalities ([`inequality`](crate::inequality)) while the weight of a margin grows, and the
//! search for quadratic certificates ([`worst_case`](crate::worst_case)) while a rate falls. No proof depends on the correctness of this module, because the
//! callers check each point that the solver finds.

use cohaptic_stability::numerics::{cholesky, solve};
use cohaptic_stability::{Matrix, Watch};

/// A barrier: a convex function of points, with derivatives.
pub(crate) trait Barrier {
    /// A point of the space that contains the domain.
    type Point;

    /// Returns the value of the barrier at `point`, or `None` outside of the domain.
    fn value(&self, point: &Self::Point) -> Option<f64>;

    /// Returns the gradient and the Hessian at `point`; only the upper triangle of the Hessian is read. `None` where rounding makes a factorisation fail.
    fn derivatives(&self, point: &Self::Point) -> Option<(Vec<f64>, Matrix)>;

    /// Returns `point` + `length`·`direction`, with `direction` in the coordinates of the gradient.
    fn moved(&self, point: &Self::Point, direction: &[f64], length: f64) -> Self::Point;
}

/// The limits of Newton's steps towards one centre.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Steps {
    /// Largest number of steps to a centre.
    pub(crate) most: u32,
    /// Newton's decrement below which a step is the last step.
    pub(crate) centred: f64,
    /// Shortest part of a step that the line search tries.
    pub(crate) shortest: Shortest,
}

/// The shortest part of a Newton step that the line search tries where the whole step does not lower the value.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Shortest {
    /// 1/(1 + δ), with δ the decrement. Without rounding this part of a step always lowers the value (Nesterov & Nemirovskii 1994), so the line search takes
    /// the part even if the computed value does not fall.
    Damped,
    /// A share of the whole step, between 0 and 1. The search is stuck if no longer part lowers the value.
    Share(f64),
}

/// The last point of the steps. `is_stuck` says that the steps ended there because the derivatives failed or no part of the next step lowered the value.
pub(crate) struct Reached<P> {
    pub(crate) point: P,
    pub(crate) is_stuck: bool,
}

/// Returns the point that Newton's steps reach from `start` towards the minimum of `barrier`, or `None` if the watch ends the search or `start` lies outside of
/// the domain.
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
        // Backtracking: a step ends when the value falls by a tenth of the linear prediction, which keeps every point within the domain as well.
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
                // A shorter part than the limit is never tried, so the loop ends.
                None if is_shortest => return Some(Reached { point, is_stuck: true }),
                None => length = shorter,
            }
        }
        // The decrement belongs to the point before the step, which was near enough already: the last step only brings the point nearer.
        if decrement < steps.centred {
            break;
        }
    }
    Some(Reached { point, is_stuck: false })
}

/// Returns the natural logarithm of the determinant of RᵀR, for a triangle R with a positive diagonal.
pub(crate) fn log_determinant(triangle: &Matrix) -> f64 {
    2.0 * (0..triangle.rows()).map(|place| libm::log(triangle[(place, place)])).sum::<f64>()
}

/// Returns the places (i, j), i <= j, of the upper triangle of a square matrix with `size` rows, row by row.
pub(crate) fn upper(size: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..size).flat_map(move |i| (i..size).map(move |j| (i, j)))
}
