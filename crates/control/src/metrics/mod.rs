//! Counters of a run as Prometheus metrics. The table of names is in `docs/live-control.md`.

mod exposition;
#[cfg(test)]
mod tests;

use core::time::Duration;

use exposition::Exposition;
use exposition::Measure::{Counter, Gauge, Summary};

use crate::{Description, Latest, LinkCounters, PeerView, Presence, Quantiles, Snapshot};

/// A counter of links: name of the metric, help text, and access to the value.
type LinkCount = (&'static str, &'static str, fn(&LinkCounters) -> u64);

const LINK_COUNTERS: [LinkCount; 6] = [
    ("cohaptic_link_offered_packets_total", "Packets handed to the link.", |link| link.offered),
    ("cohaptic_link_duplicated_packets_total", "Extra copies that the link made.", |link| link.duplicated),
    ("cohaptic_link_delivered_packets_total", "Packets that came out of the link, copies included.", |link| link.delivered),
    ("cohaptic_link_delivered_bytes_total", "Bytes of the packets that came out of the link.", |link| link.delivered_bytes),
    ("cohaptic_link_marked_packets_total", "Packets that the link marked: congestion experienced.", |link| link.marked),
    ("cohaptic_link_damaged_packets_total", "Packets of which the link flipped bits.", |link| link.damaged),
];

const AXES: [&str; 3] = ["x", "y", "z"];

/// Returns all metrics of the newest snapshot as text.
pub(crate) fn text(description: &Description, latest: &Latest) -> String {
    let mut out = Exposition::default();
    run(&mut out, description, latest);
    clocks(&mut out, description, &latest.snapshot);
    links(&mut out, description, &latest.snapshot);
    peers(&mut out, description, &latest.snapshot);
    refused(&mut out, &latest.snapshot);
    out.finish()
}

fn run(out: &mut Exposition, description: &Description, latest: &Latest) {
    out.family("cohaptic_run_info", Gauge, "What runs: always 1.");
    // Prometheus keeps texts as labels of a metric with the constant value 1.
    out.count(&[("kind", description.kind.name()), ("title", &description.title)], 1);
    out.family("cohaptic_run_elapsed_seconds", Gauge, "Time since the run began.");
    out.number(&[], latest.snapshot.elapsed.as_secs_f64());
    out.family("cohaptic_run_valid", Gauge, "1 while so far at most one in a thousand was too late, 0 while it was more.");
    out.count(&[], latest.snapshot.invalid.is_none().into());
    out.family("cohaptic_run_snapshots_total", Counter, "Snapshots published; one that stands still means that the run does.");
    out.count(&[], latest.number);
}

fn clocks(out: &mut Exposition, description: &Description, snapshot: &Snapshot) {
    out.family("cohaptic_clock_lateness_seconds", Summary, "How late a clock was, since the run began; quantile 1 is the longest.");
    for (number, name) in description.clocks.iter().enumerate() {
        // A snapshot may be shorter than the description: missing entries count as defaults.
        let lateness = snapshot.lateness.get(number).copied().unwrap_or_default();
        for (quantile, span) in spans(&lateness) {
            out.number(&[("clock", name), ("quantile", quantile)], span);
        }
        out.summary_sum(&[("clock", name)], lateness.sum.as_secs_f64());
        out.summary_count(&[("clock", name)], lateness.count);
    }
}

