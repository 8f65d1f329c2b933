//! A run as a JSON document and as text.

use cohaptic_harness::measures::MeasuredValue;
use cohaptic_harness::record::Bands;
use cohaptic_harness::task::{TaskResult, task_words};
use cohaptic_harness::{DIVERGED_DISTANCE, Ending, LinkQuantiles, Summary};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_units::print::{Counted, SixDigits, Span};
use cohaptic_wan::{DropCause, LinkStats};
use serde::Serialize;

use crate::parts::{MOST_LINKS, links_and_distances, measures_of, peer};
use crate::{document, length, text_plot};

/// Returns the document of a run. `task`: result of the task of the scene. `wall_s`: wall time of the run \[s\]; `None` leaves the keys of the speed out.
pub fn run(scene: &Scene, summary: &Summary, measured: &[MeasuredValue], task: Option<&TaskResult>, wall_s: Option<f64>) -> impl Serialize {
    let duration_s = summary.duration.as_secs_f64();
    document! {
        title: scene.title.clone(),
        duration_s: duration_s,
        ticks: summary.ticks,
        ending: summary.ending_name(),
        #[serde(flatten)]
        // Without a clock there is no speed: equal runs then give equal documents.
        speed: wall_s.map(|wall_s| document! { wall_s: wall_s, realtime_factor: duration_s / wall_s }),
        peers: summary.peers.iter().map(peer).collect::<Vec<_>>(),
        #[serde(flatten)]
        links: links_and_distances(scene, summary),
        #[serde(flatten)]
        task: task.map(|task| document! { task: task_of(scene, task) }),
        #[serde(flatten)]
        measures: measures_of(scene, measured),
    }
}

/// Returns the document of the result of a task. `failed_by` and `reason` are present only for a failure.
pub fn task_of(scene: &Scene, task: &TaskResult) -> impl Serialize + use<> {
    document! {
        kind: scene.task.as_ref().map(|task| task.kind.name()),
        outcome: task.outcome.name(),
        time_s: task.time.as_secs_f64(),
        reached_s: task.reached.iter().map(|at| (*at - Instant::ZERO).as_secs_f64()).collect::<Vec<f64>>(),
        #[serde(flatten)]
        failure: task.failure.map(|failure| document! { failed_by: scene.peers[failure.peer].name.clone(), reason: failure.reason.name() }),
    }
}

/// Returns the text about a run. `wall_s`: wall time of the run \[s\]. `positions`: positions to draw as a text plot, if wanted, best in
/// [`TEXT_PLOT_SPANS`](crate::TEXT_PLOT_SPANS) spans.
#[must_use]
pub fn run_words(
    scene: &Scene,
    summary: &Summary,
    measured: &[MeasuredValue],
    task: Option<&TaskResult>,
    wall_s: f64,
    positions: Option<&Bands>,
) -> String {
    let mut text = String::new();
    let mut line = |line: String| text.push_str(&format!("{line}\n"));
    if let Some(positions) = positions {
        // The text plot draws the first axis alone.
        line(format!("position of each copy of the object{}", if scene.axes.count() > 1 { ", along x" } else { "" }));
        let names: Vec<&str> = scene.peers.iter().map(|peer| peer.name.as_str()).collect();
        line(text_plot(positions, &names).trim_end().to_owned());
    }
    let simulated = Span(summary.duration);
    match summary.ending {
        Ending::Complete | Ending::Diverged(_) => diverged(summary).into_iter().for_each(|why| line(format!("  DIVERGED: {why}"))),
        Ending::Interrupted(_) => line(format!("  INTERRUPTED after {simulated} of {}", Span(scene.duration))),
    }
    // Measured over the simulated span, so that an interrupted run shows the speed until then.
    let factor = summary.duration.as_secs_f64() / wall_s;
    line(format!("  {simulated} simulated, {}, in {wall_s:.3} s: {factor:.0} times real time", Counted(summary.ticks, "tick")));
    line(format!("  largest discrepancy between two copies: {}", length(summary.max_discrepancy)));
    if let Some(angle) = summary.max_rotation_discrepancy {
        line(format!("  largest angle between two copies: {}", angle_text(angle)));
    }
    for peer in summary.peers.iter().take(MOST_PEERS) {
        let position: Vec<String> = peer.position.iter().map(|x| length(*x)).collect();
        line(format!("  {} ends at {}", peer.name, position.join(", ")));
    }
    if summary.peers.len() > MOST_PEERS {
        line(format!("  ... and {}", Counted(summary.peers.len() - MOST_PEERS, "more peer")));
    }
    line(format!("  {}", packets(summary)));
    if summary.links.len() > MOST_LINKS {
        over_links(summary).into_iter().for_each(|over| line(format!("  {over}")));
    }
    task.into_iter().for_each(|task| line(format!("  task: {}", task_words(task, scene))));
    measured_lines(scene, measured).into_iter().for_each(|measured| line(format!("  {measured}")));
    text
}

