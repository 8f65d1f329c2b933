//! `[\[peers\]]` and `count`: the peers of the scene.

use core::time::Duration;
use std::collections::BTreeMap;

use cohaptic_linkfile::document::{BEGINNING, Entry, Node, Place, join, quote};
use cohaptic_linkfile::reading::{Context, Names, one_of, values};
use cohaptic_peer::Gains;
use cohaptic_units::print::Counted;

use super::peer::{PEER, PEERS, PeerKeys, nested, read_peer};
use super::rotation::PeerRotationKeys;
use crate::context::SceneContext;
use crate::model::{ObjectSpec, PeerSpec, Scaling};

/// The names of the peers; `None` where they are not known for certain. `count`: as given under `[scene]`.
pub(crate) fn read_names(peers: Option<&Node>, count: Option<u64>, context: Context<'_>) -> Option<Names> {
    let mut names = Names::default();
    let mut given = Names::default();
    for number in 1..=count.unwrap_or(0) {
        names.push(&format!("peer{number}"));
    }
    let entries = match peers {
        Some(node) => values::list(node, context, "entries [[peers]]")?,
        None => Vec::new(),
    };
    let mut complete = true;
    for entry in &entries {
        let Some(name) = entry_name(entry, context) else {
            complete = false;
            continue;
        };
        let (name, node) = name;
        if !given.push(name) {
            context.fault_at(node, format!("there is a peer {} already: expected another name", quote(name)));
            complete = false;
        } else if count.is_none() {
            names.push(name);
        } else if names.index(name).is_none() {
            context.fault_with(node, || {
                let expected = one_of(names.as_slice().iter().map(String::as_str), name);
                format!("{} is none of the peers that scene.count makes: expected {expected}", quote(name))
            });
            complete = false;
        }
    }
    complete.then_some(names)
}

/// Reports a scene with fewer than two peers, at the first place that has to do with it.
pub(crate) fn check_enough(names: &Names, peers: Option<&Node>, context: Context<'_>) {
    if names.len() < 2 {
        let (place, path) = peers.map_or((BEGINNING, "peers"), |node| (node.place, node.path.as_str()));
        let message = format!("a scene with {}: expected at least two entries [[peers]], or scene.count", Counted(names.len(), "peer"));
        context.fault(place, path, message);
    }
}

/// The name of an entry, and where it is written.
fn entry_name<'a>(entry: &'a Node, context: Context<'a>) -> Option<(&'a str, &'a Node)> {
    const EXPECTED: &str = "a name, without space and none of . > / , \" and not \"all\"";
    let Some(name) = entry.as_table().and_then(|table| table.get("name")) else {
        // Whatever else is wrong with the entry is said when its other keys are read.
        return None;
    };
    let text = values::text(&name.node, context, EXPECTED)?;
    let unfit = |c: char| c.is_whitespace() || c.is_control() || matches!(c, '.' | '>' | '/' | ',' | '"');
    if text.is_empty() || text == "all" || text.contains(unfit) {
        context.fault_at(&name.node, format!("{} cannot be the name of a peer: expected {EXPECTED}", quote(text)));
        return None;
    }
    Some((text, &name.node))
}

/// The parts of the document that say what the peers are like.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PeerSources<'a> {
    /// `[peer]`.
    pub(crate) defaults: Option<&'a Node>,
    /// `[\[peers\]]`.
    pub(crate) entries: Option<&'a Node>,
    /// `count` under `[scene]`.
    pub(crate) count: Option<&'a Entry>,
    /// The period of sending, and where it is written.
    pub(crate) update: Option<(Duration, &'a Node)>,
}

/// A peer as it is written.
#[derive(Clone, Debug)]
pub(crate) struct PeerRead {
    pub(crate) spec: PeerSpec,
    /// What it says of an object that turns.
    pub(crate) rotation: PeerRotationKeys,
    /// Where it is made.
    pub(crate) place: Place,
}

/// Every peer, in the order of the names. `None` where one was refused.
pub(crate) fn read_peers(sources: PeerSources<'_>, object: Option<&ObjectSpec>, context: SceneContext<'_>) -> Option<Vec<PeerRead>> {
    if let Some(node) = sources.defaults {
        // On their own, so that a fault in a default that every peer replaces is found too.
        read_peer(node, context.of_part(), &PEER, None);
    }
    let nothing = Node::empty_table(sources.count.map_or(BEGINNING, |entry| entry.key), "peer".to_owned());
    let base = sources.defaults.filter(|node| node.as_table().is_some()).unwrap_or(&nothing);
    let entries = match sources.entries {
        Some(node) => values::list(node, *context, "entries [[peers]]")?,
        None => Vec::new(),
    };
    let own: Vec<Option<PeerKeys>> = entries.iter().map(|entry| read_entry(entry, base, sources.update, context)).collect();
    let names = context.names?;
    // What a peer without an entry is like; read only if there is one.
    let shared = if entries.len() < names.len() { Some(read_peer(base, context, &PEER, sources.update)?) } else { None };
    let mut keys: BTreeMap<usize, (PeerKeys, Place)> = BTreeMap::new();
    for (entry, own) in entries.iter().zip(own) {
        let name = entry.as_table().and_then(|table| table.get("name")).and_then(|name| name.node.as_text())?;
        keys.insert(names.index(name)?, (own?, entry.place));
    }
    let named = names.as_slice().iter().enumerate();
    let made = sources.count.map_or(base.place, |entry| entry.key);
    named
        .map(|(place, name)| {
            let (keys, place) = keys.remove(&place).or_else(|| Some((shared.clone()?, made)))?;
            let rotation = keys.rotation.clone();
            Some(PeerRead { spec: spec(name, keys, object?), rotation, place })
        })
        .collect()
}

fn read_entry(entry: &Node, base: &Node, update: Option<(Duration, &Node)>, context: SceneContext<'_>) -> Option<PeerKeys> {
    if entry.as_table().is_some_and(|table| table.get("name").is_none()) {
        context.fault(entry.place, &join(&entry.path, "name"), "missing key: expected the name of the peer");
    }
    read_peer(&entry.over(base, &nested()), context, &PEERS, update)
}

fn spec(name: &str, keys: PeerKeys, object: &ObjectSpec) -> PeerSpec {
    let (coupling, coupling_scaling) = keys.coupling.unwrap_or((Gains { stiffness: 0.0, damping: 0.0 }, Scaling::None));
    PeerSpec {
        name: name.to_owned(),
        kind: keys.kind,
        clock: keys.clock,
        phase: keys.phase,
        compute_delay: keys.compute_delay,
        contact: keys.contact,
        device: keys.device,
        coupling,
        coupling_scaling,
        hand: keys.hand,
        position: keys.position.unwrap_or(object.position),
        velocity: keys.velocity.unwrap_or(object.velocity),
        device_position: keys.device_position,
        device_velocity: keys.device_velocity,
        uplink: keys.uplink,
        downlink: keys.downlink,
    }
}
