//! Connects a session with its onlookers: the terminal and live control. Publishes snapshots of the session and passes on changes of links.
//! No function here waits, because the thread of the session calls these functions.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender};

use cohaptic_control::{
    Body, Description, JoinedView, Kind, LinkCounters, LinkEditor, LinkName, MeasureLabel, PeerName, PeerView, Presence as Shown, Snapshot, TurnView,
};
use cohaptic_harness::live::Presence;
use cohaptic_live::{Conductor, Connection, LinkChange, LinkStatus, OtherScene, PeerStatus, Refusal, Status};
use cohaptic_scene::{LinkKeys, MeasureName, Scene};
use cohaptic_units::Instant;

use crate::document_schema::micros;
use crate::interrupt;
use crate::realtime::{Edit, KeyedLinks, Look, counters, quantiles, quantiles_of};

/// Conductor of a session. Publishes snapshots and passes the changes of live control on to the session.
pub(super) struct SessionConductor {
    look: Option<Look>,
    wanted: Receiver<Edit>,
    /// Sender and receiver of each link, indexed as the links of the description.
    pairs: Vec<(usize, usize)>,
    elapsed: Elapsed,
    /// Number of axes of the scene. Positions and forces in snapshots have this length.
    axes: usize,
    /// Peers that asked with another scene, for the thread that prints.
    others: Sender<OtherScene>,
}

impl SessionConductor {
    pub(super) const fn new(
        look: Option<Look>,
        wanted: Receiver<Edit>,
        pairs: Vec<(usize, usize)>,
        elapsed: Elapsed,
        axes: usize,
        others: Sender<OtherScene>,
    ) -> Self {
        Self { look, wanted, pairs, elapsed, axes, others }
    }
}

impl Conductor for SessionConductor {
    fn keep_going(&mut self) -> bool {
        !interrupt::requested()
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        change(&self.wanted, &self.pairs)
    }

    fn show(&mut self, status: Status) {
        self.elapsed.set(Instant::ZERO.saturating_add(status.elapsed));
        if let Some(look) = &self.look {
            look.publish(snapshot(&status, self.axes));
        }
    }

    fn notice_other_scene(&mut self, other: OtherScene) {
        // The channel has no bound, so sending does not wait. Without a receiver the session has ended.
        let _ = self.others.send(other);
    }

    fn wants_status(&self) -> bool {
        self.look.is_some()
    }
}

/// Returns the next change of a link by live control, or `None` if no change is waiting.
pub(crate) fn change(wanted: &Receiver<Edit>, pairs: &[(usize, usize)]) -> Option<LinkChange> {
    let Edit { link, keys, model } = wanted.try_recv().ok()?;
    let (from, to) = *pairs.get(link)?;
    Some(LinkChange { from, to, keys, model })
}

/// Returns sender and receiver of every directed link, ordered by sender, then by receiver.
pub(crate) fn pairs(scene: &Scene) -> Vec<(usize, usize)> {
    let places = 0..scene.peers.len();
    places.clone().flat_map(|from| places.clone().map(move |to| (from, to))).filter(|(from, to)| from != to).collect()
}

pub(crate) fn description(scene: &Scene, pairs: &[(usize, usize)]) -> Description {
    let name = |peer: usize| scene.peers[peer].name.clone();
    let label = |name: &MeasureName| MeasureLabel { name: name.text(scene), unit: name.measure.unit(), about: name.measure.about() };
    Description {
        kind: Kind::Live,
        title: scene.title.clone(),
        links: pairs
            .iter()
            .map(|(from, to)| LinkName { name: format!("{}->{}", name(*from), name(*to)), from: name(*from), to: name(*to) })
            .collect(),
        peers: scene.peers.iter().map(|peer| PeerName { name: peer.name.clone(), kind: peer.kind.name().to_owned() }).collect(),
        clocks: vec!["tick".to_owned(), "release".to_owned()],
        measures: scene.measure.iter().flat_map(|measure| &measure.names).map(label).collect(),
        body: scene
            .rotation
            .as_ref()
            .zip(scene.even_box())
            .map(|(rotation, edges)| Body { edges, grasps: rotation.peers.iter().map(|peer| peer.grasp).collect() }),
    }
}

pub(crate) fn snapshot(status: &Status, axes: usize) -> Snapshot {
    let now = Instant::ZERO.saturating_add(status.elapsed);
    Snapshot {
        elapsed: status.elapsed,
        invalid: status.validity.reason(),
        // In the order of the clocks of `description`.
        lateness: vec![quantiles(&status.ticks), quantiles(&status.releases)],
        links: status.links.iter().map(link).collect(),
        peers: status.peers.iter().map(|peer| view(peer, axes, now)).collect(),
        refused: status.admission.map_or_else(Vec::new, |door| {
            let refused = door.refusals().filter(|(_, count)| *count > 0);
            refused.map(|(cause, count): (Refusal, u64)| (cause.name(), count)).collect()
        }),
        measures: status.measures.iter().map(|measured| measured.value).collect(),
    }
}

