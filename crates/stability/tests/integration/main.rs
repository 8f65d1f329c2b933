//! The analysis of whole scenes.

mod admittance;
mod anchors;
mod graphs;
mod reduction;
mod strategies;
