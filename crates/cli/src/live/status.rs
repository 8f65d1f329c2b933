//! A session as live control shows it.

use std::time::Duration;

use cohaptic_control::{Description, Kind, LinkCounters, LinkName, PeerName, PeerView, Presence as Shown, Snapshot};
use cohaptic_harness::live::Presence;
use cohaptic_live::session::{LinkStatus, PeerStatus};
use cohaptic_live::{Refusal, Status};
use cohaptic_scene::{PeerSpec, Scene};
use cohaptic_units::Instant;

use crate::documents::micros;
use crate::realtime::{counters, quantiles, quantiles_of};

/// Every directed link, by sender, then receiver.
pub(super) fn pairs(scene: &Scene) -> Vec<(usize, usize)> {
    let places = 0..scene.peers.len();
    places.clone().flat_map(|from| places.clone().map(move |to| (from, to))).filter(|(from, to)| from != to).collect()
}

pub(super) fn description(scene: &Scene, pairs: &[(usize, usize)]) -> Description {
    let name = |peer: usize| scene.peers[peer].name.clone();
    Description {
        kind: Kind::Live,
        title: scene.title.clone(),
        links: pairs
            .iter()
            .map(|(from, to)| LinkName { name: format!("{}->{}", name(*from), name(*to)), from: name(*from), to: name(*to) })
            .collect(),
        peers: scene.peers.iter().map(|peer| PeerName { name: peer.name.clone(), kind: peer.kind.name().to_owned() }).collect(),
        clocks: vec!["tick".to_owned(), "release".to_owned()],
    }
}

/// What must be known of a scene to show a session of it.
pub(super) struct Shape {
    axes: usize,
    /// For each peer, how long it may be silent before it counts as silent; zero for one that lives here.
    silences: Vec<Duration>,
}

impl Shape {
    pub(super) fn of(scene: &Scene) -> Self {
        let silence = |peer: &PeerSpec| peer.kind.silence().map_or(Duration::ZERO, |silence| silence.after);
        Self { axes: scene.axes.count(), silences: scene.peers.iter().map(silence).collect() }
    }
}

pub(super) fn snapshot(status: &Status, shape: &Shape) -> Snapshot {
    let now = Instant::ZERO.saturating_add(status.elapsed);
    let validity = status.validity.to_string();
    Snapshot {
        elapsed: status.elapsed,
        // The page says itself that it is not valid, and then why.
        invalid: (!status.validity.is_valid()).then(|| validity.trim_start_matches("not valid: ").to_owned()),
        lateness: vec![quantiles(&status.ticks), quantiles(&status.releases)],
        links: status.links.iter().map(link).collect(),
        peers: status.peers.iter().zip(&shape.silences).map(|(peer, silence)| view(peer, *silence, shape.axes, now)).collect(),
        refused: status.door.map_or_else(Vec::new, |door| {
            let refused = door.refusals().filter(|(_, count)| *count > 0);
            refused.map(|(cause, count): (Refusal, u64)| (cause.name(), count)).collect()
        }),
    }
}

/// What a terminal shows behind the progress: how late ticks are, and who is not there.
pub(super) fn note(scene: &Scene, snapshot: &Snapshot) -> String {
    let late = snapshot.lateness.first().map_or_else(String::new, |ticks| format!("  ticks p99 {:.0} µs late", micros(ticks.p99)));
    let missing = snapshot.peers.iter().zip(&scene.peers).filter(|(peer, _)| matches!(peer.status, Shown::Absent | Shown::Stale));
    missing.fold(late, |text, (peer, spec)| format!("{text}  {} {}", spec.name, peer.status.name()))
}

fn link(link: &LinkStatus) -> LinkCounters {
    LinkCounters { delivered_bytes: link.delivered_bytes, recent_delay: quantiles_of(&link.recent), ..counters(&link.stats) }
}

fn view(peer: &PeerStatus, silence: Duration, axes: usize, now: Instant) -> PeerView {
    let (status, age) = match peer.state.presence {
        Presence::Here => (Shown::Here, None),
        Presence::Absent => (Shown::Absent, None),
        Presence::Present => (Shown::Present, None),
        // It was heard for the last time so long before it counted as silent.
        Presence::Stale(since) => (Shown::Stale, Some(now.saturating_duration_since(since).saturating_add(silence))),
    };
    PeerView { status, age, position: peer.state.object.position[..axes].to_vec(), force: peer.force[..axes].to_vec() }
}
