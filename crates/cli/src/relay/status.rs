//! A relay as live control shows it.

use std::time::Duration;

use cohaptic_control::{Description, Kind, LinkCounters, LinkName, Snapshot};
use cohaptic_realtime::Tolerance;
use cohaptic_relay::{LinkReport, View};
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use super::setup::Setup;
use crate::realtime::{counters, quantiles, quantiles_of};

pub(super) fn description(setup: &Setup) -> Description {
    let link = |(from, to)| {
        let (from, to) = (setup.name(from).to_owned(), setup.name(to).to_owned());
        LinkName { name: format!("{from}->{to}"), from, to }
    };
    Description {
        kind: Kind::Relay,
        title: setup.title.clone(),
        links: setup.pairs.iter().copied().map(link).collect(),
        peers: Vec::new(),
        clocks: vec!["release".to_owned()],
    }
}

/// How often a relay with so many links is looked at: a snapshot of a large mesh takes milliseconds, and packets wait meanwhile.
pub(super) fn publish_every(links: usize) -> Duration {
    const LINKS_IN_A_MOMENT: usize = 500;
    let moments = u32::try_from(links.div_ceil(LINKS_IN_A_MOMENT)).unwrap_or(u32::MAX).clamp(1, 50);
    Duration::from_millis(100) * moments
}

/// `pairs` are the links in the order of the description.
pub(super) fn snapshot(view: &View<'_>, pairs: &[(NodeId, NodeId)], tolerance: Tolerance) -> Snapshot {
    let links = view.links();
    let validity = tolerance.judge(view.release());
    Snapshot {
        elapsed: view.now().saturating_duration_since(Instant::ZERO),
        invalid: (!validity.is_valid()).then(|| validity.to_string()),
        lateness: vec![quantiles(&view.release().summary())],
        links: links.iter().zip(pairs).map(|(report, (from, to))| link(report, view.recent_delays(*from, *to))).collect(),
        peers: Vec::new(),
        refused: refused(view, &links),
    }
}

fn link(report: &LinkReport, recent: &[Duration]) -> LinkCounters {
    LinkCounters { delivered_bytes: report.counts.delivered_bytes, recent_delay: quantiles_of(recent), ..counters(&report.stats) }
}

fn refused(view: &View<'_>, links: &[LinkReport]) -> Vec<(&'static str, u64)> {
    let intake = view.intake();
    let undeliverable = links.iter().map(|link| link.counts.undeliverable).sum();
    let all = [
        ("stranger", intake.strangers),
        ("to-itself", intake.to_itself),
        ("no-room", intake.no_room),
        ("overload", intake.overload),
        ("undeliverable", undeliverable),
    ];
    all.into_iter().filter(|(_, count)| *count > 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_mesh_is_looked_at_less_often() {
        assert_eq!([2, 500, 501, 65_280].map(publish_every), [100, 100, 200, 5000].map(Duration::from_millis));
    }
}
