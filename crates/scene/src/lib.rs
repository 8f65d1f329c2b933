//! Scene files.
mod model;
pub use model::*;
