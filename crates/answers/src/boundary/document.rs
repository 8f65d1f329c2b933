//! The JSON document of a boundary.

use serde::Serialize;

use super::Searched;
use crate::document;
use crate::parts::judged;

/// Returns the answer of `cohaptic stability boundary --json`. `files`: paths of the written files.
pub fn document(searched: &Searched<'_>, files: &[String]) -> impl Serialize {
    let found = searched.found;
    let crossings = found.crossings.iter();
    document! {
        title: searched.title,
        key: searched.range.key.as_str(),
        unit: searched.range.unit.as_str(),
        low: searched.range.low,
        high: searched.range.high,
        // The radius by which the scene is judged.
        criterion: searched.family.criterion().word(),
        // The verdict at the lower end.
        first: found.first.word(),
        crossings: crossings.map(|crossing| document! { value: crossing.value, from: crossing.from.word(), to: crossing.to.word() }).collect::<Vec<_>>(),
        marginal: found.marginal.iter().map(|stretch| document! { low: stretch.low, high: stretch.high }).collect::<Vec<_>>(),
        tolerance: searched.options.tolerance,
        samples: found.samples,
        finest: found.finest,
        coarsest: found.coarsest,
        settled: found.is_settled(),
        // Number of nominal values among the sampled values.
        nominal: found.nominal(),
        // Counts of the sampled values, by the question answered by their verdicts.
        verdicts: searched.kinds().present().map(|(kind, count)| judged(kind, count, searched.stable_fraction(kind))).collect::<Vec<_>>(),
        // Random parts of the links left out by nominal values; empty without nominal values.
        left_out: if found.nominal() > 0 { searched.family.left_out() } else { &[] },
        notes: searched.notes(),
        files: files,
    }
}
