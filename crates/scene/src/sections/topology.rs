//! Reader of `[topology]`: the peers to which each peer sends.

use std::sync::Arc;

use cohaptic_linkfile::document::{Node, Value, quote};
use cohaptic_linkfile::mesh::read_peer_name;
use cohaptic_linkfile::reading::named_file::{file_path, read_file};
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_linkfile::schema::{Choices, Form, Table, optional, usual, words};

use crate::topology::{Topology, parse_graph};

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Full,
    Star,
    Ring,
    Graph,
}

pub(crate) static TOPOLOGY: Table = Table::of(&[&[
    usual("kind", Form::Words(const { &words(&KINDS) }), "\"full\"", "Neighbours of a peer"),
    optional("neighbours", Form::Integer(2, u16::MAX as u64), "Number of neighbours in a ring, even; 2 by default")
        .expecting("how many peers each hears, an even number from 2 to 65534"),
    optional("hub", Form::Text, "Name of the hub of a star; the first peer by default"),
    optional("role", Form::Words(const { &words(&ROLES) }), "Role of the hub; peer by default"),
    optional("file", Form::File, "File of the mutual weights of a graph, one row per peer"),
]]);
const KINDS: Choices<Kind, 4> = [
    ("full", Kind::Full, "all others"),
    ("star", Kind::Star, "the hub, or all others of the hub"),
    ("ring", Kind::Ring, "half before it, half behind it"),
    ("graph", Kind::Graph, "those with a weight above 0"),
];
const ROLES: Choices<Role, 2> = [("peer", Role::Peer, "has a copy"), ("relay", Role::Relay, "no peer: hands samples on")];

/// Receivers of each peer, and the way of samples to the receivers.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Ways {
    /// Neighbours of each peer; `None` if every peer sends to every other peer.
    pub(crate) neighbours: Option<Arc<Topology>>,
    /// True if a sample to all receivers passes the sender's uplink once, to a relay.
    pub(crate) relay: bool,
}

/// Role of the hub of a star.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Role {
    Peer,
    Relay,
}

/// Reads the topology.
pub(crate) fn read_topology(node: &Node, context: Context<'_>) -> Option<Ways> {
    let mut table = TableReader::new(node, context, &TOPOLOGY, "a table such as { kind = \"ring\", neighbours = 2 }")?;
    let kind = table.choice("kind", &KINDS);
    let peers = context.names.map(|names| names.len());
    // A key of another kind is refused, not ignored. After a fault in the kind every key is accepted.
    let only_of = |table: &mut TableReader<'_>, of: Kind, word: &str, key: &'static str| {
        let message = format!("only a topology of kind = {} has this key: expected that kind, or no such key", quote(word));
        table.only_if(kind.is_none_or(|kind| kind == of), key, &message)
    };
    let neighbours = only_of(&mut table, Kind::Ring, "ring", "neighbours")
        .and_then(|()| table.maybe("neighbours", |node, context| read_neighbours(node, context).map(|count| (count, node))));
    let hub = only_of(&mut table, Kind::Star, "star", "hub")
        .and_then(|()| table.maybe("hub", |node, context| read_peer_name(node, context).map(|hub| (hub, node))));
    let role =
        only_of(&mut table, Kind::Star, "star", "role").and_then(|()| table.maybe("role", |node, context| values::word(node, context, &ROLES)));
    let file = only_of(&mut table, Kind::Graph, "graph", "file").and_then(|()| {
        table.maybe("file", |node, context| {
            let path = file_path(node, context, "the name of a file of weights, relative to the folder of the scene")?;
            let peers = peers?;
            read_file(node, context, &path, &format!("weights of {peers} peers"), |text| parse_graph(text, peers))
        })
    });
    if kind == Some(Kind::Graph) {
        table.require("file", "the name of a file of weights, a row a peer and numbers between commas");
    }
    table.finish();
    let (neighbours, hub, role, file, peers) = (neighbours?, hub?, role?, file?, peers?);
    // A star whose hub is a relay is a topology of all to all: the relay hands on each sample to everybody.
    if role == Some(Role::Relay) {
        if let Some((_, node)) = hub {
            context.fault_at(node, "a relay passes on what it hears and is not a peer: expected no hub, or role = \"peer\"");
            return None;
        }
        return Some(Ways { neighbours: None, relay: true });
    }
    let neighbours = match kind? {
        Kind::Full => Some(None),
        // A scene with fewer than two peers is refused by `check_enough`.
        Kind::Star => Topology::star(peers, hub.map_or(0, |(hub, _)| hub)).map(Arc::new).map(Some),
        Kind::Ring => {
            // Two neighbours by default. A fault of the default is shown at the table.
            let (count, node) = neighbours.map_or((2, node), |(count, node)| (count, node));
            let ring = Topology::ring(peers, count);
            if ring.is_none() && peers >= 2 {
                let message = format!(
                    "{peers} peers on a ring with {count} neighbours each: expected an even number of neighbours, fewer than there are peers"
                );
                context.fault_at(node, message);
            }
            ring.map(Arc::new).map(Some)
        }
        Kind::Graph => file.map(Some),
    };
    neighbours.map(|neighbours| Ways { neighbours, relay: false })
}

fn read_neighbours(node: &Node, context: Context<'_>) -> Option<usize> {
    let count: u64 = values::of_key(TOPOLOGY.key("neighbours")?, node, context)?;
    if !count.is_multiple_of(2) {
        context.fault_at(node, format!("{count} neighbours cannot lie half on either side: expected an even number"));
        return None;
    }
    usize::try_from(count).ok()
}

/// Refuses each entry of a list with a link outside the topology. `within` is the key of the ends `from` and `to` in an entry; `None` if the entry itself has
/// the ends.
pub(crate) fn refuse_unlinked(entries: Option<&Node>, within: Option<&str>, topology: &Topology, context: Context<'_>) {
    let (Some(entries), Some(names)) = (entries, context.names) else { return };
    let Value::List(entries) = &entries.value else { return };
    for entry in entries {
        let ends: Option<&Node> = match within {
            None => Some(&**entry),
            Some(key) => entry.as_table().and_then(|table| table.get(key)).map(|entry| &*entry.node),
        };
        let end = |key: &str| {
            let node = &ends?.as_table()?.get(key)?.node;
            Some((node, names.index(node.as_text()?)?))
        };
        // An entry without both ends names all links or an access line, or the fault was reported where the entry was read.
        let (Some((_, from)), Some((node, to))) = (end("from"), end("to")) else { continue };
        if from != to && !topology.has_link(from, to) {
            let name = |peer: usize| quote(&names.as_slice()[peer]);
            let message = format!(
                "{} does not send to {} in this topology, so there is no such link: expected neighbours, or another [topology]",
                name(from),
                name(to)
            );
            context.fault_at(node, message);
        }
    }
}