/// Formats the text after the progress bar: the lateness of ticks, and the peers that are absent or stale.
pub(super) fn note(scene: &Scene, snapshot: &Snapshot) -> String {
    let late = snapshot.lateness.first().map_or_else(String::new, |ticks| format!("  ticks p99 {:.0} µs late", micros(ticks.p99)));
    // The line names only missing peers, because a terminal line is short.
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
    // A peer without a sample so far has no age.
    let age = state.heard.map(|heard| now.saturating_duration_since(heard));
    let turn = state.turn.map(|turn| TurnView {
        orientation: turn.object.orientation,
        device: state.device.map(|device| device.position),
        device_orientation: turn.device.map(|device| device.orientation),
    });
    PeerView {
        status,
        age,
        position: state.object.position[..axes].to_vec(),
        force: peer.force[..axes].to_vec(),
        turn,
        joined: peer.connection.as_ref().map(joined),
    }
}

fn joined(connection: &Connection) -> JoinedView {
    let Connection { address, label, lost, sent } = *connection;
    JoinedView { device: label.text().unwrap_or("udp").to_owned(), address: address.ip().to_canonical().to_string(), lost, sent }
}

/// Changes of the timeline, ordered by instant: the changed links, by index in the description, and the keys of each link from this instant on.
pub(super) type Planned = VecDeque<(Instant, Vec<(usize, LinkKeys)>)>;

/// Elapsed time of a session, for onlookers. The thread of the session writes the time, and the thread of live control reads the time.
#[derive(Clone, Debug, Default)]
pub(super) struct Elapsed(Arc<AtomicU64>);

impl Elapsed {
    pub(super) fn set(&self, now: Instant) {
        // `Relaxed` suffices, because no other memory depends on the time.
        self.0.store(now.as_nanos(), Ordering::Relaxed);
    }

    fn get(&self) -> Instant {
        Instant::from_nanos(self.0.load(Ordering::Relaxed))
    }
}

/// Editor of the links of a session with a timeline. A change by the timeline replaces all earlier changes by live control of the same link.
pub(super) struct TimedLinks {
    pub(super) links: KeyedLinks,
    pub(super) planned: Planned,
    pub(super) elapsed: Elapsed,
}

impl LinkEditor for TimedLinks {
    fn keys(&self, link: usize) -> Vec<(String, String)> {
        let now = self.elapsed.get();
        // Changes of the timeline since the last call of `change` are not in `links` yet. The last such change of the link gives the current keys.
        let past = self.planned.iter().take_while(|(at, _)| *at <= now).flat_map(|(_, links)| links);
        match past.filter(|(changed, _)| *changed == link).last() {
            Some((_, keys)) => keys.iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect(),
            None => self.links.keys(link),
        }
    }

    fn change(&mut self, links: &[usize], keys: &[(String, String)]) -> Result<(), String> {
        let now = self.elapsed.get();
        // The past changes of the timeline enter `links` before the new keys, because the new keys are laid over the current ones.
        let past = self.planned.partition_point(|(at, _)| *at <= now);
        for (link, keys) in self.planned.drain(..past).flat_map(|(_, changed)| changed) {
            self.links.keys[link] = keys;
        }
        self.links.change(links, keys)
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::sync::mpsc::channel;

    use super::*;
    use crate::realtime::ControlFiles;

    #[test]
    fn keys_follow_the_timeline_and_changes_are_laid_over_what_it_says() {
        let delay = |text: &str| LinkKeys::default().with("delay", text);
        let (changes, made) = channel();
        let elapsed = Elapsed::default();
        let at = |millis: u64| Instant::from_nanos(millis * 1_000_000);
        let planned = [(at(100), vec![(0, delay("2ms"))]), (at(200), vec![(0, delay("3ms"))])].into();
        let links = KeyedLinks { keys: vec![delay("1ms"), delay("1ms")], folder: PathBuf::new(), files: ControlFiles::default(), changes };
        let mut links = TimedLinks { links, planned, elapsed: elapsed.clone() };
        let shown = |links: &TimedLinks, link| links.keys(link)[0].1.clone();
        assert_eq!(shown(&links, 0), "1ms");
        elapsed.set(at(150));
        assert_eq!((shown(&links, 0), shown(&links, 1)), ("2ms".to_owned(), "1ms".to_owned()));
        links.change(&[0], &[("loss".to_owned(), "0.5".to_owned())]).unwrap();
        assert_eq!(made.try_recv().unwrap().keys.to_string(), "{ delay = \"2ms\", loss = 0.5 }");
        elapsed.set(at(250));
        assert_eq!(links.keys(0), [("delay".to_owned(), "3ms".to_owned())]);
    }
}
