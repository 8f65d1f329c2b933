//! Reader of tables: reads key by key as the declaration of the table says, and reports unknown and missing keys.

use cohaptic_wan::ParameterValue;
use cohaptic_wan::parameters::{Key, Need, Table as Declaration};

use super::context::Context;
use super::names::one_of;
use super::values;
use crate::document::{BEGINNING, Entry, Node, Table, join};

/// Table being read. [`TableReader::finish`] reports keys that no method was asked for, and missing keys.
///
/// Names, forms, units, ranges and defaults stand only in the [declaration](cohaptic_wan::parameters::Table) of the table. [`value`](Self::value) reads a key
/// by its declared form, [`read`](Self::read) by a given reader. Both read the declared default where the key is not given.
///
/// Every method that takes a name panics if the declaration has no such key.
#[derive(Debug)]
pub struct TableReader<'a> {
    node: &'a Node,
    table: &'a Table,
    declaration: &'static Declaration,
    context: Context<'a>,
    /// Names of the requested keys.
    known: Vec<&'static str>,
    /// Names of missing keys, each with the expected text.
    missing: Vec<(&'static str, String)>,
}

impl<'a> TableReader<'a> {
    /// Begins to read a table. Reports a fault and returns `None` if the value is no table.
    pub fn new(node: &'a Node, context: Context<'a>, declaration: &'static Declaration, expected: &str) -> Option<Self> {
        let Some(table) = node.as_table() else {
            context.fault_at(node, format!("found {}: expected {expected}", node.describe()));
            return None;
        };
        Some(Self { node, table, declaration, context, known: Vec::new(), missing: Vec::new() })
    }

    /// Returns the declaration of a key.
    ///
    /// # Panics
    ///
    /// If the declaration of the table has no such key.
    #[must_use]
    #[track_caller]
    pub fn key(&self, name: &'static str) -> &'static Key {
        self.declaration.key(name).expect("a reader asks for keys that are declared")
    }

    /// Returns the entry of a key (key and value), or `None` if the key is not given.
    #[track_caller]
    pub fn entry(&mut self, name: &'static str) -> Option<&'a Entry> {
        self.entry_of(self.key(name))
    }

    fn entry_of(&mut self, key: &'static Key) -> Option<&'a Entry> {
        // A key is often asked for twice: for the node, and for the value.
        if !self.known.contains(&key.name) {
            self.known.push(key.name);
        }
        self.table.get(key.name)
    }

    /// Returns the unread value under a key, or `None` if the key is not given.
    #[track_caller]
    pub fn get(&mut self, name: &'static str) -> Option<&'a Node> {
        self.entry(name).map(|entry| &*entry.node)
    }

    /// Returns the names of all given keys, in the order of laying over.
    pub(crate) fn names(&self) -> impl Iterator<Item = &'a str> {
        self.table.0.iter().map(|entry| entry.name.as_str())
    }

    /// Reads the value of a key by its declared form: the value of the file, or else the declared default. A key without both is missing.
    ///
    /// # Panics
    ///
    /// If the form of the key has values of another type than `T`.
    #[track_caller]
    pub fn value<T: TryFrom<ParameterValue>>(&mut self, name: &'static str) -> Option<T> {
        let key = self.key(name);
        self.read_key(key, "", |node, context| values::of_key(key, node, context))
    }

    /// Reads the value of a key by its declared form. Returns `Some(None)` if the key is not given.
    ///
    /// # Panics
    ///
    /// If the form of the key has values of another type than `T`.
    #[track_caller]
    pub fn maybe_value<T: TryFrom<ParameterValue>>(&mut self, name: &'static str) -> Option<Option<T>> {
        let key = self.key(name);
        self.maybe(name, |node, context| values::of_key(key, node, context))
    }

    /// Reads a word of the file, or else the declared default, and returns the value of the word in `choices`.
    #[track_caller]
    pub fn choice<T: Clone>(&mut self, name: &'static str, choices: &[(&'static str, T, &'static str)]) -> Option<T> {
        self.read(name, |node, context| values::word(node, context, choices))
    }

    /// Reads the value of a key with the reader `read`: the value of the file, or else the declared default. A key without both is missing.
    #[track_caller]
    pub fn read<T>(&mut self, name: &'static str, read: impl FnOnce(&Node, Context<'a>) -> Option<T>) -> Option<T> {
        self.read_key(self.key(name), "", read)
    }

    /// Like [`read`](Self::read), with another expected text for the message about a missing key. An empty text stands for the text of the declaration.
    #[track_caller]
    pub(crate) fn read_expecting<T>(&mut self, name: &'static str, expected: &str, read: impl FnOnce(&Node, Context<'a>) -> Option<T>) -> Option<T> {
        self.read_key(self.key(name), expected, read)
    }

    fn read_key<T>(&mut self, key: &'static Key, expected: &str, read: impl FnOnce(&Node, Context<'a>) -> Option<T>) -> Option<T> {
        match (self.entry_of(key), key.need) {
            (Some(entry), _) => read(&entry.node, self.context),
            // A default goes through the same reader as a value of the file, and so through the same checks.
            (None, Need::Default(default)) => read(&values::default_of(default), self.context),
            (None, Need::Required | Need::RequiredSomewhere | Need::Optional) => {
                // Reported by `finish`, because an unknown key may explain the missing key.
                self.missing.push((key.name, if expected.is_empty() { key.expected() } else { expected.to_owned() }));
                None
            }
        }
    }

