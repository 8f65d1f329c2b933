//! Pictures of analyses without a size: maps, boundaries and admittances. The pictures of runs are in `cohaptic-harness`, where their rows are made.

mod admittance;
mod axis;
mod boundary;
mod map;

pub use admittance::{AdmittanceCurve, admittance_picture};
pub(crate) use admittance::{AdmittanceWords, admittance_words};
pub use axis::axis_of;
pub(crate) use axis::{axis_of_key, label};
pub use boundary::boundary_picture;
pub(crate) use boundary::crossing_in_words;
pub use map::{NamedMap, map_picture};
