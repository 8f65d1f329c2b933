//! The JSON document of a fitted link.

use serde::Serialize;

use super::{Answered, Kind};
use crate::document;

/// Returns the answer of `cohaptic fit --json`.
pub fn document(answered: &Answered) -> impl Serialize {
    let (estimate, recorded) = match &answered.kind {
        Kind::Estimated(estimate) => (Some(&**estimate), None),
        Kind::Recorded(recording) => (None, Some(recording)),
    };
    document! {
        // A flattened `None` writes no key, so estimated and recorded links each have only their own keys.
        #[serde(flatten)]
        fitted: estimate.map(|estimate| &estimate.fitted),
        #[serde(flatten)]
        recorded: recorded.map(|recording| document! { recorded: recording }),
        // The keys of a scene.
        scene: answered.scene.as_str(),
        #[serde(flatten)]
        skew: estimate.and_then(|estimate| estimate.skew.as_ref()).map(|skew| document! { skew: skew }),
        #[serde(flatten)]
        matched: estimate.and_then(|estimate| estimate.matched.as_ref()).map(|matched| document! { matched: matched }),
        #[serde(flatten)]
        measured_by: estimate.and_then(|estimate| estimate.probed.as_ref()).map(|probed| document! { measured_by: probed }),
        #[serde(flatten)]
        hold_out: estimate.and_then(|estimate| estimate.held_out.as_ref()).map(|judged| document! { hold_out: judged }),
        #[serde(flatten)]
        clocks: estimate.map(|estimate| document! { clocks: &estimate.clocks }),
    }
}
