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
    /// Caption: agreement and differences with the paper.
    pub caption: String,
    /// Numbers of the paper and computed numbers.
    pub table: Table,
    /// Drawing as an SVG document with its own background, light or dark by the reader's preference.
    pub svg: String,
    /// Data of the drawing as CSV.
    pub csv: String,
}

/// A small table of text.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Table {
    /// Names of the columns.
    pub head: Vec<String>,
    /// Rows, each as long as `head`.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    fn new(head: &[&str]) -> Self {
        Self { head: head.iter().map(|cell| (*cell).to_owned()).collect(), rows: Vec::new() }
    }
}

/// Draws all figures in the given size, in the order of the paper.
pub(crate) fn all(atlas: &Atlas, responses: &Responses, tests: &[StabilityTest], travels: &[Travel], size: Size) -> Vec<Figure> {
    let mut figures = regions::figures(atlas, size);
    figures.push(bode::figure(responses, size));
    figures.extend(crate::experiment::DELAYS_MS.map(|delay_ms| stability_test::figure(tests, delay_ms, size)));
    figures.extend(crate::experiment::DELAYS_MS.map(|delay_ms| travel::figure(travels, delay_ms, size)));
    figures
}
