//! Reader of `[\[peers\]]` and `count`: names and keys of all peers.

use core::time::Duration;
use std::collections::BTreeMap;

use cohaptic_linkfile::document::{BEGINNING, Entry, Node, Place, join, quote};
use cohaptic_linkfile::library::of_owner;
use cohaptic_linkfile::reading::{Context, Names, one_of, values};
use cohaptic_peer::operator::Seen;
use cohaptic_peer::{Gains, Hand};
use cohaptic_units::print::Counted;

use super::peer::{PEER, PEERS, PeerKeys, nested, read_peer};
use super::rotation::PeerRotationKeys;
use crate::context::SceneContext;
use crate::model::{ObjectSpec, PeerSpec, Scaling};

/// Reads the names of the peers; `None` if any name was refused. `count` is the number given under `[scene]`.
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
        // With a count, `names` holds every name already, so that duplicates are found in `given`.
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

/// Reports a scene with fewer than two peers, at the list of peers or, without a list, at the beginning of the file.
pub(crate) fn check_enough(names: &Names, peers: Option<&Node>, context: Context<'_>) {
    if names.len() < 2 {
        let (place, path) = peers.map_or((BEGINNING, "peers"), |node| (node.place, node.path.as_str()));
        let message = format!("a scene with {}: expected at least two entries [[peers]], or scene.count", Counted(names.len(), "peer"));
        context.fault(place, path, message);
    }
}

/// Returns the name of an entry and the node of the name. `None` for an entry without a name, and after a fault.
fn entry_name<'a>(entry: &'a Node, context: Context<'a>) -> Option<(&'a str, &'a Node)> {
    const EXPECTED: &str = "a name, without space and none of . > / , \" and not \"all\"";
    let Some(name) = entry.as_table().and_then(|table| table.get("name")) else {
        // The missing name is reported by `read_entry`, which reads the other keys.
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

/// Parts of the document for making the peers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PeerSources<'a> {
    /// Node of `[peer]`.
    pub(crate) defaults: Option<&'a Node>,
    /// Node of `[\[peers\]]`.
    pub(crate) entries: Option<&'a Node>,
    /// Entry `count` under `[scene]`.
    pub(crate) count: Option<&'a Entry>,
    /// Period of sending, and the node of the period.
    pub(crate) update: Option<(Duration, &'a Node)>,
}

/// A peer as written.
#[derive(Clone, Debug)]
pub(crate) struct PeerRead {
    pub(crate) spec: PeerSpec,
    /// Rotational keys of the peer.
    pub(crate) rotation: PeerRotationKeys,
    /// Place of the peer in the text: the place of the entry or, without an entry, of `scene.count`.
    pub(crate) place: Place,
}

/// Reads every peer, in the order of the names. `None` if any peer was refused.
pub(crate) fn read_peers(sources: PeerSources<'_>, object: Option<&ObjectSpec>, context: SceneContext<'_>) -> Option<Vec<PeerRead>> {
    if let Some(node) = sources.defaults {
        // `[peer]` is also read alone, so that a fault in a default is found even if every peer replaces this default.
        read_peer(node, context.of_part(), &PEER, None);
    }
    // Stands for an absent `[peer]`. Faults such as a missing device are shown at `count`.
    let nothing = Node::empty_table(sources.count.map_or(BEGINNING, |entry| entry.key), "peer".to_owned());
    // A `[peer]` that is no table was refused above.
    let base = sources.defaults.filter(|node| node.as_table().is_some()).unwrap_or(&nothing);
    let entries = match sources.entries {
        Some(node) => values::list(node, *context, "entries [[peers]]")?,
        None => Vec::new(),
    };
    // Entries with a name alone have the keys of `[peer]`, which are read for the first of these entries. After a fault, each entry is read and reports it.
    let mut unchanged: Option<PeerKeys> = None;
    let read = |entry: &&Node| {
        if entry.as_table().is_none_or(|table| table.0.len() != 1 || table.get("name").is_none()) {
            return read_entry(entry, base, sources.update, context);
        }
        unchanged = unchanged.take().or_else(|| read_entry(entry, base, sources.update, context));
        unchanged.clone()
    };
    // Every entry is read before the first `?`, so that the faults of all entries are reported.
    let own: Vec<Option<PeerKeys>> = entries.iter().map(read).collect();
    let names = context.names?;
    // Keys of a peer without an entry. Read only if there is such a peer, because defaults alone need not be complete.
    let shared = if entries.len() < names.len() { Some(read_peer(base, context, &PEER, sources.update)?) } else { None };
    let mut keys: BTreeMap<usize, (PeerKeys, Place)> = BTreeMap::new();
    for (entry, own) in entries.iter().zip(own) {
        let name = entry.as_table().and_then(|table| table.get("name")).and_then(|name| name.node.as_text())?;
        keys.insert(names.index(name)?, (own?, entry.place));
    }
    let named = names.as_slice().iter().enumerate();
    let made = sources.count.map_or(base.place, |entry| entry.key);
    named
        .map(|(index, name)| {
            // The keys of the entry, otherwise the shared keys, which exist if any peer has no entry.
            let (keys, place) = keys.remove(&index).or_else(|| Some((shared.clone()?, made)))?;
            let rotation = keys.rotation.clone();
            Some(PeerRead { spec: spec(name, index, keys, object?), rotation, place })
        })
        .collect()
}

fn read_entry(entry: &Node, base: &Node, update: Option<(Duration, &Node)>, context: SceneContext<'_>) -> Option<PeerKeys> {
    if entry.as_table().is_some_and(|table| table.get("name").is_none()) {
        context.fault(entry.place, &join(&entry.path, "name"), "missing key: expected the name of the peer");
    }
    read_peer(&entry.over(base, &nested()), context, &PEERS, update)
}

fn spec(name: &str, index: usize, keys: PeerKeys, object: &ObjectSpec) -> PeerSpec {
    let mut hand = keys.hand;
    // The name of the peer itself, where peers share the keys of `[peer]`.
    if let Some(Hand::Operator { operator, .. }) = &mut hand
        && operator.sees == Seen::Peer(index)
    {
        operator.sees = Seen::Own;
    }
    let (coupling, coupling_scaling) = keys.coupling.unwrap_or((Gains { stiffness: 0.0, damping: 0.0 }, Scaling::None));
    PeerSpec {
        name: name.to_owned(),
        kind: keys.kind,
        clock: keys.clock,
        phase: keys.phase,
        compute_delay: keys.compute_delay,
        contact: keys.contact,
        device: keys.device,
        exchange: keys.exchange,
        coupling,
        coupling_scaling,
        hand,
        position: keys.position.unwrap_or(object.position),
        velocity: keys.velocity.unwrap_or(object.velocity),
        device_position: keys.device_position,
        device_velocity: keys.device_velocity,
        // A modulator of the library is the peer's own, also where several peers share the keys of `[peer]`.
        uplink: keys.access.uplink.map(|line| of_owner(line, name)),
        downlink: keys.access.downlink.map(|line| of_owner(line, name)),
    }
}