fn links(out: &mut Exposition, description: &Description, snapshot: &Snapshot) {
    let none = LinkCounters::default();
    let each = || {
        let with = |(number, name)| (labels(name), snapshot.links.get(number).unwrap_or(&none));
        description.links.iter().enumerate().map(with)
    };
    // Prometheus requires all samples of a family in one group, so the families are the outer loop.
    for (name, help, count) in LINK_COUNTERS {
        out.family(name, Counter, help);
        each().for_each(|(labels, link)| out.count(&labels, count(link)));
    }
    out.family("cohaptic_link_dropped_packets_total", Counter, "Packets dropped, by cause.");
    for ([link, from, to], counters) in each() {
        for (cause, count) in merged(&counters.dropped) {
            out.count(&[link, from, to, ("cause", cause)], count);
        }
    }
    out.family("cohaptic_link_in_flight_packets", Gauge, "Packets inside the link now.");
    each().for_each(|(labels, link)| out.count(&labels, link.in_flight));
    out.family("cohaptic_link_mean_delay_seconds", Gauge, "Mean time in the link of all that was delivered; NaN before the first.");
    each().for_each(|(labels, link)| out.number(&labels, link.mean_delay.map_or(f64::NAN, |delay| delay.as_secs_f64())));
    out.family(
        "cohaptic_link_recent_delay_seconds",
        Gauge,
        "Time in the link of what was delivered of late: p50, p99, p99.9 and max; NaN if nothing was.",
    );
    for ([link, from, to], counters) in each() {
        for (statistic, (_, span)) in ["p50", "p99", "p99.9", "max"].into_iter().zip(spans(&counters.recent_delay)) {
            out.number(&[link, from, to, ("statistic", statistic)], span);
        }
    }
}

fn peers(out: &mut Exposition, description: &Description, snapshot: &Snapshot) {
    let none = PeerView::default();
    let each = || description.peers.iter().enumerate().map(|(number, peer)| (peer.name.as_str(), snapshot.peers.get(number).unwrap_or(&none)));
    out.family("cohaptic_peer_status", Gauge, "1 for the status that a peer has, 0 for the others.");
    for (name, view) in each() {
        // A series for each status, 1 or 0: a single number could not tell the name of the status.
        for presence in Presence::ALL {
            out.count(&[("peer", name), ("status", presence.name())], (view.status == presence).into());
        }
    }
    out.family("cohaptic_peer_age_seconds", Gauge, "Time since a peer elsewhere was last heard.");
    for (name, view) in each() {
        // A peer of this program has no age, and gets no sample.
        if let Some(age) = view.age {
            out.number(&[("peer", name)], age.as_secs_f64());
        }
    }
    out.family("cohaptic_peer_position_meters", Gauge, "Where the copy of a peer is.");
    for (name, view) in each() {
        AXES.into_iter().zip(&view.position).for_each(|(axis, position)| out.number(&[("peer", name), ("axis", axis)], *position));
    }
    out.family("cohaptic_peer_force_newtons", Gauge, "The force that the user of a peer feels.");
    for (name, view) in each() {
        AXES.into_iter().zip(&view.force).for_each(|(axis, force)| out.number(&[("peer", name), ("axis", axis)], *force));
    }
}

fn refused(out: &mut Exposition, snapshot: &Snapshot) {
    out.family("cohaptic_refused_datagrams_total", Counter, "Datagrams refused, by cause.");
    for (cause, count) in merged(&snapshot.refused) {
        out.count(&[("cause", cause)], count);
    }
}

fn labels(name: &crate::LinkName) -> [(&str, &str); 3] {
    [("link", &name.name), ("from", &name.from), ("to", &name.to)]
}

/// Returns the quantiles with their labels \[s\]; NaN without observations.
fn spans(quantiles: &Quantiles) -> [(&'static str, f64); 4] {
    let seconds = |span: Duration| if quantiles.count == 0 { f64::NAN } else { span.as_secs_f64() };
    [("0.5", seconds(quantiles.p50)), ("0.99", seconds(quantiles.p99)), ("0.999", seconds(quantiles.p999)), ("1", seconds(quantiles.max))]
}

/// Adds the counts of causes listed twice, because a sample may occur only once in the text.
fn merged(causes: &[(&'static str, u64)]) -> Vec<(&'static str, u64)> {
    let mut sums: Vec<(&'static str, u64)> = Vec::with_capacity(causes.len());
    for (cause, count) in causes {
        match sums.iter_mut().find(|(name, _)| name == cause) {
            Some((_, sum)) => *sum = sum.saturating_add(*count),
            None => sums.push((cause, *count)),
        }
    }
    sums
}
