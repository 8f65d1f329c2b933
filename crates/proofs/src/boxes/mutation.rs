//! What tests make wrong in proofs, to see that they would notice it.

use std::cell::Cell;

use cohaptic_stability::Matrix;
use cohaptic_stability::numerics::ComplexMatrix;
use num_complex::Complex64;

use super::discs::NearlyDiagonal;
use super::span::StepSpan;

/// A fault in a prover. Those of the structure of a scene are in [`super::points`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Mutation {
    /// Boxes reach half as far as they do.
    HalfTheBox,
    /// The second number of a box stays at its middle.
    OneNumber,
    /// Nothing is of the second order.
    FirstOrder,
    /// Diagonal entries stay where they are in the middle of the box.
    StillDiagonal,
    /// Entries beside the diagonal stay where they are in the middle of the box.
    StillBeside,
}

thread_local! {
    static NOW: Cell<Option<Mutation>> = const { Cell::new(None) };
}

/// What comes out with a fault in all proofs of this thread.
pub(super) fn with<T>(mutation: Option<Mutation>, run: impl FnOnce() -> T) -> T {
    NOW.set(mutation);
    let result = run();
    NOW.set(None);
    result
}

/// The steps of a frame over a box.
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

/// A frame over a box in coordinates in which it is nearly diagonal.
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
