//! The scene of a part of `cohaptic play`: the scene file's document with another strategy, another number of peers, changed links, and the states in which
//! the part before ended.

use std::path::{Path, PathBuf};

use cohaptic_live::PeerStatus;
use cohaptic_peer::{Contact, Gains};
use cohaptic_scene::{LinkKeys, PeerKind, Scene, SceneError, scene_text};
use toml::{Table, Value};

/// Accepted numbers of peers.
pub(super) const PEERS: std::ops::RangeInclusive<usize> = 2..=10;

/// Longest duration of a part. The comparison replays the whole recording, and people wait for the result.
const DURATION: &str = "1h";

/// Gains of the visitor's grasp if no simulated peer of the scene touches the object. The default scene of the command has the same gains.
const GRASP: Gains = Gains { stiffness: 1000.0, damping: 5.0 };

/// A scene as a TOML document. Changes are made in the document, and the scene is parsed from the document.
#[derive(Clone, Debug)]
pub(super) struct PlayedScene {
    /// The document without `[[peers]]`.
    table: Table,
    /// The entries of `[[peers]]`, one per peer, in the order of the scene.
    peers: Vec<Table>,
    /// Path of the scene file. File names in the scene are relative to the folder of the file.
    file: PathBuf,
}

/// Keys of each link, with the indices of sender and receiver.
pub(super) type Links = Vec<((usize, usize), LinkKeys)>;

/// Returns the message of an error for a page: the key and the fault, without lines of a file.
pub(super) fn said(error: &SceneError) -> String {
    // People at a page may name a file in a change of links, but must not see the file's content in an error.
    let message = error.bare_message();
    error.diagnostic().map_or_else(|| message.clone(), |diagnostic| format!("{}: {message}", diagnostic.key()))
}

impl PlayedScene {
    /// Reads a scene for play: applies the overrides, sets the duration to [`DURATION`], and removes the expectations, which hold for the file's own duration.
    pub(super) fn read(text: &str, file: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        let scene = Scene::parse_live(text, file, overrides)?;
        let text = scene_text(text, file, overrides)?;
        let mut table: Table = toml::from_str(&text).expect("what was read as TOML is TOML");
        table.remove("expect");
        let about = section(&mut table, "scene");
        about.insert("duration".to_owned(), DURATION.into());
        about.insert("title".to_owned(), scene.title.clone().into());
        // Peers that `count` generates get entries of their own, because each peer has its own position when the next part begins.
        about.remove("count");
        let written: Vec<Table> = table.remove("peers").and_then(|peers| peers.try_into().ok()).unwrap_or_default();
        let peer = |name: &str| {
            let known = written.iter().find(|peer| peer.get("name").and_then(Value::as_str) == Some(name));
            known.cloned().unwrap_or_else(|| Table::from_iter([("name".to_owned(), Value::from(name))]))
        };
        let peers = scene.peers.iter().map(|spec| peer(&spec.name)).collect();
        Ok(Self { table, peers, file: file.to_path_buf() })
    }

    /// Returns the text of the scene, which is a valid scene file.
    pub(super) fn text(&self) -> String {
        let mut table = self.table.clone();
        table.insert("peers".to_owned(), Value::Array(self.peers.iter().cloned().map(Value::Table).collect()));
        toml::to_string(&table).expect("a table of TOML can be written")
    }

    pub(super) fn file(&self) -> &Path {
        &self.file
    }

    /// Parses the scene.
    pub(super) fn scene(&self) -> Result<Scene, SceneError> {
        Scene::parse_live(&self.text(), &self.file, &[])
    }

