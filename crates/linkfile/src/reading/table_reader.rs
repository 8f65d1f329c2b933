//! Reads a table key by key as its declaration says, and notices keys that nobody asked for.

use cohaptic_wan::ParameterValue;
use cohaptic_wan::parameters::{Key, Need, Table as Declaration};

use super::context::Context;
use super::names::one_of;
use super::values;
use crate::document::{BEGINNING, Entry, Node, Table, join};

/// A table being read. [`TableReader::finish`] reports the keys that were not asked for and those that are missing.
///
/// Names, forms, units, ranges and defaults stand in the [declaration](cohaptic_wan::parameters::Table) of the table, and nowhere else: [`value`](Self::value)
/// reads a key as its form says, [`read`](Self::read) by a reader of its own. Both take the declared default where the key is not given.
///
/// Every method that takes a name panics if the declaration has no such key.
#[derive(Debug)]
pub struct TableReader<'a> {
    node: &'a Node,
    table: &'a Table,
    declaration: &'static Declaration,
    context: Context<'a>,
    known: Vec<&'static str>,
    missing: Vec<(&'static str, String)>,
}

impl<'a> TableReader<'a> {
    /// Begins to read; `None`, and a fault, if the value is no table.
    pub fn new(node: &'a Node, context: Context<'a>, declaration: &'static Declaration, expected: &str) -> Option<Self> {
        let Some(table) = node.as_table() else {
            context.fault_at(node, format!("found {}: expected {expected}", node.describe()));
            return None;
        };
        Some(Self { node, table, declaration, context, known: Vec::new(), missing: Vec::new() })
    }

    /// The declaration of a key.
    ///
    /// # Panics
    ///
    /// If there is none.
    #[must_use]
    #[track_caller]
    pub fn key(&self, name: &'static str) -> &'static Key {
        self.declaration.key(name).expect("a reader asks for keys that are declared")
    }

    /// The key and the value under it, if it is there.
    #[track_caller]
    pub fn entry(&mut self, name: &'static str) -> Option<&'a Entry> {
        self.entry_of(self.key(name))
    }

    fn entry_of(&mut self, key: &'static Key) -> Option<&'a Entry> {
        if !self.known.contains(&key.name) {
            self.known.push(key.name);
        }
        self.table.get(key.name)
    }

    /// The value under a key, if it is there.
    #[track_caller]
    pub fn get(&mut self, name: &'static str) -> Option<&'a Node> {
        self.entry(name).map(|entry| &*entry.node)
    }

    /// The names of all keys, in the order in which they were laid over each other.
    pub fn names(&self) -> impl Iterator<Item = &'a str> {
        self.table.0.iter().map(|entry| entry.name.as_str())
    }

    /// The value under a key, read as its form says: that of the file, or else the declared default. A key without either is missing.
    ///
    /// # Panics
    ///
    /// If the form has other values.
    #[track_caller]
    pub fn value<T: TryFrom<ParameterValue>>(&mut self, name: &'static str) -> Option<T> {
        let key = self.key(name);
        self.read_key(key, "", |node, context| values::of_key(key, node, context))
    }

    /// The value under a key, read as its form says, or `Some(None)` if it is not there.
    ///
    /// # Panics
    ///
    /// If the form has other values.
    #[track_caller]
    pub fn maybe_value<T: TryFrom<ParameterValue>>(&mut self, name: &'static str) -> Option<Option<T>> {
        let key = self.key(name);
        self.maybe(name, |node, context| values::of_key(key, node, context))
    }

    /// What the word under a key stands for: that of the file, or else the declared default.
    #[track_caller]
    pub fn choice<T: Clone>(&mut self, name: &'static str, choices: &[(&'static str, T, &'static str)]) -> Option<T> {
        self.read(name, |node, context| values::word(node, context, choices))
    }

    /// The value under a key: that of the file, or else the declared default. A key without either is missing.
    #[track_caller]
    pub fn read<T>(&mut self, name: &'static str, read: impl FnOnce(&Node, Context<'a>) -> Option<T>) -> Option<T> {
        self.read_key(self.key(name), "", read)
    }

    /// [`read`](Self::read), with what a message expects if the key is missing; empty: what the declaration says.
    #[track_caller]
    pub fn read_expecting<T>(&mut self, name: &'static str, expected: &str, read: impl FnOnce(&Node, Context<'a>) -> Option<T>) -> Option<T> {
        self.read_key(self.key(name), expected, read)
    }

    fn read_key<T>(&mut self, key: &'static Key, expected: &str, read: impl FnOnce(&Node, Context<'a>) -> Option<T>) -> Option<T> {
        match (self.entry_of(key), key.need) {
            (Some(entry), _) => read(&entry.node, self.context),
            (None, Need::Default(default)) => read(&values::default_of(default), self.context),
            (None, Need::Required | Need::RequiredSomewhere | Need::Optional) => {
                self.missing.push((key.name, if expected.is_empty() { key.expected() } else { expected.to_owned() }));
                None
            }
        }
    }

    /// The value under a key, or `Some(None)` if it is not there.
    #[track_caller]
    pub fn maybe<T>(&mut self, name: &'static str, read: impl FnOnce(&'a Node, Context<'a>) -> Option<T>) -> Option<Option<T>> {
        match self.get(name) {
            Some(node) => read(node, self.context).map(Some),
            None => Some(None),
        }
    }

    /// The table under a key. One that is not there is read as a table without keys: each of its keys has its default.
    #[track_caller]
    pub fn table<T>(&mut self, name: &'static str, read: impl FnOnce(&Node, Context<'a>) -> Option<T>) -> Option<T> {
        match self.get(name) {
            Some(node) => read(node, self.context),
            None => read(&Node::empty_table(BEGINNING, join(&self.node.path, name)), self.context),
        }
    }

    /// Reports a key that is given although `condition`, on which its meaning depends, does not hold.
    #[track_caller]
    pub fn only_if(&mut self, condition: bool, name: &'static str, message: &str) -> Option<()> {
        let refused = self.get(name).filter(|_| !condition);
        refused.map(|node| self.context.fault_at(node, message)).is_none().then_some(())
    }

    /// Notes that a key should be there if it is not.
    #[track_caller]
    pub fn require(&mut self, name: &'static str, expected: &str) {
        if self.get(name).is_none() {
            self.miss(name, expected);
        }
    }

    /// Notes that a key should be there.
    #[track_caller]
    pub fn miss(&mut self, name: &'static str, expected: &str) {
        self.missing.push((name, expected.to_owned()));
    }

    /// Takes all declared keys, which somebody else reads.
    pub fn know_all(&mut self) {
        self.known.extend(self.declaration.keys().map(|key| key.name));
    }

    /// Reports unknown keys; if there are none, missing ones. A key that is misspelt is both, and said once.
    pub fn finish(self) {
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