/// Greatest number of peers named in the text.
const MOST_PEERS: usize = 8;

/// Returns how a run [diverged](Summary::has_diverged), in words; `None` if the run did not diverge.
#[must_use]
pub fn diverged(summary: &Summary) -> Option<String> {
    match summary.ending {
        Ending::Diverged(at) => Some(format!("at {at} a position or a velocity is not finite")),
        Ending::Complete | Ending::Interrupted(_) => summary.has_diverged().then(|| format!("two copies were more than {DIVERGED_DISTANCE} m apart")),
    }
}

/// Returns an angle in words, in radians and in degrees.
#[must_use]
pub fn angle_text(radians: f64) -> String {
    format!("{radians:.4} rad ({:.2}°)", radians.to_degrees())
}

/// Returns lines about the differences between the links of a large mesh.
fn over_links(summary: &Summary) -> Vec<String> {
    let words = |what: &str, unit: &str, factor: f64, quantiles: Option<LinkQuantiles>| {
        quantiles.map(|LinkQuantiles { min, p01, p50, p99, max }| {
            let [min, p01, p50, p99, max] = [min, p01, p50, p99, max].map(|value| format!("{:.3}{unit}", value * factor));
            format!("{what} over links: least {min}, 1 % {p01}, median {p50}, 99 % {p99}, greatest {max}")
        })
    };
    let delivered = words("delivered", " %", 100.0, summary.links.delivered_fraction());
    delivered.into_iter().chain(words("mean delay", " ms", 1e3, summary.links.mean_delay())).collect()
}

/// Returns the counts of all packets from sender to receiver, in words.
#[must_use]
pub fn packets(summary: &Summary) -> String {
    let total = summary.links.total();
    // A packet is first counted by the uplink of the sender, or by the link if the sender has no uplink; last by the downlink of the receiver, or by the link.
    let through = |uplink: bool, count: fn(&LinkStats) -> u64| -> u64 {
        let lines = || summary.access_lines.iter().filter(move |line| line.uplink == uplink);
        // The usual scene has no access lines, and then the totals suffice.
        if lines().next().is_none() {
            return count(&total);
        }
        let mut has_line = vec![false; summary.peers.len()];
        lines().for_each(|line| has_line[line.peer] = true);
        // A link counts only for peers without an access line, so that no packet counts twice.
        let links = summary.links.iter().filter(|link| !has_line[if uplink { link.from } else { link.to }]);
        lines().map(|line| count(&line.stats)).sum::<u64>() + links.map(|link| count(&link.stats)).sum::<u64>()
    };
    let (sent, delivered) = (through(true, LinkStats::offered), through(false, LinkStats::delivered));
    let mut everywhere = total;
    summary.access_lines.iter().for_each(|line| everywhere.add(&line.stats, 1));
    let mut parts = vec![format!("{} sent over {}", Counted(sent, "packet"), Counted(summary.links.len(), "link")), format!("{delivered} delivered")];
    let copies = everywhere.duplicated();
    if copies > 0 {
        parts.push(format!("{} made", Counted(copies, "copy")));
    }
    for cause in DropCause::ALL {
        let dropped = everywhere.dropped(cause);
        if dropped > 0 {
            parts.push(format!("{dropped} dropped ({})", cause.name()));
        }
    }
    parts.push(format!("{} on the way at the end", everywhere.in_flight()));
    if everywhere.cross_traffic().offered > 0 {
        parts.push(format!("beside {}", everywhere.cross_traffic()));
    }
    let stale: u64 = summary.peers.iter().map(|peer| peer.stale_samples).sum();
    if stale > 0 {
        parts.push(format!("{stale} of those delivered came too late to be used"));
    }
    let refused: u64 = summary.peers.iter().map(|peer| peer.refused_samples).sum();
    if refused > 0 {
        parts.push(format!("{refused} delivered damaged and refused"));
    }
    parts.join(", ")
}

/// Greatest number of measures in the text. The document has all.
const MOST_MEASURES: usize = 40;

/// Returns a line per measure, with aligned names and values.
#[must_use]
pub fn measured_lines(scene: &Scene, measured: &[MeasuredValue]) -> Vec<String> {
    let named: Vec<(String, &MeasuredValue)> = measured.iter().take(MOST_MEASURES).map(|measured| (measured.name.text(scene), measured)).collect();
    let width = named.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let line = |(name, measured): &(String, &MeasuredValue)| {
        let value = measured.value.map_or_else(|| "no value".to_owned(), |value| SixDigits(value).to_string());
        format!("{name:<width$}  {value}")
    };
    let mut lines: Vec<String> = named.iter().map(line).collect();
    if measured.len() > MOST_MEASURES {
        lines.push(format!("... and {} more", measured.len() - MOST_MEASURES));
    }
    lines
}
