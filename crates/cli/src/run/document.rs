//! The JSON document of a run.

use cohaptic_scene::Scene;
use serde::Serialize;

use super::Run;
use crate::document_schema::document;
use crate::documents::{LinkDocument, access_line, ending_name, peer};
use crate::output;

/// The answer of `cohaptic run --json`. `otherwise`: the differences of the scene from that of the session that is replayed. `against`: the document of the
/// variant.
pub(super) fn of(scene: &Scene, run: &Run, otherwise: &[String], against: Option<impl Serialize>) -> impl Serialize {
    let summary = &run.summary;
    let duration_s = summary.duration.as_secs_f64();
    document! {
        title: scene.title.as_str(),
        duration_s: duration_s,
        ticks: summary.ticks,
        ending: ending_name(summary.ending),
        wall_s: run.wall_s,
        realtime_factor: duration_s / run.wall_s,
        peers: summary.peers.iter().map(peer).collect::<Vec<_>>(),
        links: summary.links.iter().map(|link| LinkDocument::new(scene, link)).collect::<Vec<_>>(),
        access_lines: summary.access_lines.iter().map(|line| access_line(scene, line)).collect::<Vec<_>>(),
        max_discrepancy_m: summary.max_discrepancy,
        files: run.files.iter().map(|file| output::path(file)).collect::<Vec<_>>(),
        #[serde(flatten)]
        otherwise: (!otherwise.is_empty()).then(|| document! { replayed_otherwise: otherwise }),
        #[serde(flatten)]
        variant: against.map(|against| document! { against: against }),
    }
}
