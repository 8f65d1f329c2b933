//! The JSON document about the modelled parts of a scene, with measured costs if there are any.

use cohaptic_harness::explain::Explanation;
use cohaptic_scene::Scene;
use serde::Serialize;

use crate::document;
use crate::methods::{Measured, MeasuredMethod};

/// Returns the modelled parts of a scene, the parts left out, and the cost of a run.
pub fn explanation(scene: &Scene, explanation: &Explanation) -> impl Serialize {
    let Explanation { models, left_out, dimensions, cost } = explanation;
    document! {
        title: scene.title.as_str(),
        models: models.iter().map(|row| document! { part: &*row.part, model: &*row.model, reason: &*row.reason }).collect::<Vec<_>>(),
        left_out: left_out.as_slice(),
        dimensions: document! { plant: dimensions.plant, held: dimensions.held, in_flight: dimensions.in_flight },
        cost: document! {
            peer_ticks_per_s: cost.peer_ticks_per_s,
            packets_per_s: cost.packets_per_s,
            realtime_factor: cost.realtime_factor,
            record_bytes_per_s: cost.record_bytes_per_s,
        },
    }
}

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
