//! Answer of `cohaptic run`, as a JSON document and as text.

pub(crate) use cohaptic_answers::{angle_text, diverged, length, packets};
use cohaptic_scene::Scene;
use serde::Serialize;

use super::Run;
use crate::document_schema::document;
use crate::output;

/// Returns the answer of `cohaptic run --json`. `otherwise` holds the differences between the scene and the scene of the replayed session. `against` is the
/// document of the variant.
pub(super) fn of(scene: &Scene, run: &Run, otherwise: &[String], against: Option<impl Serialize>) -> impl Serialize {
    document! {
        #[serde(flatten)]
        run: cohaptic_answers::run(scene, &run.summary, &run.measured, run.task.as_ref(), Some(run.wall_s)),
        files: run.files.iter().map(|file| output::path(file)).collect::<Vec<_>>(),
        #[serde(flatten)]
        otherwise: (!otherwise.is_empty()).then(|| document! { replayed_otherwise: otherwise }),
        #[serde(flatten)]
        variant: against.map(|against| document! { against: against }),
    }
}

/// Describes a run as text for a terminal.
pub(super) fn describe(scene: &Scene, run: &Run) -> String {
    cohaptic_answers::run_words(scene, &run.summary, &run.measured, run.task.as_ref(), run.wall_s, run.positions.as_ref())
}
