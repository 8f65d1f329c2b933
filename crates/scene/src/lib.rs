//! Scene files.
mod model;
mod scaling;
pub use model::*;
