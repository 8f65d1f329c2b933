//! The macro of JSON documents, and parts shared by several documents: peers, links, access lines and measures.

use std::collections::BTreeMap;

use cohaptic_harness::measures::MeasuredValue;
use cohaptic_harness::{AccessSummary, LinkQuantiles, PeerSummary, Summary};
use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::Scene;
use cohaptic_stability::VerdictKind;
use cohaptic_wan::{CrossCounts, DropCause, LinkStats};
use serde::Serialize;
use serde_json::{Map, Value};

/// Makes a JSON document, or a part of a document: keys and values, in this order. Attributes are passed to serde; a part that may be absent is a flattened
/// `Option`.
#[macro_export]
macro_rules! document {
    ($($(#[$attribute:meta])* $key:ident: $value:expr),* $(,)?) => {{
        // A type of its own for each document, because serde writes the fields of a struct in the order of the declaration.
        #[derive(serde::Serialize)]
        struct Document<$($key),*> {
            $($(#[$attribute])* $key: $key),*
        }
        Document { $($key: $value),* }
    }};
}

/// Components of a vector: a number in a scene with one axis, a list in a scene with more axes.
#[derive(Serialize)]
#[serde(untagged)]
enum Components {
    One(f64),
    More(Vec<f64>),
}

/// Returns the keys of a motion: position \[m\] and velocity \[m/s\] along each axis of the scene, and the attitude of an object that turns.
pub fn motion(position: &[f64], velocity: &[f64], attitude: Option<Attitude>) -> impl Serialize + use<> {
    document! {
        position_m: Components::new(position),
        velocity_m_s: Components::new(velocity),
        #[serde(flatten)]
        attitude: attitude.map(|attitude| document! { orientation: attitude.orientation, angular_velocity_rad_s: attitude.rate }),
    }
}

/// Returns the document of a peer at the end of a run.
pub fn peer(peer: &PeerSummary) -> impl Serialize {
    document! {
        name: peer.name.as_str(),
        #[serde(flatten)]
        copy: motion(&peer.position, &peer.velocity, peer.attitude),
        stale_samples: peer.stale_samples,
        refused_samples: peer.refused_samples,
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

/// Returns the keys that a run and a live session have in common: links, access lines, and the largest distance and angle between two copies.
pub fn links_and_distances(scene: &Scene, summary: &Summary) -> impl Serialize + use<> {
    document! {
        link_totals: link_totals(summary),
        link_quantiles: link_quantiles(summary),
        links: peer_links(scene, summary),
        access_lines: summary.access_lines.iter().map(|line| access_line(scene, line)).collect::<Vec<_>>(),
        max_discrepancy_m: summary.max_discrepancy,
        #[serde(flatten)]
        rotation: summary.max_rotation_discrepancy.map(|angle| document! { max_rotation_discrepancy_rad: angle }),
    }
}

/// Greatest number of links listed singly.
pub(crate) const MOST_LINKS: u64 = 1000;

/// Returns the document of each link between two peers at the end of a run; `None` if the scene has more than 1000 links.
fn peer_links(scene: &Scene, summary: &Summary) -> Option<Vec<impl Serialize + use<>>> {
    let name = |peer: usize| scene.peers[peer].name.clone();
    let links = || summary.links.iter().map(|link| self::link(name(link.from), name(link.to), &link.stats));
    // The links of a large mesh would make the document long. Totals and quantiles stand for the links then.
    (summary.links.len() <= MOST_LINKS).then(|| links().collect())
}

/// Returns the sums of the counters over all links between peers.
fn link_totals(summary: &Summary) -> impl Serialize + use<> {
    document! {
        links: summary.links.len(),
        #[serde(flatten)]
        counters: counters(&summary.links.total()),
    }
}

/// Returns the quantiles, over the links between peers, of the delivered fraction and of the mean delay.
fn link_quantiles(summary: &Summary) -> impl Serialize + use<> {
    let of = |quantiles: Option<LinkQuantiles>| {
        quantiles.map(|LinkQuantiles { min, p01, p50, p99, max }| document! { min: min, p01: p01, p50: p50, p99: p99, max: max })
    };
    document! { delivered_fraction: of(summary.links.delivered_fraction()), mean_delay_s: of(summary.links.mean_delay()) }
}

/// Returns the document of a link with the names of both ends.
pub fn link(from: String, to: String, stats: &LinkStats) -> impl Serialize + use<> {
    document! {
        from: from,
        to: to,
        #[serde(flatten)]
        counters: counters(stats),
    }
}

/// Returns the document of an access line at the end of a run.
fn access_line(scene: &Scene, line: &AccessSummary) -> impl Serialize + use<> {
    document! {
        peer: scene.peers[line.peer].name.clone(),
        line: if line.uplink { "uplink" } else { "downlink" },
        #[serde(flatten)]
        counters: counters(&line.stats),
    }
}

/// Returns the counters of a link or an access line.
fn counters(stats: &LinkStats) -> impl Serialize + use<> {
    document! {
        offered: stats.offered(),
        duplicated: stats.duplicated(),
        delivered: stats.delivered(),
        // All causes are listed, also with a count of zero, so that every document has the same keys.
        dropped: DropCause::ALL.into_iter().map(|cause| (cause.name(), stats.dropped(cause))).collect::<BTreeMap<_, _>>(),
        in_flight: stats.in_flight(),
        marked: stats.marked(),
        damaged: stats.damaged(),
        #[serde(flatten)]
        cross: cross_counts(stats.cross_traffic()),
        mean_delay_s: stats.mean_delay().map(|delay| delay.as_secs_f64()),
    }
}

/// Returns the key `cross_traffic` with the counts of a line; `None` leaves the key out, if the packets of the line met no cross-traffic.
pub(crate) fn cross_counts(counts: CrossCounts) -> Option<impl Serialize + use<>> {
    (counts.offered > 0).then(|| document! { cross_traffic: document! { offered: counts.offered, dropped: counts.dropped } })
}

/// Returns the measures of a run by name; `None` if the scene has no measures.
pub fn measures_of(scene: &Scene, measured: &[MeasuredValue]) -> Option<impl Serialize + use<>> {
    // The names come from the scene, so the keys are not known before the run.
    let named: Map<String, Value> = measured.iter().map(|measured| (measured.name.text(scene), Value::from(measured.value))).collect();
    (!named.is_empty()).then(|| document! { measures: named })
}

/// Returns the number of judged items (cells, values) of one kind of verdict, and the share of stable items among these.
pub(crate) fn judged(kind: VerdictKind, count: usize, stable_fraction: f64) -> impl Serialize {
    document! { judged: kind.word(), count: count, stable_fraction: stable_fraction }
}
