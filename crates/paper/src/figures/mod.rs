//! The figures of the paper again.

pub(crate) mod admittance;
mod bode;
mod regions;
mod stability_test;
mod travel;

use cohaptic_picture::Size;

use crate::experiment::{StabilityTest, Travel};
use crate::region::Atlas;
use admittance::Responses;

/// A figure with what belongs to it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Figure {
    /// A short name, also that of its files.
    pub id: String,
    /// What it shows.
    pub title: String,
    /// What agrees with the paper and what does not.
    pub caption: String,
    /// The paper's numbers, and the computed ones.
    pub table: Table,
    /// The drawing, an SVG document with a ground of its own, light or dark as its reader prefers.
    pub svg: String,
    /// The numbers behind it, as CSV.
    pub csv: String,
}

/// A small table.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Table {
    /// What stands above the columns.
    pub head: Vec<String>,
    /// The rows, each as long as the head.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    fn new(head: &[&str]) -> Self {
        Self { head: head.iter().map(|cell| (*cell).to_owned()).collect(), rows: Vec::new() }
    }
}

/// All figures, drawn in this size, in the order of the paper.
pub(crate) fn all(atlas: &Atlas, responses: &Responses, tests: &[StabilityTest], travels: &[Travel], size: Size) -> Vec<Figure> {
    let mut figures = regions::figures(atlas, size);
    figures.push(bode::figure(responses, size));
    figures.extend(crate::experiment::DELAYS_MS.map(|delay_ms| stability_test::figure(tests, delay_ms, size)));
    figures.extend(crate::experiment::DELAYS_MS.map(|delay_ms| travel::figure(travels, delay_ms, size)));
    figures
}
