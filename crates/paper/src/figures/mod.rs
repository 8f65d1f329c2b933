//! Figures of the paper, computed anew.

pub(crate) mod admittance;
mod bode;
mod regions;
mod stability_test;
mod travel;

use cohaptic_picture::Size;

use crate::experiment::{StabilityTest, Travel};
use crate::region::Atlas;
use admittance::Responses;

/// A figure with its data.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Figure {
    /// Short name, also used in names of files.
    pub id: String,
    /// Title of the figure.
    pub title: String,
    /// Caption: what is drawn, and how it differs from the paper's drawing. The numbers stand in the tables of the claims.
    pub caption: String,
    /// Drawing as an SVG document with its own background, light or dark by the reader's preference.
    pub svg: String,
    /// Data of the drawing as CSV.
    pub csv: String,
}

/// Draws all figures in the given size, in the order of the paper.
pub(crate) fn all(atlas: &Atlas, responses: &Responses, tests: &[StabilityTest], travels: &[Travel], size: Size) -> Vec<Figure> {
    let mut figures = regions::figures(atlas, size);
    figures.push(bode::figure(responses, size));
    figures.extend(crate::experiment::DELAYS_MS.map(|delay_ms| stability_test::figure(tests, delay_ms, size)));
    figures.extend(crate::experiment::DELAYS_MS.map(|delay_ms| travel::figure(travels, delay_ms, size)));
    figures
}
