//! Shapes by an iteration of first order, for states of any size.
//!
//! An ideal shape of a node is an upper bound, in the order of symmetric matrices, of AᵀP_to A/ρ² over all edges from it. Two symmetric matrices have no
//! least upper bound, but an upper bound of smallest volume: in coordinates where one matrix is I and the other is diagonal, the larger of both entries in
//! every place of the diagonal. Taking this bound in every round is a power iteration (Gaubert & Stott 2020, "Tropical Kraus maps for optimal control of
//! switched systems"). Each round goes half the way to the bound, so that the iteration does not cycle. The result is the shapes of the round with the smallest
//! rate.

use cohaptic_stability::numerics::{cholesky, eigen, triangle_inverse};
use cohaptic_stability::{Matrix, Watch};

use super::component::{Component, Factors, largest_square};
use super::norm::gram;

/// Lower limit of the bound in a round, in directions in which no edge needs a larger bound. Shapes stay positive definite by this limit.
const FLOOR: f64 = 0.25;

/// Returns the shapes with the smallest rate of all rounds, beginning with balanced shapes; `None` if the watch ends the iteration.
pub(super) fn iterate(component: &Component<'_>, rounds: usize, watch: &dyn Watch) -> Option<Factors> {
    let identity = Matrix::identity(component.size);
    let mut factors = vec![balance(component); component.nodes.len()];
    let mut best = Factors { square: f64::INFINITY, factors: factors.clone() };
    for _ in 0..rounds {
        if watch.stops() {
            return None;
        }
        let Some(images) = component.images(&factors) else { break };
        let square = largest_square(&images);
        if square < best.square {
            best = Factors { square, factors: factors.clone() };
        }
        // The bounds below are divided by `square`. Written so that NaN ends the iteration too.
        if !(square > f64::MIN_POSITIVE && square.is_finite()) {
            break;
        }
        let mut bounds = vec![Some(identity.scaled(FLOOR)); factors.len()];
        for (step, image) in component.edges.iter().zip(&images) {
            bounds[step.from] = bounds[step.from].as_ref().and_then(|bound| join(bound, &gram(image).scaled(1.0 / square)));
        }
        // In the coordinates of the present shapes each shape is I, so the mean of I and the bound is half the way.
        for (factor, bound) in factors.iter_mut().zip(&bounds) {
            let half = bound.as_ref().map(|bound| Matrix::from_fn(component.size, component.size, |i, j| 0.5 * (identity[(i, j)] + bound[(i, j)])));
            let Some(change) = half.as_ref().and_then(cholesky) else { return Some(best) };
            *factor = change.times(factor);
        }
    }
    Some(best)
}

/// Returns units of the state's entries, powers of two on a diagonal matrix, in which the rows and columns of all matrices together are of similar size
/// (Osborne 1960). Powers of two change no digit of the matrices.
fn balance(component: &Component<'_>) -> Matrix {
    const SWEEPS: u32 = 40;
    let size = component.size;
    let mut units = vec![1.0; size];
    let together = Matrix::from_fn(size, size, |i, j| component.edges.iter().map(|step| step.matrix[(i, j)].abs()).fold(0.0, f64::max));
    for _ in 0..SWEEPS {
        let mut changed = false;
        for place in 0..size {
            let others = || (0..size).filter(|other| *other != place);
            let row: f64 = others().map(|other| together[(place, other)] * units[place] / units[other]).sum();
            let column: f64 = others().map(|other| together[(other, place)] * units[other] / units[place]).sum();
            let ratio = column / row;
            // A row or a column of zeros cannot be balanced. Written so that NaN is skipped too.
            if !(ratio > 0.0 && ratio.is_finite()) {
                continue;
            }
            let halvings = libm::frexp(ratio.sqrt() * std::f64::consts::FRAC_1_SQRT_2).1;
            let unit: f64 = units[place] * libm::ldexp(1.0, halvings);
            // The shapes are squares of the units and must neither overflow nor underflow.
            if halvings != 0 && (1e-100..1e100).contains(&unit) {
                units[place] = unit;
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    Matrix::from_fn(size, size, |i, j| if i == j { units[i] } else { 0.0 })
}

/// Returns the upper bound of smallest volume of two symmetric matrices, the first of which is positive definite. `None` if `first` is not positive definite,
/// by rounding.
fn join(first: &Matrix, second: &Matrix) -> Option<Matrix> {
    let factor = cholesky(first)?;
    let inverse = triangle_inverse(&factor);
    let (values, vectors) = eigen(&inverse.transposed().times(&second.times(&inverse)));
    let roots = vectors.times(&factor);
    let raised = Matrix::from_fn(roots.rows(), roots.columns(), |i, j| values[i].max(1.0).sqrt() * roots[(i, j)]);
    Some(gram(&raised))
}

#[cfg(test)]
mod tests {
    use super::super::component::Step;
    use super::*;

    #[test]
    fn balanced_units_undo_units() {
        let plain = Matrix::from_fn(3, 3, |i, j| if i == j { 0.1 } else { 0.5 });
        let units = [1e-7, 1.0, 3e6];
        let matrix = Matrix::from_fn(3, 3, |i, j| plain[(i, j)] * units[i] / units[j]);
        let component = Component { size: 3, nodes: vec![0], edges: vec![Step { from: 0, to: 0, matrix: &matrix }] };
        let balanced = component.images(&[balance(&component)]).unwrap();
        assert!(balanced[0].entries().iter().all(|entry| (0.05..=2.0).contains(entry)), "{balanced:?}");
    }

    #[test]
    fn a_join_is_above_both_and_touches_both() {
        let first = Matrix::from_fn(2, 2, |i, j| [[4.0, 0.0], [0.0, 1.0]][i][j]);
        let second = Matrix::from_fn(2, 2, |i, j| [[1.0, 0.0], [0.0, 9.0]][i][j]);
        let joined = join(&first, &second).unwrap();
        assert!((joined[(0, 0)] - 4.0).abs() < 1e-12 && (joined[(1, 1)] - 9.0).abs() < 1e-12 && joined[(0, 1)].abs() < 1e-12);
        let tilted = Matrix::from_fn(2, 2, |i, j| [[2.0, 1.5], [1.5, 2.0]][i][j]);
        let joined = join(&first, &tilted).unwrap();
        for below in [&first, &tilted] {
            let (values, _) = eigen(&Matrix::from_fn(2, 2, |i, j| joined[(i, j)] - below[(i, j)]));
            assert!(values.iter().all(|value| *value > -1e-12) && values.iter().any(|value| value.abs() < 1e-12), "{values:?}");
        }
    }
}
