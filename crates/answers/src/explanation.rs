//! The JSON document about the modelled parts of a scene.

use cohaptic_harness::explain::Explanation;
use cohaptic_scene::Scene;
use serde::Serialize;

use crate::document;

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
