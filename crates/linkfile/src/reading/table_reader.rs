//! Reads a table key by key, and notices keys that nobody asked for.

use super::context::Context;
use super::names::one_of;
use crate::document::{Entry, Node, Table, join};

/// A table being read. [`TableReader::finish`] reports the keys that were not asked for and those that are missing.
#[derive(Debug)]
pub struct TableReader<'a> {
    node: &'a Node,
    table: &'a Table,
    context: Context<'a>,
    known: Vec<&'static str>,
    missing: Vec<(&'static str, String)>,
}

impl<'a> TableReader<'a> {
    /// Begins to read; `None`, and a fault, if the value is no table.
    pub fn new(node: &'a Node, context: Context<'a>, expected: &str) -> Option<Self> {
        let Some(table) = node.as_table() else {
            context.fault_at(node, format!("found {}: expected {expected}", node.describe()));
            return None;
        };
        Some(Self { node, table, context, known: Vec::new(), missing: Vec::new() })
    }

    /// The key and the value under it, if it is there.
    pub fn entry(&mut self, key: &'static str) -> Option<&'a Entry> {
        if !self.known.contains(&key) {
            self.known.push(key);
        }
        self.table.get(key)
    }

    /// The value under a key, if it is there.
    pub fn get(&mut self, key: &'static str) -> Option<&'a Node> {
        self.entry(key).map(|entry| &*entry.node)
    }

    /// The names of all keys, in the order in which they were laid over each other.
    pub fn names(&self) -> impl Iterator<Item = &'a str> {
        self.table.0.iter().map(|entry| entry.name.as_str())
    }

    /// The value under a key that must be there.
    pub fn required<T>(&mut self, key: &'static str, expected: &str, read: impl FnOnce(&'a Node, Context<'a>) -> Option<T>) -> Option<T> {
        match self.get(key) {
            Some(node) => read(node, self.context),
            None => {
                self.miss(key, expected);
                None
            }
        }
    }

    /// The value under a key, or the default if it is not there.
    pub fn optional<T>(&mut self, key: &'static str, default: T, read: impl FnOnce(&'a Node, Context<'a>) -> Option<T>) -> Option<T> {
        match self.get(key) {
            Some(node) => read(node, self.context),
            None => Some(default),
        }
    }

    /// The value under a key, or `Some(None)` if it is not there.
    pub fn maybe<T>(&mut self, key: &'static str, read: impl FnOnce(&'a Node, Context<'a>) -> Option<T>) -> Option<Option<T>> {
        match self.get(key) {
            Some(node) => read(node, self.context).map(Some),
            None => Some(None),
        }
    }

    /// Notes that a key should be there if it is not.
    pub fn require(&mut self, key: &'static str, expected: &str) {
        if self.get(key).is_none() {
            self.miss(key, expected);
        }
    }

    /// Notes that a key should be there.
    pub fn miss(&mut self, key: &'static str, expected: &str) {
        self.missing.push((key, expected.to_owned()));
    }

    /// Takes keys that somebody else reads.
    pub fn know(&mut self, keys: &[&'static str]) {
        self.known.extend_from_slice(keys);
    }

    /// Reports unknown keys; if there are none, missing ones. A key that is misspelt is both, and said once.
    pub fn finish(self) {
        #[cfg(feature = "testing")]
        super::testing::seen(&self.node.path, &self.known);
        let unknown: Vec<&Entry> = self.table.0.iter().filter(|entry| !self.known.contains(&entry.name.as_str())).collect();
        for entry in &unknown {
            let expected = one_of(self.known.iter().copied(), &entry.name);
            self.context.fault(entry.key, &entry.node.path, format!("unknown key: expected {expected}"));
        }
        if unknown.is_empty() && !self.context.partial {
            for (key, expected) in &self.missing {
                self.context.missing(self.node.place, &join(&self.node.path, key), format!("missing key: expected {expected}"));
            }
        }
    }
}

/// The one entry that is there. None, or more than one, is a fault.
pub fn only_one<'a>(node: &Node, context: Context<'_>, entries: &[Option<&'a Entry>], expected: &str) -> Option<&'a Entry> {
    let mut given: Vec<&Entry> = entries.iter().copied().flatten().collect();
    given.sort_by_key(|entry| entry.key);
    match given.as_slice() {
        [only] => Some(only),
        [] => {
            context.missing(node.place, &node.path, format!("nothing is given: expected {expected}"));
            None
        }
        [first, second, ..] => {
            let message = format!("\"{}\" is given already: expected only one of {expected}", first.name);
            context.fault(second.key, &second.node.path, message);
            None
        }
    }
}
