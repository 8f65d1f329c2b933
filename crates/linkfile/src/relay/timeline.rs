//! `[\[timeline\]]`: links that become other ones while the relay runs.

use cohaptic_units::Instant;

use super::RelayChange;
use crate::document::Node;
use crate::mesh::{LinkChange, LinkClasses, LinkSelector, pairs, read_key_changes, read_links_between};
use crate::reading::{Context, TableReader, values};

/// Reads the changes and puts them in order of time. `links`: how things stand at the beginning; `None` if they were refused.
pub(super) fn read_timeline(node: Option<&Node>, links: Option<&LinkClasses>, context: Context<'_>) -> Option<Vec<RelayChange>> {
    let Some(node) = node else { return Some(Vec::new()) };
    let entries = values::list(node, context, "entries [[timeline]]")?;
    let planned: Vec<_> = entries.iter().map(|entry| read_entry(entry, context)).collect();
    let mut planned: Vec<(Instant, LinkSelector, &Node)> = planned.into_iter().collect::<Option<_>>()?;
    // Stable: equal instants stay in the order of the file.
    planned.sort_by_key(|(at, ..)| *at);
    let mut links = links?.clone();
    let mut changes = Vec::new();
    for (at, selector, set) in planned {
        if let LinkSelector::Between { from, to } = selector {
            changes.push(RelayChange { at, link: links.change((from, to), set, context)? });
            continue;
        }
        let table = links.change_all(set, context)?;
        let all = pairs(table.peers()).map(|(from, to)| LinkChange { from, to, config: table.configs()[table.config_between(from, to)].clone() });
        changes.extend(all.map(|link| RelayChange { at, link }));
    }
    Some(changes)
}

fn read_entry<'a>(entry: &'a Node, context: Context<'a>) -> Option<(Instant, LinkSelector, &'a Node)> {
    let mut table = TableReader::new(entry, context, "a table with at, link and set")?;
    let at = table.required("at", "a time such as \"3s\"", values::instant);
    let selector = table.required("link", "\"all\" or a table such as { from = \"left\", to = \"right\" }", read_links_between);
    let set = table.required("set", "a table of the keys that change", |node, _| Some(node));
    table.finish();
    let set = set?;
    read_key_changes(set, context)?;
    Some((at?, selector?, set))
}
