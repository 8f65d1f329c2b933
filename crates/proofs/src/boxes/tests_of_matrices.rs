//! Verdicts on boxes of matrices whose eigenvalues are known, and products of boxes.

use cohaptic_stability::Matrix;
use cohaptic_stability::numerics::real;
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use super::guarantee::Proven;
use super::mutation::{Mutation, with};
use super::span::{FrameSpan, StepSpan};
use super::steps::StepMatrix;
use super::tests::proven;

/// A shift register of samples has only eigenvalues that are zero, with a single eigenvector.
#[test]
fn a_matrix_without_eigenvalues_but_zero_is_stable() {
    let moves_on = Matrix::from_fn(5, 5, |row, column| if column == row + 1 { 3.0 } else { 0.0 });
    assert_eq!(proven(&StepSpan::of([StepMatrix { matrix: moves_on, error: 1e-14 }].iter())), Some(Proven::Stable));
    assert_eq!(proven(&StepSpan::of([StepMatrix { matrix: Matrix::zeros(2, 2), error: 0.0 }].iter())), Some(Proven::Stable));
}

/// The entries of this frame are so large that their squares overflow.
#[test]
fn a_matrix_whose_squares_overflow_is_unstable() {
    let of = Matrix::from_fn(3, 3, |i, j| if i <= j { 1e180 / real(1 + i + j) } else { 1e170 });
    assert_eq!(proven(&StepSpan::constant(of, 1)), Some(Proven::Unstable));
}

/// The diagonal stays and the entries beside it vary, with their sign: [a, s·b; s·c, d] has the eigenvalues (a + d)/2 ± √((a − d)²/4 + s²·b·c).
#[test]
fn entries_off_the_diagonal_that_vary_are_counted() {
    let decided = |a: f64, b: f64, c: f64, d: f64| {
        let at = |s: f64| StepMatrix { matrix: Matrix::from_fn(2, 2, |i, j| [[a, s * b], [s * c, d]][i][j]), error: 1e-15 };
        proven(&StepSpan::of([at(-1.0), at(1.0)].iter()))
    };
    // 0.9 in the middle and 0.9 ± 0.4 at the ends; ± 0.05 stays within.
    assert_eq!(decided(0.9, 0.4, 0.4, 0.9), None);
    assert_eq!(with(Some(Mutation::StillBeside), || decided(0.9, 0.4, 0.4, 0.9)), Some(Proven::Stable), "a prover that does not count them says so");
    assert_eq!(decided(0.9, 0.05, 0.05, 0.9), Some(Proven::Stable));
    // 1.1 in the middle, and a pair of modulus √0.8 at the ends; 1.1 · 0.5 + 0.01 leaves 1.083 outside.
    assert_eq!(decided(1.1, 0.5, -0.5, 0.5), None);
    assert_eq!(decided(1.1, 0.1, -0.1, 0.5), Some(Proven::Unstable));
}

fn matrix(size: usize) -> impl Strategy<Value = Matrix> {
    proptest::collection::vec(-1.0..1.0_f64, size * size).prop_map(move |entries| Matrix::from_fn(size, size, |i, j| entries[i * size + j]))
}

properties! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Products over a box enclose the products of its matrices, wherever in the box.
    #[test]
    fn products_enclose(
        steps in proptest::collection::vec((matrix(3), matrix(3), matrix(3), matrix(3)), 1..5),
        width in 0.0..0.3_f64,
        at in (-1.0..=1.0_f64, -1.0..=1.0_f64),
    ) {
        let mut exact = Matrix::identity(3);
        let mut spans = Vec::new();
        for (mean, one, other, both) in &steps {
            let there = |s: f64, t: f64| Matrix::from_fn(3, 3, |i, j| mean[(i, j)] + width * (s * one[(i, j)] + t * other[(i, j)] + s * t * both[(i, j)]));
            let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(s, t)| StepMatrix { matrix: there(s, t), error: 1e-14 });
            spans.push(StepSpan::of(corners.iter()));
            exact = there(at.0, at.1).times(&exact);
        }
        let product = FrameSpan::of(spans).product();
        for i in 0..3 {
            for j in 0..3 {
                let near = product.mean[(i, j)] + at.0 * product.slopes[0][(i, j)] + at.1 * product.slopes[1][(i, j)];
                prop_assert!((exact[(i, j)] - near).abs() <= product.radius[(i, j)] + 1e-13, "{i} {j}: {} is not within {} of {near}", exact[(i, j)], product.radius[(i, j)]);
            }
        }
    }

    /// A verdict on a box holds for each of its matrices, near the unit circle above all.
    #[test]
    fn decisions_hold(mean in matrix(4), slope in matrix(4), width in 0.0..0.05_f64, radius in 0.8..1.25_f64, at in -1.0..=1.0_f64) {
        let scale = radius / cohaptic_stability::radius(&mean);
        let there = |s: f64| Matrix::from_fn(4, 4, |i, j| scale * mean[(i, j)] + s * width * slope[(i, j)]);
        let corners = [-1.0, 1.0].map(|s| StepMatrix { matrix: there(s), error: 1e-15 });
        let span = StepSpan::of(corners.iter());
        for s in [-1.0, -0.5, 0.0, 0.5, 1.0, at] {
            let found = cohaptic_stability::radius(&there(s));
            match proven(&span) {
                Some(Proven::Stable) => prop_assert!(found < 1.0 + 1e-9, "{found} at {s}"),
                Some(Proven::Unstable) => prop_assert!(found > 1.0 - 1e-9, "{found} at {s}"),
                None => {}
            }
        }
    }
}
