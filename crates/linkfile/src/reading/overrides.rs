//! Overrides `--set KEY=VALUE`: values put into the document before the document is read.

use core::ops::Range;
use std::sync::Arc;

use toml::de::DeValue;

use super::context::Context;
use super::names::one_of;
use crate::document::{Entry, Node, Place, Table, Value, join, quote};

/// Applies every override to the document in order. An override that fits nowhere is a fault.
pub(super) fn apply(document: &mut Node, overrides: &[String], context: Context<'_>) {
    for (index, text) in overrides.iter().enumerate() {
        // Source 0 is the file.
        let source = index + 1;
        if let Err(Refused { span, key, message }) = apply_one(document, text, source) {
            context.fault(Place::new(source, span), &key, message);
        }
    }
}

/// Fault of an override: faulty bytes of the text, dotted path of the key, and message.
struct Refused {
    span: Range<usize>,
    key: String,
    message: String,
}

/// Part of a dotted path, with its place in the override.
#[derive(Clone, Debug)]
struct Segment<'a> {
    name: &'a str,
    place: Place,
}

/// Applies an override with the source number `source`.
fn apply_one(document: &mut Node, text: &str, source: usize) -> Result<(), Refused> {
    let Some(equals) = text.find('=') else {
        return Err(Refused { span: 0..text.len(), key: String::new(), message: "no = in the override: expected KEY=VALUE".to_owned() });
    };
    let segments = split_path(&text[..equals], source)?;
    let path = segments.iter().map(|segment| segment.name).collect::<Vec<_>>().join(".");
    let value = read_value(text, equals + 1, &path, source)?;
    // Asked before the value is put: an override of `scene.count` itself counts from the next override on.
    let counted = has_count(document);
    put(document, &segments, value, &Insertion { path: String::new(), counted })
}

/// Splits a dotted path at its dots. Quotes around a part are removed; a dot inside quotes still splits.
fn split_path(text: &str, source: usize) -> Result<Vec<Segment<'_>>, Refused> {
    // More parts than the path of any key has, and few enough for the recursion of `put`.
    const MOST: usize = 12;
    let mut segments = Vec::new();
    let mut start = 0;
    for part in text.split('.') {
        let trimmed = part.trim();
        let begin = start + (part.len() - part.trim_start().len());
        let name = trimmed.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(trimmed);
        if name.is_empty() || segments.len() == MOST {
            let message = "the key is not a dotted path: expected one such as link.delay".to_owned();
            return Err(Refused { span: begin..begin + trimmed.len(), key: text.trim().to_owned(), message });
        }
        segments.push(Segment { name, place: Place::new(source, begin..begin + trimmed.len()) });
        start += part.len() + 1;
    }
    Ok(segments)
}

/// Reads the value after the equals sign as TOML. A value that is no TOML is taken as a text, so that `8ms` needs no quotes.
fn read_value(text: &str, start: usize, path: &str, source: usize) -> Result<Node, Refused> {
    let written = &text[start..];
    let trimmed = written.trim();
    let offset = start + (written.len() - written.trim_start().len());
    let span = offset..offset + trimmed.len();
    match DeValue::parse(trimmed) {
        Ok(value) => Node::value(&value, path.to_owned(), source, offset).map_err(|_| Refused {
            span,
            key: path.to_owned(),
            message: "the value is nested too deeply: expected what the key takes".to_owned(),
        }),
        Err(_) => Ok(Node { value: Value::Text(trimmed.to_owned()), place: Place::new(source, span), path: path.to_owned() }),
    }
}

/// Returns whether the scene makes its peers by `count`. An override may then name a peer without an entry.
fn has_count(document: &Node) -> bool {
    let scene = document.as_table().and_then(|table| table.get("scene"));
    scene.and_then(|entry| entry.node.as_table()).is_some_and(|table| table.get("count").is_some())
}

/// State of the descent from the root to the key of an override.
struct Insertion {
    /// Dotted path of the current node.
    path: String,
    /// `true` if the scene makes its peers by `count`.
    counted: bool,
}

