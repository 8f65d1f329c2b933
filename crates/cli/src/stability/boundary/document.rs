//! The JSON document of a boundary.

use cohaptic_stability::Boundary;
use serde::Serialize;

use super::Order;
use crate::document_schema::document;

/// The answer of `cohaptic stability boundary --json`.
pub(super) fn of(order: &Order, found: &Boundary, files: &[String]) -> impl Serialize {
    let crossings = found.crossings.iter();
    document! {
        title: order.title.as_str(),
        key: order.range.key.as_str(),
        unit: order.range.unit.as_str(),
        low: order.range.low,
        high: order.range.high,
        // By which radius the scene is judged.
        criterion: order.family.criterion().word(),
        // The verdict at the lower end.
        first: found.first.word(),
        crossings: crossings.map(|crossing| document! { value: crossing.value, from: crossing.from.word(), to: crossing.to.word() }).collect::<Vec<_>>(),
        marginal: found.marginal.iter().map(|stretch| document! { low: stretch.low, high: stretch.high }).collect::<Vec<_>>(),
        tolerance: order.options.tolerance,
        samples: found.samples,
        finest: found.finest,
        coarsest: found.coarsest,
        settled: found.is_settled(),
        // How many of the values looked at are nominal.
        nominal: found.nominal(),
        notes: super::notes(found),
        files: files,
    }
}
