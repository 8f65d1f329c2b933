//! The worst case of a scene under bounded patterns of losses and delays.

use std::path::Path;

use cohaptic_proofs::{Effort, Links, Patterns, SceneWorstCase, SceneWorstCaseError, worst_case_watched};
use cohaptic_scene::Scene;
use cohaptic_stability::AnalysisError;

use super::ended;
use crate::analysis_watch::AnalysisWatch;
use crate::arguments::{LinksName, PointArguments};
use crate::failure::{Failure, not_analysed};

/// Computes the worst case, or returns `None` if no option asks for the worst case. An accuracy that is not above zero is an input failure.
pub(super) fn of(scene: &Scene, arguments: &PointArguments, path: &Path) -> Result<Option<SceneWorstCase>, Failure> {
    if arguments.losses_in_a_row.is_none() && arguments.delay_within.is_none() {
        return Ok(None);
    }
    // The comparison is false for NaN, so NaN is refused as well.
    if !(arguments.accuracy > 0.0 && arguments.accuracy.is_finite()) {
        return Err(Failure::Input(format!("--accuracy {}: expected a number above 0", arguments.accuracy)));
    }
    let links = match arguments.links {
        LinksName::Together => Links::Together,
        LinksName::Each => Links::Each,
    };
    let patterns = Patterns { losses_in_a_row: arguments.losses_in_a_row.unwrap_or(0), delay: arguments.delay_within, links };
    let effort = Effort { accuracy: arguments.accuracy, products: arguments.products };
    let watch = AnalysisWatch::new(arguments.memory);
    let found = worst_case_watched(scene, &patterns, &effort, &watch);
    watch.clear();
    found.map(Some).map_err(|error| {
        let is_stopped = matches!(error, SceneWorstCaseError::Analysis(AnalysisError::Stopped));
        if is_stopped { ended() } else { not_analysed(path, &error) }
    })
}
