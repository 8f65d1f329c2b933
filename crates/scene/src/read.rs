//! Reader of whole scenes: from files and texts to [`Scene`]. Each part of the document is read by a function of `sections`; this module orders the calls and
//! checks relations between several parts.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use cohaptic_linkfile::document::{BEGINNING, Node, Sources, Value};
use cohaptic_linkfile::link::read_modulators;
use cohaptic_linkfile::mesh::{LinkClasses, OnLinks, read_links};
use cohaptic_linkfile::reading::{Context, Parsed, TableReader, default_title, parse, with_text};
use cohaptic_linkfile::schema::link::{LINK_ENTRY, LINK_TABLE, MODULATOR};
use cohaptic_linkfile::schema::{Form, Table, optional, required};
use cohaptic_linkfile::{FileError, LinkSelector};
use cohaptic_units::Instant;

use crate::context::SceneContext;
use crate::model::{ChangeKind, Scene};
use crate::sections::{
    COORDINATION, EXPECT, Header, MEASURE, Measured, OBJECT, Offered, PEER, PEERS, PeerSources, SCENE, SIMULATION, TASK, TIMELINE, TOPOLOGY, Ways,
    check_enough, read_coordination, read_expect, read_header, read_measure, read_names, read_object, read_peers, read_stepping, read_task,
    read_timeline, read_topology, refuse_rotational_keys, refuse_unlinked, rotation,
};

/// Keys at the top level of a scene.
pub(crate) static ROOT: Table = Table::of(&[&[
    required("scene", Form::Table(&SCENE), "Length, seed and axes of the scene").expecting("a table [scene] with a duration"),
    required("object", Form::Table(&OBJECT), "The shared virtual object, of which every peer has a copy").expecting("a table [object] with a mass"),
    required("coordination", Form::Table(&COORDINATION), "Coordination of the copies").expecting("a table [coordination] with a strategy"),
    optional("simulation", Form::Table(&SIMULATION), "Integration of the motion between two ticks"),
    optional("peer", Form::Table(&PEER), "Keys of every peer that does not have them in its own table"),
    optional("peers", Form::List(&Form::Table(&PEERS)), "One peer per entry: its own keys are laid over those of [peer]"),
    optional("topology", Form::Table(&TOPOLOGY), "Peers to which each peer sends"),
    optional("modulators", Form::List(&Form::Table(&MODULATOR)), "Chains of states that links follow"),
    optional("link", Form::Table(&LINK_TABLE), "Keys of every link that does not have them in its own table; links are ideal by default"),
    optional("links", Form::List(&Form::Table(&LINK_ENTRY)), "One direction between two peers per entry: its own keys are laid over those of [link]"),
    optional("timeline", Form::List(&Form::Table(&TIMELINE)), "Changes while the scene runs"),
    optional("task", Form::Table(&TASK), "What the users are asked to do with the object; a task moves nothing but operators"),
    optional("measure", Form::Table(&MEASURE), "Measures of a run, computed while it runs"),
    optional("expect", Form::Table(&EXPECT), "Expected results, which cohaptic check compares with those of a run"),
]]);

impl Scene {
    /// Reads a scene from a file. `overrides` are texts `KEY=VALUE` that replace values of the file, applied in this order.
    ///
    /// # Errors
    ///
    /// [`FileError::Read`] if the file, or a named file, cannot be read; [`FileError::Invalid`] for every fault of the content.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, FileError> {
        with_text(path, |text| Self::parse(text, path, overrides))
    }

    /// Reads a scene for a live session. Like [`Scene::read`], but a peer of kind `udp`, another process, needs neither device nor coupling.
    ///
    /// # Errors
    ///
    /// As [`Scene::read`].
    pub fn read_live(path: &Path, overrides: &[String]) -> Result<Self, FileError> {
        with_text(path, |text| Self::parse_live(text, path, overrides))
    }

    /// Reads a scene from a text. `file` appears in messages, and named files are relative to the folder of `file`.
    ///
    /// # Errors
    ///
    /// As [`Scene::read`]. Of several faults, the first in the order of the text; faults in overrides come after faults in the text.
    pub fn parse(text: &str, file: &Path, overrides: &[String]) -> Result<Self, FileError> {
        parse_scene(Sources { file, text, overrides }, false, &mut |_, _, _| ()).map(|parsed| parsed.whole)
    }

    /// Like [`Scene::parse`], for a live session as in [`Scene::read_live`].
    ///
    /// # Errors
    ///
    /// As [`Scene::parse`].
    pub fn parse_live(text: &str, file: &Path, overrides: &[String]) -> Result<Self, FileError> {
        parse_scene(Sources { file, text, overrides }, true, &mut |_, _, _| ()).map(|parsed| parsed.whole)
    }

    /// Returns the index in [`Scene::peers`] of the peer with this name; `None` if there is no such peer.
    #[must_use]
    pub fn peer_index(&self, name: &str) -> Option<usize> {
        self.peers.iter().position(|peer| peer.name == name)
    }
}

