//! Vectors and matrices of three, for torques and attitudes.

use core::array::from_fn;

use super::{Matrix3, Triple};
use crate::Number;

#[inline(always)]
pub(super) fn add<N: Number>(a: Triple<N>, b: Triple<N>) -> Triple<N> {
    from_fn(|i| a[i] + b[i])
}

#[inline(always)]
pub(super) fn subtract<N: Number>(a: Triple<N>, b: Triple<N>) -> Triple<N> {
    from_fn(|i| a[i] - b[i])
}

/// Returns the vector of the products a₁·b₁, a₂·b₂ and a₃·b₃.
#[inline(always)]
pub(super) fn by_component<N: Number>(a: Triple<N>, b: Triple<N>) -> Triple<N> {
    from_fn(|i| a[i] * b[i])
}

#[inline(always)]
pub(super) fn scale<N: Number>(a: Triple<N>, factor: N) -> Triple<N> {
    a.map(|component| component * factor)
}

#[inline(always)]
pub(super) fn dot<N: Number>(a: Triple<N>, b: Triple<N>) -> N {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn cross<N: Number>(a: Triple<N>, b: Triple<N>) -> Triple<N> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns A·v.
#[inline(always)]
pub(super) fn apply<N: Number>(matrix: &Matrix3<N>, vector: Triple<N>) -> Triple<N> {
    from_fn(|row| dot(matrix[row], vector))
}

/// Returns Aᵀ·v.
#[inline(always)]
pub(super) fn apply_transposed<N: Number>(matrix: &Matrix3<N>, vector: Triple<N>) -> Triple<N> {
    from_fn(|column| matrix[0][column] * vector[0] + matrix[1][column] * vector[1] + matrix[2][column] * vector[2])
}

/// Returns Aᵀ·B.
#[inline(always)]
pub(super) fn transposed_product<N: Number>(a: &Matrix3<N>, b: &Matrix3<N>) -> Matrix3<N> {
    from_fn(|row| from_fn(|column| a[0][row] * b[0][column] + a[1][row] * b[1][column] + a[2][row] * b[2][column]))
}

/// Returns the axial vector of A − Aᵀ, which is twice the axial vector of the skew part of A.
#[inline(always)]
pub(super) fn twice_axial<N: Number>(a: &Matrix3<N>) -> Triple<N> {
    [a[2][1] - a[1][2], a[0][2] - a[2][0], a[1][0] - a[0][1]]
}
