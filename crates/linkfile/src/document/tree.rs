//! Document as a tree of values. Each value has its place in the text and the dotted path of its key.

use std::sync::Arc;

use toml::de::{DeTable, DeValue};

use super::error::{quote, shorten};
use super::source::{BEGINNING, Place};

/// Maximum depth of a document in levels. The bound keeps the recursion over the tree from exhausting the stack.
const DEEPEST: usize = 16;

/// Value with its place and the path of its key.
#[derive(Clone, Debug)]
pub struct Node {
    /// Value without place and path.
    pub value: Value,
    /// Place of the value in the text; for a table with a header, the place of the header.
    pub place: Place,
    /// Dotted path of the key.
    pub path: String,
}

/// Value of a document. Numbers stay texts or wide integers until a reader knows the type of the key.
#[derive(Clone, Debug)]
pub enum Value {
    /// A text, without quotes and escapes.
    Text(String),
    /// An integer, or `None` for an integer beyond 128 bits.
    Integer(Option<i128>),
    /// A floating-point number as written.
    Float(String),
    /// `true` or `false`.
    Boolean(bool),
    /// A date or a time, which no key takes.
    Date,
    /// A list.
    List(Vec<Arc<Node>>),
    /// A table.
    Table(Table),
}

/// Keys and values of a table, in the order of writing. Keys laid over another table come after the keys of the other table.
#[derive(Clone, Debug, Default)]
pub struct Table(pub Vec<Entry>);

/// Key and value of a table.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Name of the key.
    pub name: String,
    /// Place of the key in the text.
    pub key: Place,
    /// Value of the key.
    pub node: Arc<Node>,
}

/// Error: the document is nested too deeply at this place.
#[derive(Clone, Copy, Debug)]
pub struct TooDeep(pub Place);

impl Node {
    /// Converts a parsed file into the root of a document.
    ///
    /// # Errors
    ///
    /// [`TooDeep`] beyond 16 levels.
    pub fn document(table: &DeTable<'_>) -> Result<Self, TooDeep> {
        let value = Value::Table(Table::convert(table, "", 0, 0, 0)?);
        Ok(Self { value, place: BEGINNING, path: String::new() })
    }

    /// Converts a parsed value of the source text with the number `source`. The text of the value begins at byte `offset` of the source text.
    ///
    /// # Errors
    ///
    /// [`TooDeep`] beyond 16 levels.
    pub(crate) fn value(value: &toml::Spanned<DeValue<'_>>, path: String, source: usize, offset: usize) -> Result<Self, TooDeep> {
        Self::convert(value, path, source, offset, 1)
    }

    fn convert(spanned: &toml::Spanned<DeValue<'_>>, path: String, source: usize, offset: usize, depth: usize) -> Result<Self, TooDeep> {
        let span = spanned.span();
        let place = Place::new(source, span.start + offset..span.end + offset);
        // Checked on the way down, so that the recursion never goes below the bound.
        if depth > DEEPEST {
            return Err(TooDeep(place));
        }
        let value = match spanned.get_ref() {
            DeValue::String(text) => Value::Text(text.to_string()),
            // 128 bits, so that a message can quote an integer beyond the range of every key.
            DeValue::Integer(integer) => Value::Integer(i128::from_str_radix(integer.as_str(), integer.radix()).ok()),
            DeValue::Float(float) => Value::Float(float.as_str().to_owned()),
            DeValue::Boolean(boolean) => Value::Boolean(*boolean),
            DeValue::Datetime(_) => Value::Date,
            DeValue::Array(array) => {
                let element = |(index, element): (usize, &toml::Spanned<DeValue<'_>>)| {
                    let path = join(&path, &element_name(&path, index, element.get_ref()));
                    Self::convert(element, path, source, offset, depth + 1).map(Arc::new)
                };
                Value::List(array.iter().enumerate().map(element).collect::<Result<_, _>>()?)
            }
            DeValue::Table(table) => Value::Table(Table::convert(table, &path, source, offset, depth)?),
        };
        Ok(Self { value, place, path })
    }

