//! Vectors and matrices of three components.

use cohaptic_peer::rotation::{Matrix3, Triple};

pub(super) const IDENTITY: Matrix3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

pub(super) fn unit(axis: usize) -> Triple {
    IDENTITY[axis]
}

pub(super) fn add(a: Triple, b: Triple) -> Triple {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

pub(super) fn cross(a: Triple, b: Triple) -> Triple {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns A·v.
pub(super) fn apply(matrix: &Matrix3, vector: Triple) -> Triple {
    matrix.map(|row| row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2])
}

/// Returns \[a\], the matrix with \[a\]·b = a×b.
pub(super) fn skew([x, y, z]: Triple) -> Matrix3 {
    [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
}

pub(super) fn transposed(matrix: &Matrix3) -> Matrix3 {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[column][row]))
}

pub(super) fn product(a: &Matrix3, b: &Matrix3) -> Matrix3 {
    let b = transposed(b);
    std::array::from_fn(|row| std::array::from_fn(|column| (0..3).map(|k| a[row][k] * b[column][k]).sum()))
}

pub(super) fn sum(a: &Matrix3, b: &Matrix3) -> Matrix3 {
    std::array::from_fn(|row| std::array::from_fn(|column| a[row][column] + b[row][column]))
}

/// Returns tr A·I − A.
pub(super) fn trace_less(a: &Matrix3) -> Matrix3 {
    let trace = a[0][0] + a[1][1] + a[2][2];
    std::array::from_fn(|row| std::array::from_fn(|column| if row == column { trace } else { 0.0 } - a[row][column]))
}

/// Returns the axial vector of A − Aᵀ.
pub(super) fn twice_axial(a: &Matrix3) -> Triple {
    [a[2][1] - a[1][2], a[0][2] - a[2][0], a[1][0] - a[0][1]]
}

/// Returns the product q·p of two quaternions: the orientation q, turned by p in the body axes of q.
pub(super) fn turned([w, x, y, z]: [f64; 4], [a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [w * a - x * b - y * c - z * d, w * b + x * a + y * d - z * c, w * c + y * a + z * b - x * d, w * d + z * a + x * c - y * b]
}
