//! Readers of references to peers and links in another part of a file.

use crate::document::{Node, quote};
use crate::link::keys::{ENDS_TABLE, LINK_OR_LINE};
use crate::reading::{Context, Names, TableReader, one_of, only_one, values};

/// Selected links or access lines, by the indices of peers in the file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LinkSelector {
    /// All links between peers.
    All,
    /// A directed link.
    Between {
        /// Index of the sender.
        from: usize,
        /// Index of the receiver.
        to: usize,
    },
    /// The access line of a peer for sending.
    Uplink(usize),
    /// The access line of a peer for receiving.
    Downlink(usize),
}

/// Reads the name of a peer or program, and returns its index.
pub fn read_peer_name(node: &Node, context: Context<'_>) -> Option<usize> {
    let expected = format!("the name of a {}", context.names.map_or("peer", Names::noun));
    let name = values::text(node, context, &expected)?;
    // Without a list of names, the fault of the list has been reported.
    let names = context.names?;
    let index = names.index(name);
    if index.is_none() {
        context.fault_with(node, || {
            let expected = one_of(names.as_slice().iter().map(String::as_str), name);
            format!("there is no {} {}: expected {expected}", names.noun(), quote(name))
        });
    }
    index
}

/// Reads the keys `from` and `to` of a table that may have further keys. Two equal ends are a fault.
pub(super) fn read_ends(table: &mut TableReader<'_>, context: Context<'_>) -> Option<(usize, usize)> {
    let to_node = table.get("to");
    let noun = context.names.map_or("peer", Names::noun);
    let from = table.read_expecting("from", &format!("the name of the {noun} that sends"), read_peer_name);
    let to = table.read_expecting("to", &format!("the name of the {noun} that receives"), read_peer_name);
    let (from, to) = (from?, to?);
    if from == to {
        context.fault_at(to_node?, format!("a {noun} has no link to itself: expected the name of another {noun}"));
        return None;
    }
    Some((from, to))
}

/// Reads a selection of links between peers: "all", or the ends of a link.
pub fn read_links_between(node: &Node, context: Context<'_>) -> Option<LinkSelector> {
    const EXPECTED: &str = "\"all\" or a table such as { from = \"left\", to = \"right\" }";
    if is_all(node, context, EXPECTED)? {
        return Some(LinkSelector::All);
    }
    let mut table = TableReader::new(node, context, &ENDS_TABLE, EXPECTED)?;
    let ends = read_ends(&mut table, context);
    table.finish();
    ends.map(|(from, to)| LinkSelector::Between { from, to })
}

/// Reads a selection of links between peers, or of an access line.
pub fn read_link_or_line(node: &Node, context: Context<'_>) -> Option<LinkSelector> {
    const EXPECTED: &str = "\"all\", { from = …, to = … }, { uplink = … } or { downlink = … }";
    if is_all(node, context, EXPECTED)? {
        return Some(LinkSelector::All);
    }
    let mut table = TableReader::new(node, context, &LINK_OR_LINE, EXPECTED)?;
    let (uplink, downlink) = (table.entry("uplink"), table.entry("downlink"));
    if uplink.is_none() && downlink.is_none() {
        let ends = read_ends(&mut table, context);
        table.finish();
        return ends.map(|(from, to)| LinkSelector::Between { from, to });
    }
    // Asked for only to refuse both kinds of keys together in `only_one`.
    let (from, to) = (table.entry("from"), table.entry("to"));
    table.finish();
    let chosen = only_one(node, context, &[uplink, downlink, from, to], EXPECTED)?;
    let peer = read_peer_name(&chosen.node, context)?;
    Some(if uplink.is_some() { LinkSelector::Uplink(peer) } else { LinkSelector::Downlink(peer) })
}

/// Returns whether the value is "all". Any other text is a fault.
fn is_all(node: &Node, context: Context<'_>, expected: &str) -> Option<bool> {
    match node.as_text() {
        None => Some(false),
        Some("all") => Some(true),
        Some(other) => {
            context.fault_at(node, format!("unknown links {}: expected {expected}", quote(other)));
            None
        }
    }
}
