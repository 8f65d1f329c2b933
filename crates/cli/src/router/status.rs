//! A router as live control shows it.

use std::time::Duration;

use cohaptic_control::{Description, Kind, LinkCounters, LinkName, Snapshot};
use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_realtime::Validity;
use cohaptic_router::{LaneSnapshot, Report, Written};
use cohaptic_units::Instant;

use crate::output;
use crate::realtime::{counters, quantiles};

/// Every link twice: from the left and from the right.
pub(super) fn description(file: &RouterFile) -> Description {
    let lanes = file.links.iter().flat_map(|link| {
        Side::BOTH.map(|from| {
            let (from, to) = (from.name(), from.opposite().name());
            // As its random streams are called.
            LinkName { name: format!("{0}.{from}->{0}.{to}", link.name), from: from.to_owned(), to: to.to_owned() }
        })
    });
    Description { kind: Kind::Router, title: output::path(&file.file), links: lanes.collect(), peers: Vec::new(), clocks: vec!["release".to_owned()] }
}

pub(super) fn snapshot(report: &Report, validity: Validity) -> Snapshot {
    Snapshot {
        elapsed: elapsed(report),
        invalid: (!validity.is_valid()).then(|| validity.to_string()),
        lateness: vec![quantiles(&report.release)],
        links: report.counters.lanes.iter().map(link).collect(),
        peers: Vec::new(),
        refused: refused(report).into_iter().filter(|(_, count)| *count > 0).collect(),
    }
}

pub(super) fn elapsed(report: &Report) -> Duration {
    report.elapsed.saturating_duration_since(Instant::ZERO)
}

fn link(lane: &LaneSnapshot) -> LinkCounters {
    LinkCounters { delivered_bytes: lane.delivered_bytes, recent_delay: quantiles(&lane.recent_delay), ..counters(&lane.stats) }
}

/// What was dropped outside of links, by cause.
pub(super) fn refused(report: &Report) -> [(&'static str, u64); 6] {
    let [left, right] = &report.counters.received;
    let written = |count: fn(&Written) -> u64| report.written.iter().map(count).sum();
    [
        ("malformed", left.malformed + right.malformed),
        ("rule", left.dropped + right.dropped),
        ("overload", report.counters.lanes.iter().map(|lane| lane.overload).sum()),
        ("full", written(|written| written.full)),
        ("too-long", written(|written| written.too_long)),
        ("refused", written(|written| written.refused)),
    ]
}
