//! The JSON document of a session.

use std::collections::BTreeMap;

use cohaptic_harness::live::SeatStats;
use cohaptic_live::session::SocketCounts;
use cohaptic_live::{AdmissionStats, Report};
use cohaptic_realtime::Wish;
use cohaptic_scene::Scene;
use serde::Serialize;

use crate::document_schema::document;
use crate::documents::{LatenessDocument, LinkDocument, access_line, ending_name, micros, peer};
use crate::output;

/// The answer of `cohaptic live --json`.
pub(super) fn of(scene: &Scene, report: &Report) -> impl Serialize {
    let summary = &report.summary;
    let peers = summary.peers.iter().enumerate().map(|(place, summary)| {
        document! {
            kind: scene.peers[place].kind.name(),
            #[serde(flatten)]
            peer: peer(summary),
            #[serde(flatten)]
            seat: report.seats[place].as_ref().map(|seat| document! { seat: of_seat(seat) }),
        }
    });
    document! {
        title: scene.title.as_str(),
        duration_s: summary.duration.as_secs_f64(),
        ending: ending_name(summary.ending),
        valid: report.validity.is_valid(),
        ticks: summary.ticks,
        late_ticks: report.late_ticks,
        lateness_us: LatenessDocument::new(&report.ticks),
        release_lateness_us: LatenessDocument::new(&report.releases),
        behind_us: micros(report.behind),
        peers: peers.collect::<Vec<_>>(),
        links: summary.links.iter().map(|link| LinkDocument::new(scene, link)).collect::<Vec<_>>(),
        access_lines: summary.access_lines.iter().map(|line| access_line(scene, line)).collect::<Vec<_>>(),
        max_discrepancy_m: summary.max_discrepancy,
        #[serde(flatten)]
        admission: report.admission.as_ref().map(|(stats, socket)| document! { door: of_admission(stats, socket) }),
        granted: report.prepared.granted.iter().copied().map(Wish::name).collect::<Vec<_>>(),
        refused_wishes: report.prepared.refused.iter().map(ToString::to_string).collect::<Vec<_>>(),
        files: report.files.iter().map(|file| output::path(file)).collect::<Vec<_>>(),
    }
}

/// The arrivals from a remote peer.
fn of_seat(seat: &SeatStats) -> impl Serialize + use<> {
    let SeatStats { taken, joined, refused, out_of_order, late, most_late } = *seat;
    document! { taken: taken, joined: joined, refused: refused, out_of_order: out_of_order, late: late, most_late_us: micros(most_late) }
}

fn of_admission(stats: &AdmissionStats, socket: &SocketCounts) -> impl Serialize + use<> {
    document! {
        address: socket.address.to_string(),
        handled: stats.handled,
        admitted: stats.admitted,
        welcomed: stats.welcomed,
        joinings: stats.joinings,
        refused: stats.refusals().map(|(cause, count)| (cause.name(), count)).collect::<BTreeMap<_, _>>(),
        sent: stats.sent,
        nobody_there: stats.nobody_there,
        send_failures: socket.counts.failures.by_reason().into_iter().collect::<BTreeMap<_, _>>(),
        oversized: socket.counts.oversized,
        kernel_drops: socket.kernel_drops,
    }
}
