//! Which peer, which axis, which link: references from one part of a scene to another.

use crate::context::Context;
use crate::model::LinkSelector;
use crate::names::{Names, one_of};
use crate::table_reader::TableReader;
use crate::tree::{Node, quote};
use crate::values;

/// The peer of that name, by its place.
pub(crate) fn read_peer_name(node: &Node, context: Context<'_>) -> Option<usize> {
    let expected = format!("the name of a {}", context.names.map_or("peer", Names::noun));
    let name = values::text(node, context, &expected)?;
    // Without the list of names, the fault is there.
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

/// An axis that the scene has, from 0.
pub(crate) fn read_axis(node: &Node, context: Context<'_>) -> Option<usize> {
    let axis = values::choice(node, context, &[("x", 0), ("y", 1), ("z", 2)])?;
    check_axis(node, context, axis)
}

/// Reports an axis that the scene does not have.
pub(crate) fn check_axis(node: &Node, context: Context<'_>, axis: usize) -> Option<usize> {
    let count = context.axes?.count();
    if axis >= count {
        let there = ["x", "y", "z"][..count].join(", ");
        context
            .fault_at(node, format!("{} is beyond the axes of this scene: expected {there}, or a larger number under scene.axes", node.describe()));
        return None;
    }
    Some(axis)
}

/// The two ends of a link, which differ: `from` and `to` of a table that may have other keys.
pub(crate) fn read_ends(table: &mut TableReader<'_>, context: Context<'_>) -> Option<(usize, usize)> {
    let to_node = table.get("to");
    let noun = context.names.map_or("peer", Names::noun);
    let from = table.required("from", &format!("the name of the {noun} that sends"), read_peer_name);
    let to = table.required("to", &format!("the name of the {noun} that receives"), read_peer_name);
    let (from, to) = (from?, to?);
    if from == to {
        context.fault_at(to_node?, format!("a {noun} has no link to itself: expected the name of another {noun}"));
        return None;
    }
    Some((from, to))
}

/// Links between peers: "all", or one of them.
pub(crate) fn read_links_between(node: &Node, context: Context<'_>) -> Option<LinkSelector> {
    const EXPECTED: &str = "\"all\" or a table such as { from = \"left\", to = \"right\" }";
    if is_all(node, context, EXPECTED)? {
        return Some(LinkSelector::All);
    }
    let mut table = TableReader::new(node, context, EXPECTED)?;
    let ends = read_ends(&mut table, context);
    table.finish();
    ends.map(|(from, to)| LinkSelector::Between { from, to })
}

/// Links between peers, or an access line.
pub(crate) fn read_link_or_line(node: &Node, context: Context<'_>) -> Option<LinkSelector> {
    const EXPECTED: &str = "\"all\", { from = …, to = … }, { uplink = … } or { downlink = … }";
    if is_all(node, context, EXPECTED)? {
        return Some(LinkSelector::All);
    }
    let mut table = TableReader::new(node, context, EXPECTED)?;
    let (uplink, downlink) = (table.entry("uplink"), table.entry("downlink"));
    if uplink.is_none() && downlink.is_none() {
        let ends = read_ends(&mut table, context);
        table.finish();
        return ends.map(|(from, to)| LinkSelector::Between { from, to });
    }
    let (from, to) = (table.entry("from"), table.entry("to"));
    table.finish();
    let chosen = super::hand::only_one(node, context, &[uplink, downlink, from, to], EXPECTED)?;
    let peer = read_peer_name(&chosen.node, context)?;
    Some(if uplink.is_some() { LinkSelector::Uplink(peer) } else { LinkSelector::Downlink(peer) })
}

/// Whether the value is "all"; any other text is a fault.
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
