//! The second moment of equal peers over a frame, as an operator that maps positive matrices to positive ones, for crates that prove something of it:
//! `cohaptic-proofs`.

pub use crate::mean_square::Independent;
pub use crate::mean_square::arrivals::{Hazard, Hazards};
pub use crate::mean_square::positive::{Positive, is_definite, is_indefinite, leaves_less, radius_watched, solution};
pub use crate::mean_square::symmetric::Symmetric;
