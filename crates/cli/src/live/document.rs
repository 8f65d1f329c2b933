//! The JSON document of a session.

use std::collections::BTreeMap;

use cohaptic_harness::PeerSummary;
use cohaptic_harness::live::SeatStats;
use cohaptic_live::Report;
use cohaptic_live::session::SocketCounts;
use cohaptic_realtime::Wish;
use cohaptic_scene::Scene;
use serde::Serialize;

use crate::documents::{AccessDocument, LatenessDocument, LinkDocument, PeerDocument, ending_name, micros};
use crate::output;

/// What `cohaptic live --json` prints.
#[derive(Serialize)]
pub(super) struct LiveDocument {
    title: String,
    duration_s: f64,
    ending: &'static str,
    valid: bool,
    ticks: u64,
    late_ticks: u64,
    lateness_us: LatenessDocument,
    release_lateness_us: LatenessDocument,
    behind_us: f64,
    peers: Vec<LivePeer>,
    links: Vec<LinkDocument>,
    access_lines: Vec<AccessDocument>,
    max_discrepancy_m: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    door: Option<AdmissionDocument>,
    granted: Vec<&'static str>,
    refused_wishes: Vec<String>,
    files: Vec<String>,
}

#[derive(Serialize)]
struct LivePeer {
    kind: &'static str,
    #[serde(flatten)]
    peer: PeerDocument,
    #[serde(skip_serializing_if = "Option::is_none")]
    seat: Option<SeatDocument>,
}

/// What came in from a peer that is remote.
#[derive(Serialize)]
struct SeatDocument {
    taken: u64,
    joined: u64,
    refused: u64,
    out_of_order: u64,
    late: u64,
    most_late_us: f64,
}

#[derive(Serialize)]
struct AdmissionDocument {
    address: String,
    handled: u64,
    admitted: u64,
    welcomed: u64,
    joinings: u64,
    refused: BTreeMap<&'static str, u64>,
    sent: u64,
    nobody_there: u64,
    send_failures: BTreeMap<&'static str, u64>,
    oversized: u64,
    kernel_drops: Option<u64>,
}

impl LiveDocument {
    pub(super) fn new(scene: &Scene, report: &Report) -> Self {
        let summary = &report.summary;
        let peer = |(place, peer): (usize, &PeerSummary)| LivePeer {
            kind: scene.peers[place].kind.name(),
            peer: PeerDocument::new(peer),
            seat: report.seats[place].as_ref().map(SeatDocument::new),
        };
        Self {
            title: scene.title.clone(),
            duration_s: summary.duration.as_secs_f64(),
            ending: ending_name(summary.ending),
            valid: report.validity.is_valid(),
            ticks: summary.ticks,
            late_ticks: report.late_ticks,
            lateness_us: LatenessDocument::new(&report.ticks),
            release_lateness_us: LatenessDocument::new(&report.releases),
            behind_us: micros(report.behind),
            peers: summary.peers.iter().enumerate().map(peer).collect(),
            links: summary.links.iter().map(|link| LinkDocument::new(scene, link)).collect(),
            access_lines: summary.access_lines.iter().map(|line| AccessDocument::new(scene, line)).collect(),
            max_discrepancy_m: summary.max_discrepancy,
            door: report.admission.as_ref().map(|(stats, socket)| AdmissionDocument::new(stats, socket)),
            granted: report.prepared.granted.iter().copied().map(Wish::name).collect(),
            refused_wishes: report.prepared.refused.iter().map(ToString::to_string).collect(),
            files: report.files.iter().map(|file| output::path(file)).collect(),
        }
    }
}

impl SeatDocument {
    fn new(seat: &SeatStats) -> Self {
        let SeatStats { taken, joined, refused, out_of_order, late, most_late } = *seat;
        Self { taken, joined, refused, out_of_order, late, most_late_us: micros(most_late) }
    }
}

impl AdmissionDocument {
    fn new(stats: &cohaptic_live::AdmissionStats, socket: &SocketCounts) -> Self {
        Self {
            address: socket.address.to_string(),
            handled: stats.handled,
            admitted: stats.admitted,
            welcomed: stats.welcomed,
            joinings: stats.joinings,
            refused: stats.refusals().map(|(cause, count)| (cause.name(), count)).collect(),
            sent: stats.sent,
            nobody_there: stats.nobody_there,
            send_failures: socket.counts.failures.by_reason().into_iter().collect(),
            oversized: socket.counts.oversized,
            kernel_drops: socket.kernel_drops,
        }
    }
}