    /// Makes a peer a pointer if the scene has no pointer, and then returns the name of the peer too.
    ///
    /// The peer is the first simulated peer that touches the object, or else the first simulated peer, which then gets a grasp. Peers with a turning device are
    /// left out, because a pointer cannot turn a device. `None` if no peer can become a pointer.
    pub(super) fn with_hand(mut self) -> Result<Option<(Self, Option<String>)>, SceneError> {
        let scene = self.scene()?;
        if scene.peers.iter().any(|peer| matches!(peer.kind, PeerKind::Pointer(..))) {
            return Ok(Some((self, None)));
        }
        let turns = |place: usize| scene.rotation.as_ref().is_some_and(|rotation| rotation.peers[place].device.is_some());
        let is_free = |place: &usize| matches!(scene.peers[*place].kind, PeerKind::Simulated) && !turns(*place);
        let touches = |place: &usize| scene.peers[*place].contact != Contact::None;
        let free = || (0..scene.peers.len()).filter(is_free);
        let Some(place) = free().find(touches).or_else(|| free().next()) else { return Ok(None) };
        let peer = &mut self.peers[place];
        peer.insert("kind".to_owned(), "pointer".into());
        if !touches(&place) {
            let gains = [("stiffness", GRASP.stiffness), ("damping", GRASP.damping)];
            // Without contact the visitor would move a device that never touches the object.
            peer.insert("contact".to_owned(), "grasp".into());
            peer.insert("coupling".to_owned(), Value::Table(gains.into_iter().map(|(key, gain)| (key.to_owned(), gain.into())).collect()));
        }
        let name = scene.peers[place].name.clone();
        Ok(Some((self, Some(name))))
    }

    pub(super) fn has_timeline(&self) -> bool {
        self.table.get("timeline").and_then(Value::as_array).is_some_and(|changes| !changes.is_empty())
    }

    pub(super) fn with_strategy(mut self, name: &str) -> Self {
        section(&mut self.table, "coordination").insert("strategy".to_owned(), name.into());
        self
    }

    /// Replaces all links and access lines by ideal links, which neither delay nor lose packets.
    pub(super) fn without_network(mut self) -> Self {
        self.table.remove("links");
        self.table.insert("link".to_owned(), Value::Table(Table::new()));
        // Access lines stand in the entries of the peers, and in the table `peer` for all.
        for peer in self.peers.iter_mut().chain([section(&mut self.table, "peer")]) {
            peer.remove("uplink");
            peer.remove("downlink");
        }
        self
    }

    /// Sets the keys of the links. A pair of peers without an entry in `links` gets the keys of the first link of `links`. No links change nothing.
    pub(super) fn with_links(mut self, links: &Links) -> Self {
        let Some((_, first)) = links.first() else { return self };
        let names = self.names();
        let keys = |keys: &LinkKeys| -> Table {
            let value = |text: &str| toml::from_str::<Table>(&format!("value = {text}")).ok().and_then(|mut table| table.remove("value"));
            keys.iter().filter_map(|(key, text)| Some((key.to_owned(), value(text)?))).collect()
        };
        // Equal links need no entry per pair, and peers added later get the keys of `link` too.
        if links.iter().all(|(_, other)| other == first) {
            self.table.remove("links");
            self.table.insert("link".to_owned(), Value::Table(keys(first)));
            return self;
        }
        let places = 0..names.len();
        let pairs = places.clone().flat_map(|from| places.clone().map(move |to| (from, to))).filter(|(from, to)| from != to);
        let entry = |pair: (usize, usize)| {
            let known = links.iter().find(|(known, _)| *known == pair).map_or(first, |(_, keys)| keys);
            let ends = [("from", pair.0), ("to", pair.1)].map(|(end, place)| (end.to_owned(), Value::from(names[place].as_str())));
            Value::Table(ends.into_iter().chain(keys(known)).collect())
        };
        // The common `link` table is emptied below, so that every pair needs an entry with all keys.
        let entries: Vec<Value> = pairs.map(entry).collect();
        self.table.insert("link".to_owned(), Value::Table(Table::new()));
        self.table.insert("links".to_owned(), Value::Array(entries));
        self
    }

