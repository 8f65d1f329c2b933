//! The JSON document of an explanation with measured costs.

use cohaptic_harness::explain::Explanation;
use cohaptic_scene::Scene;
use serde::Serialize;

use super::{Measured, MeasuredMethod};
use crate::{document, explanation};

/// Returns the explanation of a scene, extended by the measured costs and errors if there are any.
pub fn explanation_with_costs<'a>(scene: &'a Scene, found: &'a Explanation, measured: Option<&'a Measured>) -> impl Serialize + 'a {
    document! {
        #[serde(flatten)] explanation: explanation(scene, found),
        #[serde(flatten)] measured: measured.map(|measured| document! {
            cost_measured: measured.methods.iter().map(method).collect::<Vec<_>>(),
            cost_span_s: measured.span.as_secs_f64(),
            interrupted: measured.interrupted,
        }),
    }
}

fn method(method: &MeasuredMethod) -> impl Serialize + '_ {
    document! {
        kind: method.kind.word(),
        method: method.name.as_str(),
        option: method.option.as_str(),
        chosen: method.chosen,
        cost_ms: method.cost_ms,
        cost_of: method.kind.cost_of(),
        error: method.error,
        error_of: method.kind.error_of(),
        error_unit: method.kind.error_unit(),
        reference: method.reference.as_deref(),
        note: method.note.as_str(),
    }
}
