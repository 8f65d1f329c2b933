//! Faults that tests put into proofs, to see that the tests notice a prover with such a fault.

use std::cell::Cell;

use cohaptic_stability::Matrix;
use cohaptic_stability::numerics::ComplexMatrix;
use num_complex::Complex64;

use super::discs::NearlyDiagonal;
use super::span::StepSpan;

/// A fault in a prover. Faults in the structure of a scene are in [`super::points`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Mutation {
    /// Slopes are halved, as if boxes reached half as far as they do.
    HalfTheBox,
    /// All slopes but the first are zero, as if the other numbers of a box stayed at their middles.
    OneNumber,
    /// Radii in nearly diagonal coordinates are zero, as if nothing were of the second order.
    FirstOrder,
    /// Slopes of diagonal entries are zero: the entries stay where they are in the middle of the box.
    StillDiagonal,
    /// Slopes of entries off the diagonal are zero: the entries stay where they are in the middle of the box.
    StillBeside,
}

thread_local! {
    static NOW: Cell<Option<Mutation>> = const { Cell::new(None) };
}

/// Runs a function with the fault in all proofs of this thread, and returns its result. The fault is removed afterwards.
pub(super) fn with<T>(mutation: Option<Mutation>, run: impl FnOnce() -> T) -> T {
    NOW.set(mutation);
    let result = run();
    NOW.set(None);
    result
}

/// Returns the steps of a frame over a box with the fault of this thread, if the fault concerns steps.
pub(super) fn of_steps(mut steps: Vec<StepSpan>) -> Vec<StepSpan> {
    for step in &mut steps {
        match NOW.get() {
            Some(Mutation::HalfTheBox) => step.slopes.iter_mut().for_each(|slope| *slope = slope.scaled(0.5)),
            Some(Mutation::OneNumber) => step.slopes.iter_mut().skip(1).for_each(|slope| *slope = slope.scaled(0.0)),
            _ => {}
        }
    }
    steps
}

/// Returns a frame in nearly diagonal coordinates with the fault of this thread, if the fault concerns such coordinates.
pub(super) fn of_discs(mut near: NearlyDiagonal) -> NearlyDiagonal {
    let kept = |keep: &dyn Fn(usize, usize) -> bool, slope: &ComplexMatrix| {
        ComplexMatrix::from_fn(slope.rows(), slope.columns(), |i, j| if keep(i, j) { slope[(i, j)] } else { Complex64::ZERO })
    };
    match NOW.get() {
        Some(Mutation::FirstOrder) => near.wide = Matrix::zeros(near.wide.rows(), near.wide.columns()),
        Some(Mutation::StillDiagonal) => near.slopes.iter_mut().for_each(|slope| *slope = kept(&|i, j| i != j, slope)),
        Some(Mutation::StillBeside) => near.slopes.iter_mut().for_each(|slope| *slope = kept(&|i, j| i == j, slope)),
        _ => {}
    }
    near
}
