//! Linear algebra that is the same to the bit everywhere, and bounds of what it rounds, for crates that prove something with it: `cohaptic-proofs`.

pub use crate::definite::is_positive;
pub use crate::factorisation::{Entry, Lu, cholesky, eigen, orthogonal_complement, solve, triangle_inverse};
pub use crate::matrix::ComplexMatrix;
pub use crate::rounding::{UNDERFLOW, UNIT, gamma, outward, real};
pub use crate::spectrum::eigenvector;
