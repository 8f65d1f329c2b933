//! The JSON document of a run.

use cohaptic_scene::Scene;
use serde::Serialize;

use super::Run;
use crate::documents::{AccessDocument, LinkDocument, PeerDocument, ending_name};
use crate::output;

/// What `cohaptic run --json` prints.
#[derive(Serialize)]
pub(super) struct RunDocument {
    title: String,
    duration_s: f64,
    ticks: u64,
    ending: &'static str,
    wall_s: f64,
    realtime_factor: f64,
    peers: Vec<PeerDocument>,
    links: Vec<LinkDocument>,
    access_lines: Vec<AccessDocument>,
    max_discrepancy_m: f64,
    files: Vec<String>,
    /// In what the scene differs from that of the session that is replayed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) replayed_otherwise: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) against: Option<Box<Self>>,
}

impl RunDocument {
    pub(super) fn new(scene: &Scene, run: &Run) -> Self {
        let summary = &run.summary;
        let duration_s = summary.duration.as_secs_f64();
        Self {
            title: scene.title.clone(),
            duration_s,
            ticks: summary.ticks,
            ending: ending_name(summary.ending),
            wall_s: run.wall_s,
            realtime_factor: duration_s / run.wall_s,
            peers: summary.peers.iter().map(PeerDocument::new).collect(),
            links: summary.links.iter().map(|link| LinkDocument::new(scene, link)).collect(),
            access_lines: summary.access_lines.iter().map(|line| AccessDocument::new(scene, line)).collect(),
            max_discrepancy_m: summary.max_discrepancy,
            files: run.files.iter().map(|file| output::path(file)).collect(),
            replayed_otherwise: Vec::new(),
            against: None,
        }
    }
}