/// Returns a fault at the place where the peer with index `peer` is made: its entry `[[peers]]`, or `scene.count`. For faults of a readable scene.
#[must_use]
pub fn at_peer(text: &str, file: &Path, overrides: &[String], peer: usize, message: &str) -> FileError {
    let sources = Sources { file, text, overrides };
    let refused = parse(sources, |document, context| {
        let value = |table: &Node, key: &str| table.as_table()?.get(key).map(|entry| Arc::clone(&entry.node));
        let count = value(document, "scene").and_then(|header| value(&header, "count"));
        let peers = value(document, "peers");
        let entry = match peers.as_ref().map(|peers| &peers.value) {
            Some(Value::List(entries)) => entries.get(peer).cloned(),
            _ => None,
        };
        // With a count, the entry at this index may belong to another peer, so that the count is shown.
        let (place, key) = match count.or(entry).or(peers) {
            Some(node) => (node.place, node.path.clone()),
            None => (BEGINNING, String::new()),
        };
        context.fault(place, &key, message);
        Some(())
    });
    // Not reached: the closure reports a fault in every case, so that `parse` fails.
    refused.err().unwrap_or_else(|| FileError::NoFile { folder: file.to_path_buf(), kind: "scene" })
}

/// Reads the scene in a text. Calls `on_links` with the links of the beginning, then with the links after each change of the timeline.
pub(crate) fn parse_scene(sources: Sources<'_>, live: bool, on_links: OnLinks<'_>) -> Result<Parsed<Scene>, FileError> {
    parse(sources, |document, context| read_document(document, context, live, on_links))
}