/// Puts a value under the path `segments` of a node. Missing tables and lists on the path are made.
fn put(node: &mut Node, segments: &[Segment<'_>], value: Node, way: &Insertion) -> Result<(), Refused> {
    let [first, rest @ ..] = segments else {
        *node = value;
        return Ok(());
    };
    let path = join(&way.path, first.name);
    let next = Insertion { path, counted: way.counted };
    let described = node.describe();
    match &mut node.value {
        Value::Table(table) if rest.is_empty() => {
            table.insert(first.name, first.place, value);
            Ok(())
        }
        Value::Table(table) => {
            // These keys of the root hold lists of entries. A missing list becomes an empty list, so that the next part of the path addresses an entry.
            let list = way.path.is_empty() && matches!(first.name, "peers" | "links" | "modulators" | "timeline");
            let make = || {
                let value = if list { Value::List(Vec::new()) } else { Value::Table(Table::default()) };
                Node { value, place: first.place, path: next.path.clone() }
            };
            put(table.get_or_insert(first.name, first.place, make), rest, value, &next)
        }
        Value::List(elements) => match way.path.as_str() {
            "peers" => put_into_peer(elements, first, rest, value, way.counted),
            "links" => put_into_link(elements, first, rest, value),
            _ => put(element(elements, first, &way.path)?, rest, value, &next),
        },
        Value::Text(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date => {
            let message = format!("{} is {described} here and holds no keys: expected the path of a key", way.path);
            Err(refused(first, next.path, message))
        }
    }
}

/// Puts a value under `peers.left.…`: into the entry with the name, or else with the index. With `count`, a missing entry is made.
fn put_into_peer(peers: &mut Vec<Arc<Node>>, name: &Segment<'_>, rest: &[Segment<'_>], value: Node, counted: bool) -> Result<(), Refused> {
    // A name goes before an index, because a peer may be called `0`.
    let found = peers.iter().position(|entry| text_of(entry, "name") == Some(name.name));
    let by_index = || name.name.parse::<usize>().ok().filter(|index| *index < peers.len());
    let index = match found.or_else(by_index) {
        Some(index) => index,
        None if counted => {
            peers.push(Arc::new(entry_named(name, "peers", &[("name", name)])));
            peers.len() - 1
        }
        None => {
            let names = peers.iter().filter_map(|entry| text_of(entry, "name"));
            let message = format!("there is no peer {}: expected {}", quote(name.name), one_of(names, name.name));
            return Err(refused(name, join("peers", name.name), message));
        }
    };
    put_into_entry(&mut peers[index], rest, value, &["name"])
}

/// Puts a value under `links.left.right.…`: into the entry with both ends, or else with the index in `links.0.…`. A missing entry is made.
fn put_into_link(links: &mut Vec<Arc<Node>>, from: &Segment<'_>, rest: &[Segment<'_>], value: Node) -> Result<(), Refused> {
    let by_index = from.name.parse::<usize>().ok().filter(|index| *index < links.len());
    let Some((to, rest)) = rest.split_first() else {
        let message = "one end of a link: expected both, as in links.left.right.delay".to_owned();
        return Err(refused(from, join("links", from.name), message));
    };
    let found = links.iter().position(|entry| text_of(entry, "from") == Some(from.name) && text_of(entry, "to") == Some(to.name));
    match (found, by_index) {
        (Some(index), _) => put_into_entry(&mut links[index], rest, value, &["from", "to"]),
        // `links.0.delay`: the second part of the path is a key of the entry, and not an end.
        (None, Some(index)) => {
            let way = Insertion { path: join("links", from.name), counted: false };
            let segments: Vec<Segment<'_>> = core::iter::once(to.clone()).chain(rest.iter().cloned()).collect();
            put(Arc::make_mut(&mut links[index]), &segments, value, &way)
        }
        (None, None) => {
            let mut entry = Arc::new(entry_named(from, "links", &[("from", from), ("to", to)]));
            // The value is put first, so that a refused override leaves no entry behind.
            put_into_entry(&mut entry, rest, value, &["from", "to"])?;
            links.push(entry);
            Ok(())
        }
    }
}

/// Puts a value under an entry. A table that replaces the whole entry keeps the keys `address`, which identify the entry.
fn put_into_entry(entry: &mut Arc<Node>, rest: &[Segment<'_>], mut value: Node, address: &[&str]) -> Result<(), Refused> {
    let entry = Arc::make_mut(entry);
    if rest.is_empty()
        && let (Some(old), Value::Table(new)) = (entry.as_table(), &mut value.value)
    {
        // Without these keys, no later override would find the replaced entry.
        for key in address.iter().copied().filter_map(|key| old.get(key)) {
            if new.get(&key.name).is_none() {
                new.0.push(key.clone());
            }
        }
    }
    let way = Insertion { path: entry.path.clone(), counted: false };
    put(entry, rest, value, &way)
}

/// Returns the element of a list for `timeline.0.…` or `modulators.cell.states.good.…`, by name or else by index from 0.
fn element<'a>(elements: &'a mut [Arc<Node>], index: &Segment<'_>, path: &str) -> Result<&'a mut Node, Refused> {
    let count = elements.len();
    let named = elements.iter().position(|entry| text_of(entry, "name") == Some(index.name));
    let found = named.or_else(|| index.name.parse().ok()).and_then(|index| elements.get_mut(index));
    found.map(Arc::make_mut).ok_or_else(|| {
        let message = format!("there is no entry {}: expected the place of one of its {count} entries, from 0", quote(index.name));
        refused(index, join(path, index.name), message)
    })
}

/// Returns a new entry with the keys `address`, which identify the entry.
fn entry_named(first: &Segment<'_>, list: &str, address: &[(&str, &Segment<'_>)]) -> Node {
    let path = address.iter().fold(list.to_owned(), |path, (_, segment)| join(&path, segment.name));
    let entries = address.iter().map(|(key, segment)| {
        let node = Node { value: Value::Text(segment.name.to_owned()), place: segment.place, path: join(&path, key) };
        Entry { name: (*key).to_owned(), key: segment.place, node: Arc::new(node) }
    });
    Node { value: Value::Table(Table(entries.collect())), place: first.place, path: path.clone() }
}

/// Returns the text under a key of an entry.
fn text_of<'a>(entry: &'a Node, key: &str) -> Option<&'a str> {
    entry.as_table().and_then(|table| table.get(key)).and_then(|entry| entry.node.as_text())
}

fn refused(segment: &Segment<'_>, key: String, message: String) -> Refused {
    Refused { span: segment.place.start..segment.place.end, key, message }
}
