//! The analysis of whole scenes.

mod anchors;
mod graphs;
mod reduction;
mod strategies;