/// Reads every part, also after a refused part, so that the reported fault is the first in the order of the text. `None` if any part was refused.
fn read_document(document: &Node, file: Context<'_>, live: bool, on_links: OnLinks<'_>) -> Option<Scene> {
    let mut root = TableReader::new(document, file, &ROOT, "a table")?;
    root.know_all();
    let header_node = root.get("scene");
    let header = root.read("scene", read_header).unwrap_or_default();
    // Names are read before the parts below, because the readers of these parts look up peers by name.
    let Header { title, duration, seed, axes, count } = header;
    let peers_node = root.get("peers");
    let names = count.and_then(|count| read_names(peers_node, count, file));
    let file = file.with_names(names.as_ref()).with_end(duration);
    let topology_node = root.get("topology");
    // After the names: a hub is a name, and a graph has a row for each peer.
    let topology = match topology_node {
        Some(node) => read_topology(node, file),
        None => Some(Ways::default()),
    };
    let modulators = read_modulators(root.get("modulators"), file);
    let file = file.with_modulators(modulators.as_ref());
    // Looked up in the document, because the object may be refused and readers of other parts depend on the answer.
    let turns = root.get("object").and_then(Node::as_table).is_some_and(|object| object.get("inertia").is_some());
    // Looked up in the document too: operators of peers need the kind of the task.
    let task_node = root.get("task");
    let task = task_node.map(|task| task.as_table().and_then(|task| task.get("kind")?.node.as_text()).unwrap_or_default());
    let context = SceneContext { file, axes, live, turns, task };
    // From here on the context holds axes, names and modulators, on which the readers below depend.
    let object = root.read("object", |node, _| read_object(node, context));
    let (object, object_rotation) = object.unzip();
    let coordination_node = root.get("coordination");
    let coordination = root.read("coordination", |node, _| read_coordination(node, file));
    let (coordination, rotation_gains) = coordination.unzip();
    let stepping = root.table("simulation", read_stepping);
    if object_rotation == Some(None) {
        refuse_rotational_keys(document, file);
    }
    let defaults = root.get("peer");
    // The tick of each peer is checked against the period of sending, so that coordination is read before the peers. The node is where a fault is shown.
    let update = coordination.as_ref().zip(coordination_node).map(|(coordination, node)| {
        let written = node.as_table().and_then(|table| table.get("update"));
        (coordination.update, written.map_or(node, |entry| &*entry.node))
    });
    let count_entry = header_node.and_then(Node::as_table).and_then(|table| table.get("count"));
    let peers = read_peers(PeerSources { defaults, entries: peers_node, count: count_entry, update }, object.as_ref(), context);
    // Needs all four parts. If a part was refused, the fault of the part is reported already.
    let rotation = match (object_rotation, rotation_gains, stepping, &peers) {
        (Some(object), Some(gains), Some(stepping), Some(peers)) => rotation(object, gains, stepping.rotation_steps, peers, file),
        _ => None,
    };
    let (peers, places): (Option<Vec<_>>, Option<Vec<_>>) =
        peers.map(|peers| peers.into_iter().map(|peer| (peer.spec, peer.place)).collect::<(Vec<_>, Vec<_>)>()).unzip();
    let (link, links) = (root.get("link"), root.get("links"));
    // Changes of links in the timeline are laid over the links of the beginning, so that links are read before the timeline.
    let links = read_links(link, links, file);
    if let Some(links) = &links {
        on_links(Instant::ZERO, LinkSelector::All, links);
    }
    let timeline_node = root.get("timeline");
    let timeline =
        read_timeline(timeline_node, duration, links.as_ref(), peers.as_deref(), coordination.as_ref(), on_links, context).map(|mut changes| {
            // Each change of a hand also plans a torque, which means nothing if the object does not turn.
            changes.retain(|change| turns || !matches!(change.what, ChangeKind::HandTorque { .. }));
            changes
        });
    // The probe is known after the measures only, which have the key.
    let offered = Offered { probe: false, task: task_node.is_some() };
    let of = Measured { peers: peers.as_deref(), timeline: timeline.as_deref(), offered };
    let measure = match root.get("measure") {
        Some(node) => read_measure(node, of, context).map(Some),
        None => Some(None),
    };
    let walls = object.as_ref().map(|object| object.enclosure);
    let task = task_node.map_or(Some(None), |node| read_task(node, duration, walls, context).map(Some));
    // A refused probe is a fault already: measures that need a probe must not be refused for a second reason.
    let has_probe = measure.as_ref().is_none_or(|measure| measure.as_ref().is_some_and(|measure| measure.settings.probe.is_some()));
    let expect = match root.get("expect") {
        Some(node) => read_expect(node, duration, Offered { probe: has_probe, ..offered }, peers.as_deref(), context).map(Some),
        None => Some(None),
    };
    if let Some(topology) = topology.as_ref().and_then(|ways| ways.neighbours.as_ref()) {
        refuse_unlinked(root.get("links"), None, topology, file);
        refuse_unlinked(timeline_node, Some("link"), topology, file);
        // No list of the scene may name a link between peers without a link in the topology.
        let mut expected = |key: &str| Some(&*root.get("expect")?.as_table()?.get(key)?.node);
        for key in ["loss", "delay"] {
            refuse_unlinked(expected(key), Some("link"), topology, file);
        }
    }
    root.finish();
    if let Some(names) = &names {
        check_enough(names, peers_node, file);
    }
    // From here on `?` ends the reading without a new fault: each `None` was reported where the value was read.
    let scene = Scene {
        file: context.sources.file.to_path_buf(),
        title: title?.unwrap_or_else(|| default_title(context.sources.file)),
        duration: duration?,
        seed: seed?,
        axes: axes?,
        object: object?,
        rotation: rotation?,
        coordination: coordination?,
        integrator: stepping?.integrator,
        peers: peers?,
        relay: topology.as_ref().is_some_and(|ways| ways.relay),
        topology: topology?.neighbours,
        links: links.as_ref().and_then(LinkClasses::table)?,
        profiles: file.profiles(),
        timeline: timeline?,
        task: task?.map(Box::new),
        measure: measure?,
        expect: expect?,
        scaled_for: None,
    };
    // Checks that compare several parts come last, when every part was read.
    if let (Some(node), Some(task)) = (task_node, &scene.task)
        && task.judged(&scene).is_empty()
    {
        file.fault_at(node, "no device touches the object, so no copy is judged: expected who = the name of a peer, or a peer that touches");
        return None;
    }
    if let (Some((peer, refused)), Some(places)) = (scene.refused_operator(), places) {
        file.fault(places[peer], "peers", refused);
        return None;
    }
    if let Some(refused) = scene.refused_topology() {
        file.fault_at(topology_node.unwrap_or(document), refused);
        return None;
    }
    let refused = match scene.refused_coordination().or_else(|| scene.refused_rotation()) {
        None => scene.refused_changes().map(|refused| (timeline_node, refused)),
        Some(refused) => Some((coordination_node, refused)),
    };
    if let Some((node, refused)) = refused {
        file.fault_at(node.unwrap_or(document), refused);
        return None;
    }
    Some(scene)
}

/// Returns the scene files of a path: the file itself or, for a folder, every file below the folder with a name that ends in `.toml`, in order of paths.
///
/// Symbolic links to folders are not followed.
///
/// # Errors
///
/// [`FileError::Read`] if the path or a folder below it cannot be read, [`FileError::NoFile`] for a folder without a scene.
pub fn scene_files(path: &Path) -> Result<Vec<PathBuf>, FileError> {
    let unreadable = |path: &Path, source| FileError::Read { path: path.to_path_buf(), source, place: None };
    // Follows a link in `path` itself, unlike `file_type` below.
    let kind = std::fs::metadata(path).map_err(|source| unreadable(path, source))?;
    if !kind.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let mut files = Vec::new();
    let mut folders = vec![path.to_path_buf()];
    // A stack of folders instead of recursion. The order does not matter, because the files are sorted below.
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).map_err(|source| unreadable(&folder, source))? {
            let entry = entry.map_err(|source| unreadable(&folder, source))?;
            let path = entry.path();
            let kind = entry.file_type().map_err(|source| unreadable(&path, source))?;
            if kind.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "toml") && path.is_file() {
                files.push(path);
            }
        }
    }
    // The order in which a system lists files is not defined.
    files.sort();
    if files.is_empty() { Err(FileError::NoFile { folder: path.to_path_buf(), kind: "scene" }) } else { Ok(files) }
}
