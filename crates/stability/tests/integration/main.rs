//! The analysis of whole scenes.

mod admittance;
mod anchors;
mod reduction;
