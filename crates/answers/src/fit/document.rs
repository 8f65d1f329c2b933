//! The JSON document of a fitted link.

use serde::Serialize;

use super::Answered;
use crate::document;

/// Returns the answer of `cohaptic fit --json`.
pub fn document(answered: &Answered) -> impl Serialize {
    document! {
        #[serde(flatten)]
        fitted: &answered.fitted,
        // The keys of a scene.
        scene: answered.scene.as_str(),
        #[serde(flatten)]
        skew: answered.skew.as_ref().map(|skew| document! { skew: skew }),
        #[serde(flatten)]
        matched: answered.matched.as_ref().map(|matched| document! { matched: matched }),
        clocks: &answered.clocks,
    }
}
