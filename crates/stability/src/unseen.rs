//! Waves that bounce to and fro between copies and move nothing.
//!
//! Three copies or more can get waves whose forces add up to zero: (1, −1) at the first copy, (1, −1) at the second, (1, −1) at the third, again and again.
//! Such waves last forever over links that lose nothing. No body feels such waves, and they never arise from waves at zero. So they are no part of the motion
//! of the scene, and their eigenvalues, of modulus 1, say nothing about stability. The analysis keeps the largest quotient in which every state is felt.

use crate::factorisation::orthogonal_complement;
use crate::{Matrix, StateKind, StateName};

/// Length, relative to the largest entry, below which the part of a row orthogonal to other rows counts as zero: the row is then spanned by the other rows. The
/// length is far above rounding, and far below the share of one tick in a wave. The returned error covers such parts.
const NOTHING: f64 = 1e-9;

/// Returns the part of a matrix in which a body feels every state, and the error that the reduction adds to the entries. `forces` has the contribution of each
/// state (column) to each force of the frame (row).
pub(crate) fn felt(matrix: &Matrix, forces: &Matrix, states: &[StateName]) -> (Matrix, f64) {
    let size = matrix.rows();
    let hidden: Vec<usize> = (0..size).filter(|state| is_hidden(states[*state].kind)).collect();
    if !matrix.is_finite() || !forces.is_finite() {
        return (matrix.clone(), 0.0);
    }
    let chosen = |of: &Matrix| Matrix::from_fn(of.rows(), hidden.len(), |row, column| of[(row, hidden[column])]);
    let scale = chosen(matrix).largest();
    // Each round shrinks a subspace whose states cause no force, until a frame maps the subspace into itself. The result is the largest such subspace
    // (Wonham 1985, Section 4.3).
    let forces = chosen(forces);
    let silent = null_space(&forces, forces.largest());
    let mut unfelt = Matrix::from_fn(size, hidden.len(), |row, column| if hidden[column] == row { 1.0 } else { 0.0 }).times(&silent);
    loop {
        if unfelt.columns() == 0 {
            return (matrix.clone(), 0.0);
        }
        let reached = matrix.times(&unfelt);
        let within = unfelt.times(&unfelt.transposed().times(&reached));
        let outside = Matrix::from_fn(size, unfelt.columns(), |row, column| reached[(row, column)] - within[(row, column)]);
        let inside = null_space(&outside, scale);
        if inside.columns() == unfelt.columns() {
            let other = null_space(&unfelt.transposed(), 1.0);
            let quotient = other.transposed().times(&matrix.times(&other));
            // The error has two parts: the rounding of the products, and the small part of the subspace that a frame maps out of the subspace.
            let error = f64::EPSILON * crate::rounding::real(size) * matrix.frobenius_norm() + outside.frobenius_norm();
            return (quotient, error);
        }
        unfelt = unfelt.times(&inside);
    }
}

/// Returns whether bodies feel a state only through later forces of strategies. Memory and samples are such states. Positions, velocities, pending forces,
/// exchanges with devices and the memory of an operator are not.
const fn is_hidden(kind: StateKind) -> bool {
    match kind {
        StateKind::DevicePosition { .. }
        | StateKind::DeviceVelocity { .. }
        | StateKind::ObjectPosition { .. }
        | StateKind::ObjectVelocity { .. }
        | StateKind::PendingCoupling { .. }
        | StateKind::PendingForce { .. }
        | StateKind::LatestPosition { .. }
        | StateKind::LatestVelocity { .. }
        | StateKind::ReadingPosition { .. }
        | StateKind::ReadingVelocity { .. }
        | StateKind::KeptCoupling { .. }
        | StateKind::WantedPosition { .. }
        | StateKind::SeenPosition { .. } => false,
        StateKind::Memory { .. }
        | StateKind::SamplePosition { .. }
        | StateKind::SampleVelocity { .. }
        | StateKind::SampleForce { .. }
        | StateKind::SampleWave { .. } => true,
    }
}

/// Returns an orthonormal basis, as columns, of the null space of a matrix: the vectors orthogonal to its rows.
fn null_space(matrix: &Matrix, scale: f64) -> Matrix {
    let rows = (0..matrix.rows()).map(|row| matrix.row(row).to_vec()).collect();
    orthogonal_complement(rows, matrix.columns(), NOTHING * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(kinds: &[StateKind]) -> Vec<StateName> {
        kinds.iter().map(|kind| StateName { peer: 0, kind: *kind }).collect()
    }

    /// A body that halves and feels a + b, where a becomes −b and b becomes −a: a − b goes on forever unfelt, a + b alternates and is felt.
    #[test]
    fn what_moves_no_body_is_left_out() {
        let rows = [[0.5, 0.25, 0.25], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]];
        let states = named(&[StateKind::ObjectVelocity { axis: 0 }, StateKind::Memory { number: 0 }, StateKind::Memory { number: 1 }]);
        let forces = Matrix::from_fn(1, 3, |_, column| rows[0][column]);
        let (left, error) = felt(&Matrix::from_fn(3, 3, |row, column| rows[row][column]), &forces, &states);
        let found = crate::eigenvalues(&left);
        assert_eq!(found.len(), 2);
        for (found, expected) in found.iter().zip([-1.0, 0.5]) {
            assert!((found - expected).norm() < 1e-14 + error && error < 1e-14, "{found} within {error:e}");
        }
    }

    #[test]
    fn what_is_felt_late_or_little_stays() {
        // The last moves the one before it, by a millionth, and only that one moves the body.
        let rows = [[0.5, 1.0, 0.0], [0.0, 0.0, 1e-6], [0.0, 0.0, 0.9]];
        let states = named(&[StateKind::ObjectPosition { axis: 0 }, StateKind::Memory { number: 0 }, StateKind::Memory { number: 1 }]);
        let matrix = Matrix::from_fn(3, 3, |row, column| rows[row][column]);
        let forces = Matrix::from_fn(1, 3, |_, column| rows[0][column]);
        assert_eq!(felt(&matrix, &forces, &states), (matrix, 0.0));
    }
}
