//! Factorisations of matrices with results that are the same to the bit on every machine: they use no library that chooses instructions by the processor.

mod complement;
mod lu;
mod symmetric;

pub use complement::orthogonal_complement;
pub use lu::{Entry, Lu};
pub use symmetric::{cholesky, eigen, solve, triangle_inverse};
