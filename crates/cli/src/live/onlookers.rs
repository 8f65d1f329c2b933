//! Between a session and onlookers, live control among them: nothing here waits.

use std::sync::mpsc::Receiver;

use cohaptic_control::{Description, Kind, LinkCounters, LinkName, PeerName, PeerView, Presence as Shown, Snapshot};
use cohaptic_harness::live::Presence;
use cohaptic_live::session::{LinkStatus, PeerStatus};
use cohaptic_live::{Conductor, LinkChange, Refusal, Status};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::timeline::Elapsed;
use crate::documents::micros;
use crate::interrupt;
use crate::realtime::{Edit, Look, counters, quantiles, quantiles_of};

/// Publishes the session and hands in what live control changes.
pub(super) struct SessionConductor {
    look: Option<Look>,
    wanted: Receiver<Edit>,
    /// The links in the order of the description.
    pairs: Vec<(usize, usize)>,
    elapsed: Elapsed,
    /// Of the scene.
    axes: usize,
}

impl SessionConductor {
    pub(super) const fn new(look: Option<Look>, wanted: Receiver<Edit>, pairs: Vec<(usize, usize)>, elapsed: Elapsed, axes: usize) -> Self {
        Self { look, wanted, pairs, elapsed, axes }
    }
}

impl Conductor for SessionConductor {
    fn keep_going(&mut self) -> bool {
        !interrupt::requested()
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        let Edit { link, keys, model } = self.wanted.try_recv().ok()?;
        let (from, to) = *self.pairs.get(link)?;
        Some(LinkChange { from, to, keys, model })
    }

    fn show(&mut self, status: Status) {
        self.elapsed.set(Instant::ZERO.saturating_add(status.elapsed));
        if let Some(look) = &self.look {
            look.publish(snapshot(&status, self.axes));
        }
    }

    fn wants_status(&self) -> bool {
        self.look.is_some()
    }
}

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

pub(super) fn snapshot(status: &Status, axes: usize) -> Snapshot {
    let now = Instant::ZERO.saturating_add(status.elapsed);
    let validity = status.validity.to_string();
    Snapshot {
        elapsed: status.elapsed,
        // The page says itself that it is not valid, and then why.
        invalid: (!status.validity.is_valid()).then(|| validity.trim_start_matches("not valid: ").to_owned()),
        lateness: vec![quantiles(&status.ticks), quantiles(&status.releases)],
        links: status.links.iter().map(link).collect(),
        peers: status.peers.iter().map(|peer| view(peer, axes, now)).collect(),
        refused: status.admission.map_or_else(Vec::new, |door| {
            let refused = door.refusals().filter(|(_, count)| *count > 0);
            refused.map(|(cause, count): (Refusal, u64)| (cause.name(), count)).collect()
        }),
    }
}

/// What a terminal shows behind the progress: how late ticks are, and which peers are absent.
pub(super) fn note(scene: &Scene, snapshot: &Snapshot) -> String {
    let late = snapshot.lateness.first().map_or_else(String::new, |ticks| format!("  ticks p99 {:.0} µs late", micros(ticks.p99)));
    let missing = snapshot.peers.iter().zip(&scene.peers).filter(|(peer, _)| matches!(peer.status, Shown::Absent | Shown::Stale));
    missing.fold(late, |text, (peer, spec)| format!("{text}  {} {}", spec.name, peer.status.name()))
}

fn link(link: &LinkStatus) -> LinkCounters {
    LinkCounters { delivered_bytes: link.delivered_bytes, recent_delay: quantiles_of(&link.recent), ..counters(&link.stats) }
}

fn view(peer: &PeerStatus, axes: usize, now: Instant) -> PeerView {
    let state = &peer.state;
    let status = match state.presence {
        Presence::Here => Shown::Here,
        Presence::Absent => Shown::Absent,
        Presence::Present => Shown::Present,
        Presence::Stale(_) => Shown::Stale,
    };
    let age = state.heard.map(|heard| now.saturating_duration_since(heard));
    PeerView { status, age, position: state.object.position[..axes].to_vec(), force: peer.force[..axes].to_vec() }
}
