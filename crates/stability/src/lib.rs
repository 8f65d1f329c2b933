//! Stability and performance of a scene, without simulating it.
//!
//! One frame of a linear scene, from one common sampling to the next, multiplies its state by a constant matrix, the *monodromy matrix*. The scene is
//! stable if and only if every eigenvalue of that matrix is inside the unit circle, once the motion of everything together is left out: space has no
//! origin. This crate builds that matrix from the same plants and strategies that the simulator steps (lifting: Araki & Yamamoto 1986; Rakhsha &
//! Constantinescu 2015, Section 3), reduces it where peers are alike, and says how sure it is of the answer.

mod analysis;
mod error;
mod full;
mod lifted;
mod matrix;
mod mean_square;
mod network;
mod parts;
mod radius;
mod spectrum;
mod structure;
mod timetable;

pub use analysis::{Analysis, ContactMode, Method, analyse, analyse_with};
pub use error::AnalysisError;
pub use matrix::Matrix;
pub use mean_square::{MeanSquare, MeanSquareMethod, mean_square};
pub use parts::{Part, PartKind};
pub use radius::{Radius, Verdict};
