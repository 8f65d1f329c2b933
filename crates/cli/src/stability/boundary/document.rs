//! The JSON document of a boundary.

use cohaptic_stability::Boundary;
use serde::Serialize;

use super::Order;

/// What `cohaptic stability boundary --json` prints.
#[derive(Serialize)]
pub(super) struct BoundaryDocument<'a> {
    title: &'a str,
    key: &'a str,
    unit: &'a str,
    low: f64,
    high: f64,
    /// By which radius the scene is judged.
    criterion: &'static str,
    /// The verdict at the lower end.
    first: &'static str,
    crossings: Vec<CrossingDocument>,
    marginal: Vec<StretchDocument>,
    tolerance: f64,
    samples: usize,
    finest: f64,
    coarsest: f64,
    settled: bool,
    /// How many of the values looked at are nominal.
    nominal: usize,
    notes: Vec<String>,
    files: &'a [String],
}

#[derive(Serialize)]
struct CrossingDocument {
    value: f64,
    from: &'static str,
    to: &'static str,
}

#[derive(Serialize)]
struct StretchDocument {
    low: f64,
    high: f64,
}

impl<'a> BoundaryDocument<'a> {
    pub(super) fn new(order: &'a Order, found: &Boundary, files: &'a [String]) -> Self {
        let crossings = found.crossings.iter();
        Self {
            title: &order.title,
            key: &order.range.key,
            unit: &order.range.unit,
            low: order.range.low,
            high: order.range.high,
            criterion: order.family.criterion().word(),
            first: found.first.word(),
            crossings: crossings
                .map(|crossing| CrossingDocument { value: crossing.value, from: crossing.from.word(), to: crossing.to.word() })
                .collect(),
            marginal: found.marginal.iter().map(|stretch| StretchDocument { low: stretch.low, high: stretch.high }).collect(),
            tolerance: order.options.tolerance,
            samples: found.samples,
            finest: found.finest,
            coarsest: found.coarsest,
            settled: found.is_settled(),
            nominal: found.nominal(),
            notes: super::notes(found),
            files,
        }
    }
}