    /// Reads the value of a key with the reader `read`. Returns `Some(None)` if the key is not given.
    #[track_caller]
    pub fn maybe<T>(&mut self, name: &'static str, read: impl FnOnce(&'a Node, Context<'a>) -> Option<T>) -> Option<Option<T>> {
        match self.get(name) {
            Some(node) => read(node, self.context).map(Some),
            None => Some(None),
        }
    }

    /// Reads the table under a key with the reader `read`. If the key is not given, `read` gets a table without keys, in which every key has the default.
    #[track_caller]
    pub fn table<T>(&mut self, name: &'static str, read: impl FnOnce(&Node, Context<'a>) -> Option<T>) -> Option<T> {
        match self.get(name) {
            Some(node) => read(node, self.context),
            // The empty table has no place in the text, but the path of the key, for messages about keys in the table.
            None => read(&Node::empty_table(BEGINNING, join(&self.node.path, name)), self.context),
        }
    }

    /// Reports a given key if the `condition` for the key does not hold, and returns `None` then.
    #[track_caller]
    pub fn only_if(&mut self, condition: bool, name: &'static str, message: &str) -> Option<()> {
        let refused = self.get(name).filter(|_| !condition);
        refused.map(|node| self.context.fault_at(node, message)).is_none().then_some(())
    }

    /// Marks a key as missing if the key is not given.
    #[track_caller]
    pub fn require(&mut self, name: &'static str, expected: &str) {
        if self.get(name).is_none() {
            self.miss(name, expected);
        }
    }

    /// Marks a key as missing, with the expected text for the message.
    #[track_caller]
    pub fn miss(&mut self, name: &'static str, expected: &str) {
        self.missing.push((name, expected.to_owned()));
    }

    /// Marks all declared keys as known, for a table whose keys are read elsewhere.
    pub fn know_all(&mut self) {
        self.known.extend(self.declaration.keys().map(|key| key.name));
    }

    /// Reports unknown keys or, if all keys are known, missing keys.
    pub fn finish(self) {
        let unknown: Vec<&Entry> = self.table.0.iter().filter(|entry| !self.known.contains(&entry.name.as_str())).collect();
        for entry in &unknown {
            let expected = one_of(self.known.iter().copied(), &entry.name);
            self.context.fault(entry.key, &entry.node.path, format!("unknown key: expected {expected}"));
        }
        // A misspelt key is unknown, and the right key is missing. Only the unknown key is reported, because the user has to look there.
        if unknown.is_empty() && !self.context.partial {
            for (key, expected) in &self.missing {
                self.context.missing(self.node.place, &join(&self.node.path, key), format!("missing key: expected {expected}"));
            }
        }
    }
}

/// Returns the only given entry of `entries`. No given entry, or more than one, is a fault. `expected` lists the possible keys.
pub fn only_one<'a>(node: &Node, context: Context<'_>, entries: &[Option<&'a Entry>], expected: &str) -> Option<&'a Entry> {
    let mut given: Vec<&Entry> = entries.iter().copied().flatten().collect();
    // Sorted by place, so that the second key of the text is at fault.
    given.sort_by_key(|entry| entry.key);
    match given.as_slice() {
        [only] => Some(only),
        [] => {
            context.missing(node.place, &node.path, format!("no key is given: expected {expected}"));
            None
        }
        [first, second, ..] => {
            let message = format!("\"{}\" was given before: expected only one of {expected}", first.name);
            context.fault(second.key, &second.node.path, message);
            None
        }
    }
}
