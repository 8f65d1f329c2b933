//! The analysis of whole scenes.

mod admittance;
mod anchors;
mod graphs;
mod mean_square;
mod reduction;
mod strategies;
