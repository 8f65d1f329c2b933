//! The JSON document of a run.

use std::collections::BTreeMap;

use cohaptic_harness::{AccessSummary, Ending, LinkSummary, PeerSummary};
use cohaptic_scene::Scene;
use cohaptic_wan::{DropCause, LinkStats};
use serde::Serialize;

use super::Run;
use crate::output;

/// What `cohaptic run --json` prints.
#[derive(Serialize)]
pub(super) struct Document {
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
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) against: Option<Box<Self>>,
}

#[derive(Serialize)]
struct PeerDocument {
    name: String,
    position_m: Components,
    velocity_m_s: Components,
    stale_samples: u64,
    refused_samples: u64,
}

/// A number in a scene of one axis, a list with more.
#[derive(Serialize)]
#[serde(untagged)]
enum Components {
    One(f64),
    More(Vec<f64>),
}

#[derive(Serialize)]
struct LinkDocument {
    from: String,
    to: String,
    #[serde(flatten)]
    counters: Counters,
}

#[derive(Serialize)]
struct AccessDocument {
    peer: String,
    line: &'static str,
    #[serde(flatten)]
    counters: Counters,
}

#[derive(Serialize)]
struct Counters {
    offered: u64,
    duplicated: u64,
    delivered: u64,
    dropped: BTreeMap<&'static str, u64>,
    in_flight: u64,
    marked: u64,
    damaged: u64,
    mean_delay_s: Option<f64>,
}

impl Document {
    pub(super) fn new(scene: &Scene, run: &Run) -> Self {
        let summary = &run.summary;
        let name = |peer: usize| scene.peers[peer].name.clone();
        let duration_s = summary.duration.as_secs_f64();
        let link = |link: &LinkSummary| LinkDocument { from: name(link.from), to: name(link.to), counters: Counters::new(&link.stats) };
        let line = |line: &AccessSummary| AccessDocument {
            peer: name(line.peer),
            line: if line.uplink { "uplink" } else { "downlink" },
            counters: Counters::new(&line.stats),
        };
        let peer = |peer: &PeerSummary| PeerDocument {
            name: peer.name.clone(),
            position_m: Components::new(&peer.position),
            velocity_m_s: Components::new(&peer.velocity),
            stale_samples: peer.stale_samples,
            refused_samples: peer.refused_samples,
        };
        Self {
            title: scene.title.clone(),
            duration_s,
            ticks: summary.ticks,
            ending: ending_name(summary.ending),
            wall_s: run.wall_s,
            realtime_factor: duration_s / run.wall_s,
            peers: summary.peers.iter().map(peer).collect(),
            links: summary.links.iter().map(link).collect(),
            access_lines: summary.access_lines.iter().map(line).collect(),
            max_discrepancy_m: summary.max_discrepancy,
            files: run.files.iter().map(|file| output::path(file)).collect(),
            against: None,
        }
    }
}

impl Components {
    fn new(values: &[f64]) -> Self {
        match values {
            [value] => Self::One(*value),
            values => Self::More(values.to_vec()),
        }
    }
}

impl Counters {
    fn new(stats: &LinkStats) -> Self {
        Self {
            offered: stats.offered(),
            duplicated: stats.duplicated(),
            delivered: stats.delivered(),
            dropped: DropCause::ALL.into_iter().map(|cause| (cause.name(), stats.dropped(cause))).collect(),
            in_flight: stats.in_flight(),
            marked: stats.marked(),
            damaged: stats.damaged(),
            mean_delay_s: stats.mean_delay().map(|delay| delay.as_secs_f64()),
        }
    }
}

fn ending_name(ending: Ending) -> &'static str {
    match ending {
        Ending::Complete => "complete",
        Ending::Diverged(_) => "diverged",
        Ending::Interrupted(_) => "interrupted",
    }
}
