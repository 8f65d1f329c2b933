//! Readers of `[link]` and `[\[links\]]`: the links between the peers.
//!
//! A full mesh of N peers has N·(N−1) links, nearly all of them alike. Links are therefore sorted into *classes*: a class for `[link]`, and a class for each
//! entry with further keys. Only classes are read, and only links with an entry are stored. A change in the timeline makes new classes.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use cohaptic_units::Instant;
use cohaptic_wan::LinkModel;

use super::link_keys::{KeysOfLinks, LinkKeys};
use super::link_table::{LinkChange, LinkTable, first_left, pairs};
use super::selector::{LinkSelector, read_ends};
use crate::document::{BEGINNING, Node};
use crate::link::keys::LINK_ENTRY;
use crate::link::{is_empty, read_link, read_link_of};
use crate::reading::{Context, Modulators, Names, TableReader, values};

/// Classes of links at some instant of the timeline.
#[derive(Clone, Debug)]
pub struct LinkClasses {
    /// All classes made so far. Unused classes stay, so that indices stay valid.
    classes: Vec<Class>,
    /// Number of peers.
    peers: usize,
    /// Index in `classes` of the links without an entry.
    usual: usize,
    /// Indices in `classes` of the links with an entry or a change of their own, by sender and receiver.
    own: BTreeMap<(usize, usize), usize>,
    /// Modulators of the file, to which the keys refer.
    modulators: Arc<Modulators>,
}

/// Observer of the links of a file. Called once with the links at the start, and after each change of the timeline with the instant and the changed links.
pub type OnLinks<'a> = &'a mut dyn FnMut(Instant, LinkSelector, &LinkClasses);

/// Class of links: keys as written, and the configuration read from the keys.
#[derive(Clone, Debug)]
struct Class {
    keys: Node,
    config: Arc<LinkModel>,
}

/// Reads `[link]` and `[\[links\]]`. Returns `None` if `[link]` or an entry was refused.
pub fn read_links(defaults: Option<&Node>, entries: Option<&Node>, context: Context<'_>) -> Option<LinkClasses> {
    let nothing = Node::empty_table(BEGINNING, "link".to_owned());
    let defaults = defaults.unwrap_or(&nothing);
    let base = read_link(defaults, context);
    let entries = match entries {
        Some(node) => values::list(node, context, "entries [[links]]")?,
        None => Vec::new(),
    };
    // A `[link]` that is no table has been refused. The entries are still read, over an empty table.
    let below = if defaults.as_table().is_some() { defaults } else { &nothing };
    let mut seen = BTreeSet::new();
    let own: Vec<_> = entries.iter().map(|entry| read_entry(entry, below, &mut seen, context)).collect();

    // Answers are used only from here on, so that every entry was read and the first fault of the text is found.
    let base = Class { keys: defaults.clone(), config: Arc::new(base?) };
    let mut links = LinkClasses {
        classes: vec![base],
        peers: context.names?.len(),
        usual: 0,
        own: BTreeMap::new(),
        modulators: context.modulators.map_or_else(Arc::default, Arc::clone),
    };
    for entry in own {
        let (ends, class) = entry?;
        if let Some((keys, config)) = class {
            let class = links.add(keys, config);
            links.own.insert(ends, class);
        }
    }
    Some(links)
}

/// Checks the keys of a change without the changed links, so that a fault is found even if the links are not known. Returns `None` only if the change has no
/// keys.
pub fn read_key_changes(set: &Node, context: Context<'_>) -> Option<()> {
    read_link(set, context.of_part());
    if is_empty(set) {
        context.fault_at(set, "nothing changes: expected keys of a link");
        return None;
    }
    Some(())
}

/// Reads the ends of an entry and, if the entry has further keys, the keys laid over `below`, the keys of `[link]`.
#[expect(clippy::type_complexity, reason = "used once, above")]
fn read_entry(
    entry: &Node,
    below: &Node,
    seen: &mut BTreeSet<(usize, usize)>,
    context: Context<'_>,
) -> Option<((usize, usize), Option<(Node, LinkModel)>)> {
    let mut table = TableReader::new(entry, context, &LINK_ENTRY, "a table with from, to and link keys")?;
    let ends = read_ends(&mut table, context);
    let to = table.get("to");
    // `read_link_of` below reports unknown keys of the entry. Only a missing end is reported here, and only if no key is unknown.
    let lacks_an_end = ["from", "to"].iter().any(|end| table.get(end).is_none());
    if lacks_an_end && entry.as_table().is_some_and(|keys| keys.0.iter().all(|entry| LINK_ENTRY.key(&entry.name).is_some())) {
        table.know_all();
        table.finish();
    }
    let own = entry.without(&["from", "to"]);
    let class = if is_empty(&own) {
        Some(None)
    } else {
        let keys = own.over(below, &[]);
        read_link_of(&LINK_ENTRY, &keys, context).map(|config| Some((keys, config)))
    };
    let ends = ends?;
    if !seen.insert(ends) {
        let noun = context.names.map_or("peer", Names::noun);
        context.fault_at(to?, format!("there is an entry for this link already: expected one entry for each direction between two {noun}s"));
        return None;
    }
    Some((ends, class?))
}

