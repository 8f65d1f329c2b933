//! Pictures of analyses: maps, boundaries and admittances, of no size yet. Those of runs are in `cohaptic-harness`, which has their rows.

mod admittance;
mod axis;
mod boundary;
mod map;

pub use admittance::{AdmittanceCurve, AdmittanceWords, admittance_picture, admittance_words};
pub use axis::{axis_of, axis_of_key, label};
pub use boundary::{boundary_picture, crossing_in_words};
pub use map::{NamedMap, map_picture};
