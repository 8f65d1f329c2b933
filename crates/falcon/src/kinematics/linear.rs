//! Linear equations with three unknowns.

use super::Triple;

/// Solves `matrix · x = right`. The result is not finite for a singular matrix.
pub(super) fn solve(matrix: &[Triple; 3], right: Triple) -> Triple {
    let [a, b, c] = *matrix;
    // Cramer's rule: the columns of the inverse are cross products of rows, divided by the determinant.
    let (bc, ca, ab) = (cross(b, c), cross(c, a), cross(a, b));
    let determinant = dot(a, bc);
    core::array::from_fn(|axis| (bc[axis] * right[0] + ca[axis] * right[1] + ab[axis] * right[2]) / determinant)
}

pub(super) const fn transposed(m: &[Triple; 3]) -> [Triple; 3] {
    [[m[0][0], m[1][0], m[2][0]], [m[0][1], m[1][1], m[2][1]], [m[0][2], m[1][2], m[2][2]]]
}

pub(super) const fn dot(a: Triple, b: Triple) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

const fn cross(a: Triple, b: Triple) -> Triple {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn norm(a: Triple) -> f64 {
    libm::sqrt(dot(a, a))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solutions_solve() {
        let matrix = [[2.0, 1.0, -1.0], [0.5, -3.0, 2.0], [1.0, 1.0, 4.0]];
        let x = [1.0, -2.0, 0.25];
        let right = matrix.map(|row| dot(row, x));
        for (found, wanted) in solve(&matrix, right).into_iter().zip(x) {
            assert!((found - wanted).abs() < 1e-14);
        }
        assert!(solve(&[[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [0.0, 0.0, 1.0]], [1.0; 3]).iter().any(|x| !x.is_finite()));
    }
}
