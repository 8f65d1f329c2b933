//! The analysis of whole scenes.

mod anchors;
mod reduction;