impl LinkClasses {
    /// Returns the table of configurations, or `None` for fewer than two peers, which have no links and are refused elsewhere.
    pub fn table(&self) -> Option<LinkTable> {
        let config = |class: usize| Arc::clone(&self.classes[class].config);
        (self.peers >= 2).then(|| LinkTable::new(self.peers, config(self.usual), self.own.iter().map(|(ends, class)| (*ends, config(*class)))))
    }

    /// Returns the keys of the links of `selector`, in the order of laying over. For an access line the answer is empty.
    #[must_use]
    pub fn keys(&self, selector: LinkSelector) -> KeysOfLinks {
        let keys =
            |class: usize| self.classes[class].keys.as_table().map_or_else(LinkKeys::default, |table| LinkKeys::of_table(table, &self.modulators));
        let class = |pair: (usize, usize)| self.own.get(&pair).copied().unwrap_or(self.usual);
        match selector {
            LinkSelector::All => {
                // The keys are made once per class, because nearly all links share a class.
                let of_class: Vec<LinkKeys> = (0..self.classes.len()).map(keys).collect();
                pairs(self.peers).map(|pair| (pair, of_class[class(pair)].clone())).collect()
            }
            LinkSelector::Between { from, to } => BTreeMap::from([((from, to), keys(class((from, to))))]),
            LinkSelector::Uplink(_) | LinkSelector::Downlink(_) => KeysOfLinks::new(),
        }
    }

    /// Lays keys over the keys of a link, and returns the changed link. Returns `None` if the keys were refused.
    pub fn change(&mut self, (from, to): (usize, usize), keys: &Node, context: Context<'_>) -> Option<LinkChange> {
        // Only this link leaves the class. The class stays for the remaining links.
        let old = self.own.get(&(from, to)).copied().unwrap_or(self.usual);
        let class = self.lay_over(old, keys, context)?;
        self.own.insert((from, to), class);
        Some(LinkChange { from, to, config: Arc::clone(&self.classes[class].config) })
    }

    /// Lays keys over the keys of all links, and returns the new table. Returns `None` if the keys were refused.
    pub fn change_all(&mut self, keys: &Node, context: Context<'_>) -> Option<LinkTable> {
        // Each old class in use gets a single new class: links of the same old class share the new class.
        let mut new_class = BTreeMap::new();
        for old in self.in_order_of_use() {
            if let Entry::Vacant(place) = new_class.entry(old) {
                place.insert(self.lay_over(old, keys, context)?);
            }
        }
        let renewed = |old: &usize| new_class.get(old).copied().unwrap_or(*old);
        self.usual = renewed(&self.usual);
        self.own.values_mut().for_each(|class| *class = renewed(class));
        self.table()
    }

    /// Returns the classes in use, by sender and then by receiver of their links, so that the first of several faults does not depend on the order of classes.
    /// A class can occur more than once.
    fn in_order_of_use(&self) -> Vec<usize> {
        // `first` is the first link without an entry. At its position the usual class is used for the first time.
        let first = first_left(self.peers, self.own.keys().copied());
        let before = self.own.iter().take_while(|(ends, _)| first.is_none_or(|first| **ends < first));
        let after = self.own.iter().skip_while(|(ends, _)| first.is_none_or(|first| **ends < first));
        let class = |(_, class): (&(usize, usize), &usize)| *class;
        before.map(class).chain(first.map(|_| self.usual)).chain(after.map(class)).collect()
    }

    /// Returns the index of a new class: `keys` laid over the keys of the class `old`. Returns `None` if the keys were refused.
    fn lay_over(&mut self, old: usize, keys: &Node, context: Context<'_>) -> Option<usize> {
        let merged = keys.over(&self.classes.get(old)?.keys, &[]);
        let config = read_link(&merged, context)?;
        Some(self.add(merged, config))
    }

    /// Adds a class, and returns the index of the class.
    fn add(&mut self, keys: Node, config: LinkModel) -> usize {
        self.classes.push(Class { keys, config: Arc::new(config) });
        self.classes.len() - 1
    }
}
