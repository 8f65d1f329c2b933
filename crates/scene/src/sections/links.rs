//! `[link]` and `[\[links\]]`: what lies between the peers.
//!
//! A full mesh of N peers has N·(N−1) links, nearly all of them alike. Links are therefore sorted into *classes*: one for `[link]` and one for each
//! entry that says something else. Only classes are read; a change in the timeline makes new ones.

use std::collections::BTreeSet;
use std::sync::Arc;

use cohaptic_wan::LinkModel;

use super::link::{LINK_KEYS, is_empty, read_link};
use super::selector::read_ends;
use crate::context::Context;
use crate::model::{LinkChange, LinkTable};
use crate::source::BEGINNING;
use crate::table_reader::TableReader;
use crate::tree::Node;
use crate::values;

/// The classes of links as they stand at some time.
#[derive(Clone, Debug)]
pub(crate) struct LinkClasses {
    classes: Vec<Class>,
    /// For each sender, for each receiver, its class.
    index: Vec<Vec<usize>>,
}

/// The keys of a class as written, and what they say.
#[derive(Clone, Debug)]
struct Class {
    keys: Node,
    config: Arc<LinkModel>,
}

/// Reads `[link]` and `[\[links\]]`. `None` where something was refused.
pub(crate) fn read_links(defaults: Option<&Node>, entries: Option<&Node>, context: Context<'_>) -> Option<LinkClasses> {
    let nothing = Node::empty_table(BEGINNING, "link".to_owned());
    let defaults = defaults.unwrap_or(&nothing);
    let base = read_link(defaults, context, &[]);
    let entries = match entries {
        Some(node) => values::list(node, context, "entries [[links]]")?,
        None => Vec::new(),
    };
    let below = if defaults.as_table().is_some() { defaults } else { &nothing };
    let mut seen = BTreeSet::new();
    let own: Vec<_> = entries.iter().map(|entry| read_entry(entry, below, &mut seen, context)).collect();

    let base = Class { keys: defaults.clone(), config: Arc::new(base?) };
    let count = context.names?.len();
    let mut links = LinkClasses { classes: vec![base], index: vec![vec![0; count]; count] };
    for entry in own {
        let (ends, class) = entry?;
        if let Some((keys, config)) = class {
            let class = links.add(keys, config);
            links.set(ends, class);
        }
    }
    Some(links)
}

/// The ends of an entry and, if it says anything else, its keys laid over those of `[link]`.
#[expect(clippy::type_complexity, reason = "used once, above")]
fn read_entry(
    entry: &Node,
    below: &Node,
    seen: &mut BTreeSet<(usize, usize)>,
    context: Context<'_>,
) -> Option<((usize, usize), Option<(Node, LinkModel)>)> {
    let mut table = TableReader::new(entry, context, "a table with from, to and link keys")?;
    let ends = read_ends(&mut table, context);
    let to = table.get("to");
    // Its other keys, known and unknown, are looked at below; what is missing is said here.
    if entry.as_table().is_some_and(|table| table.get("from").is_none() || table.get("to").is_none()) {
        let rest = entry.as_table()?.0.iter().filter(|entry| !matches!(entry.name.as_str(), "from" | "to"));
        if rest.clone().all(|entry| LINK_KEYS.contains(&entry.name.as_str())) {
            table.know(&LINK_KEYS);
            table.finish();
        }
    }
    let own = entry.without(&["from", "to"]);
    let class = if is_empty(&own) {
        Some(None)
    } else {
        let keys = own.over(below, &[]);
        read_link(&keys, context, &["from", "to"]).map(|config| Some((keys, config)))
    };
    let ends = ends?;
    if !seen.insert(ends) {
        context.fault_at(to?, "there is an entry for this link already: expected one entry for each pair of peers");
        return None;
    }
    Some((ends, class?))
}

impl LinkClasses {
    /// The table of configurations: equal ones are shared, and stand in order of first use.
    pub(crate) fn table(&self) -> LinkTable {
        let mut configs: Vec<Arc<LinkModel>> = Vec::new();
        let mut config_of: Vec<Option<usize>> = vec![None; self.classes.len()];
        let mut index = self.index.clone();
        for (from, row) in index.iter_mut().enumerate() {
            for (to, place) in row.iter_mut().enumerate() {
                if from == to {
                    *place = 0;
                    continue;
                }
                let class = *place;
                *place = *config_of[class].get_or_insert_with(|| {
                    let config = &self.classes[class].config;
                    configs.iter().position(|known| known == config).unwrap_or_else(|| {
                        configs.push(Arc::clone(config));
                        configs.len() - 1
                    })
                });
            }
        }
        LinkTable { configs, index }
    }

    /// Lays keys over those of one link, or of all (`None`), and answers what these links are now. `None` where something was refused.
    pub(crate) fn change(&mut self, ends: Option<(usize, usize)>, keys: &Node, context: Context<'_>) -> Option<Vec<LinkChange>> {
        let changed = match ends {
            Some(ends) => vec![ends],
            None => self.pairs(),
        };
        let mut new_class: Vec<Option<usize>> = vec![None; self.classes.len()];
        let mut answer = Vec::with_capacity(changed.len());
        for ends in changed {
            let old = *self.index.get(ends.0)?.get(ends.1)?;
            let class = match new_class[old] {
                Some(class) => class,
                None => {
                    let merged = keys.over(&self.classes[old].keys, &[]);
                    let config = read_link(&merged, context, &[])?;
                    let class = self.add(merged, config);
                    new_class[old] = Some(class);
                    class
                }
            };
            self.set(ends, class);
            answer.push(LinkChange { from: ends.0, to: ends.1, config: Arc::clone(&self.classes[class].config) });
        }
        Some(answer)
    }

    /// Every directed link, by sender and then by receiver.
    fn pairs(&self) -> Vec<(usize, usize)> {
        let count = self.index.len();
        (0..count).flat_map(|from| (0..count).filter(move |&to| to != from).map(move |to| (from, to))).collect()
    }

    fn add(&mut self, keys: Node, config: LinkModel) -> usize {
        self.classes.push(Class { keys, config: Arc::new(config) });
        self.classes.len() - 1
    }

    fn set(&mut self, (from, to): (usize, usize), class: usize) {
        if let Some(place) = self.index.get_mut(from).and_then(|row| row.get_mut(to)) {
            *place = class;
        }
    }
}
