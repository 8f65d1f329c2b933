//! Factorisations of matrices that are the same to the bit everywhere: no library that chooses its instructions by the processor takes part.

mod complement;
mod lu;
mod symmetric;

pub use complement::orthogonal_complement;
pub use lu::{Entry, Lu};
pub use symmetric::{cholesky, eigen, solve, triangle_inverse};
