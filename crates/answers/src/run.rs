//! The JSON document of a run.

use cohaptic_harness::Summary;
use cohaptic_harness::measures::MeasuredValue;
use cohaptic_scene::Scene;
use serde::Serialize;

use crate::document;
use crate::parts::{access_line, link_quantiles, link_totals, measures_of, peer, peer_links, rotation};

/// Returns the document of a run. `wall_s`: wall time of the run \[s\]; `None` leaves the keys of the speed out.
pub fn run(scene: &Scene, summary: &Summary, measured: &[MeasuredValue], wall_s: Option<f64>) -> impl Serialize {
    let duration_s = summary.duration.as_secs_f64();
    document! {
        title: scene.title.clone(),
        duration_s: duration_s,
        ticks: summary.ticks,
        ending: summary.ending_name(),
        #[serde(flatten)]
        speed: wall_s.map(|wall_s| document! { wall_s: wall_s, realtime_factor: duration_s / wall_s }),
        peers: summary.peers.iter().map(peer).collect::<Vec<_>>(),
        link_totals: link_totals(summary),
        link_quantiles: link_quantiles(summary),
        links: peer_links(scene, summary),
        access_lines: summary.access_lines.iter().map(|line| access_line(scene, line)).collect::<Vec<_>>(),
        max_discrepancy_m: summary.max_discrepancy,
        #[serde(flatten)]
        rotation: rotation(summary),
        #[serde(flatten)]
        measures: measures_of(scene, measured),
    }
}
