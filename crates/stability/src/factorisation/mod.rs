//! Factorisations of matrices that are the same to the bit everywhere: no library that chooses its instructions by the processor takes part.

mod complement;
mod lu;
mod symmetric;

pub(crate) use complement::orthogonal_complement;
pub(crate) use lu::Lu;
pub(crate) use symmetric::{cholesky, eigen, solve, triangle_inverse};