    /// Returns the table, or `None` if the value is no table.
    #[must_use]
    pub fn as_table(&self) -> Option<&Table> {
        match &self.value {
            Value::Table(table) => Some(table),
            Value::Text(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date | Value::List(_) => None,
        }
    }

    /// Returns the text, or `None` if the value is no text.
    #[must_use]
    pub fn as_text(&self) -> Option<&str> {
        match &self.value {
            Value::Text(text) => Some(text),
            Value::Table(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date | Value::List(_) => None,
        }
    }

    /// Describes the value for a message: `the text "8ms"`.
    #[must_use]
    pub fn describe(&self) -> String {
        match &self.value {
            Value::Text(text) => format!("the text {}", quote(text)),
            Value::Integer(Some(integer)) => format!("the integer {integer}"),
            Value::Integer(None) => "an integer beyond 128 bits".to_owned(),
            Value::Float(float) => format!("the number {}", shorten(float)),
            Value::Boolean(boolean) => boolean.to_string(),
            Value::Date => "a date or time".to_owned(),
            Value::List(_) => "a list".to_owned(),
            Value::Table(_) => "a table".to_owned(),
        }
    }

    /// Lays this table over the table `base`, key by key. Tables under the keys `nested` are laid over each other in the same way. If this value or `base` is
    /// no table, returns a copy of this value.
    #[must_use]
    pub fn over(&self, base: &Self, nested: &[&str]) -> Self {
        let (Some(own), Some(below)) = (self.as_table(), base.as_table()) else { return self.clone() };
        // Own keys come last, because readers take the order of keys as the order of laying over.
        let mut entries: Vec<Entry> = below.0.iter().filter(|entry| own.get(&entry.name).is_none()).cloned().collect();
        for entry in &own.0 {
            let mut entry = entry.clone();
            // A table under any other key replaces the table below as a whole.
            if nested.contains(&entry.name.as_str())
                && let Some(base) = below.get(&entry.name)
            {
                entry.node = Arc::new(entry.node.over(&base.node, &[]));
            }
            entries.push(entry);
        }
        Self { value: Value::Table(Table(entries)), place: self.place, path: self.path.clone() }
    }

    /// Returns a copy of this table without the keys `keys`.
    #[must_use]
    pub(crate) fn without(&self, keys: &[&str]) -> Self {
        let mut node = self.clone();
        if let Value::Table(table) = &mut node.value {
            table.0.retain(|entry| !keys.contains(&entry.name.as_str()));
        }
        node
    }

    /// Returns a table without keys.
    #[must_use]
    pub fn empty_table(place: Place, path: String) -> Self {
        Self { value: Value::Table(Table::default()), place, path }
    }
}

impl Table {
    fn convert(table: &DeTable<'_>, path: &str, source: usize, offset: usize, depth: usize) -> Result<Self, TooDeep> {
        let mut entries = Vec::with_capacity(table.len());
        for (key, value) in table {
            let span = key.span();
            let node = Node::convert(value, join(path, key.get_ref()), source, offset, depth + 1)?;
            let key_place = Place::new(source, span.start + offset..span.end + offset);
            entries.push(Entry { name: key.get_ref().to_string(), key: key_place, node: Arc::new(node) });
        }
        // The parser sorts keys by name. Messages and precedence need the order of the text.
        entries.sort_by_key(|entry| entry.key);
        Ok(Self(entries))
    }

    /// Returns the entry with the key `name`.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.0.iter().find(|entry| entry.name == name)
    }

    /// Returns the value under a key. A missing value is made by `make` and added last, with the key at the place `key`.
    pub(crate) fn get_or_insert(&mut self, name: &str, key: Place, make: impl FnOnce() -> Node) -> &mut Node {
        let index = self.0.iter().position(|entry| entry.name == name).unwrap_or_else(|| {
            self.0.push(Entry { name: name.to_owned(), key, node: Arc::new(make()) });
            self.0.len() - 1
        });
        Arc::make_mut(&mut self.0[index].node)
    }

    /// Sets the value under a key. The key moves to the end of the table, because the new value is laid over all keys before.
    pub(crate) fn insert(&mut self, name: &str, key: Place, node: Node) {
        self.0.retain(|entry| entry.name != name);
        self.0.push(Entry { name: name.to_owned(), key, node: Arc::new(node) });
    }
}

/// Returns the name of a list element in a path: peers, programs, modulators and their states by name, links by both ends, all further elements by index from
/// 0.
fn element_name(list: &str, index: usize, element: &DeValue<'_>) -> String {
    let text = |key: &str| element.as_table().and_then(|table| table.get(key)).and_then(|value| value.get_ref().as_str());
    match list {
        "peers" | "programs" | "modulators" => text("name").map(str::to_owned),
        list if list.starts_with("modulators.") && list.ends_with(".states") => text("name").map(str::to_owned),
        "links" => text("from").zip(text("to")).map(|(from, to)| format!("{from}.{to}")),
        _ => None,
    }
    .unwrap_or_else(|| index.to_string())
}

/// Joins the dotted path of a table and a key.
#[must_use]
pub fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}