    /// Sets the initial states to the states `peers` of the part before, whose scene was `scene`. A held pointer is held from the beginning.
    pub(super) fn standing(mut self, peers: &[PeerStatus], scene: &Scene) -> Self {
        let axes = scene.axes.count();
        let numbers = |values: &[f64]| Value::Array(values.iter().copied().map(Value::Float).collect());
        // A peer without a state keeps the initial state of the document.
        for ((table, status), spec) in self.peers.iter_mut().zip(peers).zip(&scene.peers) {
            let state = &status.state;
            let mut set = |key: &str, value: Value| table.insert(key.to_owned(), value);
            set("position", numbers(&state.object.position[..axes]));
            set("velocity", numbers(&state.object.velocity[..axes]));
            if let Some(device) = state.device {
                set("device-position", numbers(&device.position[..axes]));
                set("device-velocity", numbers(&device.velocity[..axes]));
            }
            if let Some(turn) = state.turn {
                set("orientation", numbers(&turn.object.orientation));
                set("angular-velocity", numbers(&turn.object.rate));
            }
            if matches!(spec.kind, PeerKind::Pointer(..)) {
                let held = matches!(state.presence, cohaptic_harness::live::Presence::Present);
                section(table, "pointer").insert("held".to_owned(), held.into());
            }
        }
        self
    }

    /// Changes the number of peers: removes the last peers and their links, or adds copies of the last peer, at rest at the mean position of all copies.
    pub(super) fn with_peers(mut self, number: usize) -> Self {
        let names = self.names();
        let places: Vec<Vec<f64>> = self.peers.iter().map(|peer| floats(peer.get("position"))).collect();
        // Axes with a position in every entry. A document without positions gives 0, and the mean is then left out.
        let axes = places.iter().map(Vec::len).min().unwrap_or(0);
        #[expect(clippy::cast_precision_loss, reason = "a handful of peers")]
        let mean = (0..axes).map(|axis| places.iter().map(|place| place[axis]).sum::<f64>() / places.len() as f64);
        let mean = Value::Array(mean.map(Value::Float).collect());
        self.peers.truncate(number);
        while self.peers.len() < number {
            let mut other = self.peers.last().cloned().unwrap_or_default();
            // A peer of the file may have such a name.
            let free = (self.peers.len() + 1..).map(|place| format!("peer-{place}")).find(|name| !names.contains(name));
            // The new peer begins without a hand and at rest, unlike the copied peer.
            for key in ["hand", "velocity", "device-position", "device-velocity", "angular-velocity"] {
                other.remove(key);
            }
            other.insert("name".to_owned(), free.unwrap_or_default().into());
            if axes > 0 {
                other.insert("position".to_owned(), mean.clone());
            }
            // Nobody holds the pointer of a new peer.
            if let Some(Value::Table(pointer)) = other.get_mut("pointer") {
                pointer.remove("held");
            }
            self.peers.push(other);
        }
        let names = self.names();
        // Links of removed peers would name unknown peers, and the scene would be refused.
        if let Some(Value::Array(links)) = self.table.get_mut("links") {
            let is_there = |end: Option<&Value>| end.and_then(Value::as_str).is_some_and(|end| names.iter().any(|name| name == end));
            links.retain(|link| is_there(link.get("from")) && is_there(link.get("to")));
        }
        self
    }

    fn names(&self) -> Vec<String> {
        self.peers.iter().filter_map(|peer| peer.get("name").and_then(Value::as_str)).map(str::to_owned).collect()
    }
}

/// Returns the table at `key`. A missing value, or a value of another form, is replaced by an empty table.
fn section<'a>(table: &'a mut Table, key: &str) -> &'a mut Table {
    let entry = table.entry(key.to_owned()).or_insert_with(|| Value::Table(Table::new()));
    if !entry.is_table() {
        *entry = Value::Table(Table::new());
    }
    entry.as_table_mut().expect("it is a table")
}

fn floats(value: Option<&Value>) -> Vec<f64> {
    value.and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_float).collect()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_harness::live::{PeerState, Presence};
    use cohaptic_peer::State;
    use cohaptic_scene::link_keys_of_text;

    use super::*;

    const TEXT: &str = include_str!("../../scenarios/live/play.toml");

    fn played(overrides: &[&str]) -> PlayedScene {
        let overrides: Vec<String> = overrides.iter().map(|key| (*key).to_owned()).collect();
        PlayedScene::read(TEXT, Path::new("play.toml"), &overrides).unwrap()
    }

    #[test]
    fn a_part_is_the_scene_with_its_overrides_without_expectations() {
        let scene = played(&["link.delay=8ms", "peers.third.device.mass=0.2"]).scene().unwrap();
        let expected = ["link.delay=8ms", "peers.third.device.mass=0.2", "scene.duration=1h", "expect={}"].map(str::to_owned);
        let expected = Scene::parse_live(TEXT, Path::new("play.toml"), &expected).unwrap();
        assert_eq!(Scene { expect: None, ..scene }, Scene { expect: None, ..expected });
    }

    fn standing(place: usize) -> PeerStatus {
        #[expect(clippy::cast_precision_loss, reason = "a handful of peers")]
        let x = 0.01 * (place + 1) as f64 + 1e-17;
        let object = State { position: [x, -x, 0.0], velocity: [0.1, x / 3.0, 0.0] };
        let device = State { position: [x + 0.001, 0.0, 0.0], velocity: [0.0, 0.2, 0.0] };
        let presence = if place == 0 { Presence::Present } else { Presence::Absent };
        PeerStatus {
            state: PeerState { presence, heard: None, device: Some(device), object, turn: None },
            force: [0.0; 3],
            seat: None,
            connection: None,
        }
    }

    #[test]
    fn a_part_begins_to_the_bit_where_the_last_one_stood() {
        let before = played(&[]);
        let peers: Vec<PeerStatus> = (0..3).map(standing).collect();
        let scene = before.clone().standing(&peers, &before.scene().unwrap()).with_strategy("proportional-derivative").scene().unwrap();
        for (place, status) in peers.iter().enumerate() {
            let (copy, device): (State<3>, State<3>) = (scene.initial_state(place), scene.initial_device(place));
            assert_eq!((copy, Some(device)), (status.state.object, status.state.device));
            let PeerKind::Pointer(_, pointer) = scene.peers[place].kind else { panic!("{scene:?}") };
            assert_eq!(pointer.held, place == 0);
        }
        assert_eq!(scene.coordination.strategy.name(), "proportional-derivative");
    }

    #[test]
    fn peers_come_in_the_middle_and_the_last_ones_go() {
        let before = played(&["links.you.third.delay=9ms"]);
        let peers: Vec<PeerStatus> = (0..3).map(standing).collect();
        let stood = before.clone().standing(&peers, &before.scene().unwrap());
        let more = stood.clone().with_peers(5).scene().unwrap();
        let names: Vec<&str> = more.peers.iter().map(|peer| peer.name.as_str()).collect();
        assert_eq!(names, ["you", "second", "third", "peer-4", "peer-5"]);
        let last = &more.peers[4];
        assert!((last.position[0] - 0.02).abs() < 1e-15 && last.velocity.iter().all(|v| v.abs() < 1e-15) && last.hand.is_none());
        assert_eq!(more.initial_state::<3>(1), peers[1].state.object);
        let fewer = stood.with_peers(2).scene().unwrap();
        assert_eq!(fewer.peers.len(), 2);
    }

    #[test]
    fn links_are_as_they_were_changed_and_new_pairs_have_the_keys_of_the_first() {
        let before = played(&[]);
        let keys = link_keys_of_text(&before.text(), before.file(), &[]).unwrap();
        let mut links: Links = keys.into_iter().collect();
        let delay = |scene: &PlayedScene, pair: (usize, usize)| {
            let keys = link_keys_of_text(&scene.text(), scene.file(), &[]).unwrap();
            keys[&pair].model("".as_ref()).unwrap().mean_delay()
        };
        for (_, keys) in &mut links {
            *keys = keys.with("delay", "\"60ms\"");
        }
        assert_eq!(delay(&before.clone().with_links(&links), (2, 1)), Duration::from_millis(60));
        links[3].1 = links[3].1.with("delay", "\"5ms\"");
        let changed = before.with_peers(4).with_links(&links);
        assert_eq!(delay(&changed, links[3].0), Duration::from_millis(5));
        assert_eq!(delay(&changed, (3, 0)), Duration::from_millis(60));
        assert_eq!(delay(&changed.without_network(), (3, 0)), Duration::ZERO);
    }
}
