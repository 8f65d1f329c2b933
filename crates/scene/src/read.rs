//! From files and texts to scenes.

use core::ops::Range;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml::de::DeTable;

use crate::content::Fingerprint;
use crate::context::{Context, Faults};
use crate::error::{Diagnostic, SceneError};
use crate::model::Scene;
use crate::overrides;
use crate::sections::{
    Files, Header, LinkClasses, PeerSources, check_enough, read_coordination, read_expect, read_header, read_integrator, read_links, read_modulators,
    read_names, read_object, read_peers, read_timeline,
};
use crate::source::{BEGINNING, Place, Sources};
use crate::table_reader::TableReader;
use crate::tree::{Node, TooDeep, Value, join};

const TOO_DEEP: &str = "nested too deeply: expected at most 16 levels";

impl Scene {
    /// Reads a scene from a file. `overrides` are texts `KEY=VALUE` that replace values of the file, in this order.
    ///
    /// # Errors
    ///
    /// [`SceneError::Read`] if the file, or one that it names, cannot be read; [`SceneError::Invalid`] for anything else.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        with_text(path, |text| Self::parse(text, path, overrides))
    }

    /// Reads a scene for a live session: as [`Scene::read`], but a peer of kind `udp`, which is another process, needs neither device nor coupling.
    ///
    /// # Errors
    ///
    /// As [`Scene::read`].
    pub fn read_live(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        with_text(path, |text| Self::parse_live(text, path, overrides))
    }

    /// Reads a scene from a text. `file` stands in messages, and its folder is where files that the scene names are looked for.
    ///
    /// # Errors
    ///
    /// As [`Scene::read`]. Of several faults, the one that stands first in the text; faults in overrides come after those in the text.
    pub fn parse(text: &str, file: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        parse_scene(Sources { file, text, overrides }, false).map(|(scene, _)| scene)
    }

    /// [`Scene::parse`] for a live session, as [`Scene::read_live`].
    ///
    /// # Errors
    ///
    /// As [`Scene::parse`].
    pub fn parse_live(text: &str, file: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        parse_scene(Sources { file, text, overrides }, true).map(|(scene, _)| scene)
    }

    /// The place of a peer in [`Scene::peers`], by its name.
    #[must_use]
    pub fn peer_index(&self, name: &str) -> Option<usize> {
        self.peers.iter().position(|peer| peer.name == name)
    }
}

/// A fault of a scene that can be read, at the place where its `peer`-th peer is made, counted from 0: its entry `[[peers]]`, or `scene.count`.
#[must_use]
pub fn at_peer(text: &str, file: &Path, overrides: &[String], peer: usize, message: &str) -> SceneError {
    let sources = Sources { file, text, overrides };
    let refused = parse_document(sources, true, |document, context| {
        let value = |table: &Node, key: &str| table.as_table()?.get(key).map(|entry| Arc::clone(&entry.node));
        let count = value(document, "scene").and_then(|header| value(&header, "count"));
        let peers = value(document, "peers");
        let entry = match peers.as_ref().map(|peers| &peers.value) {
            Some(Value::List(entries)) => entries.get(peer).cloned(),
            _ => None,
        };
        let (place, key) = match count.or(entry).or(peers) {
            Some(node) => (node.place, node.path.clone()),
            None => (BEGINNING, String::new()),
        };
        context.fault(place, &key, message);
        Some(())
    });
    // Not reached: there is a fault in every case.
    refused.err().unwrap_or_else(|| SceneError::NoScene { folder: file.to_path_buf() })
}

/// What `read` makes of the text of a file.
pub(crate) fn with_text<T>(path: &Path, read: impl FnOnce(&str) -> Result<T, SceneError>) -> Result<T, SceneError> {
    let bytes = crate::read_bytes(path).map_err(|source| SceneError::Read { path: path.to_path_buf(), source, place: None })?;
    text_of(path, &bytes).and_then(read)
}

/// The text of a file that is to be read as a scene, a relay file or a router file.
///
/// # Errors
///
/// [`SceneError::Read`] if it cannot be read, [`SceneError::Invalid`] if it is no text.
pub fn file_text(path: &Path) -> Result<String, SceneError> {
    with_text(path, |text| Ok(text.to_owned()))
}

/// The text that the content of a file is. `file` stands in messages.
///
/// # Errors
///
/// [`SceneError::Invalid`] with the place of the first byte that is not UTF-8.
pub fn text_of<'a>(file: &Path, bytes: &'a [u8]) -> Result<&'a str, SceneError> {
    core::str::from_utf8(bytes).map_err(|error| {
        let place = Place::new(0, error.valid_up_to()..error.valid_up_to() + 1);
        // Up to the place, the text with replacements is the text itself.
        let sources = Sources { file, text: &String::from_utf8_lossy(bytes), overrides: &[] };
        invalid(sources.diagnostic(place, String::new(), "not UTF-8: expected a text file in TOML".to_owned()))
    })
}

/// The scene, and the document that it was read from with the overrides in it.
pub(crate) fn parse_scene(sources: Sources<'_>, live: bool) -> Result<(Scene, Node), SceneError> {
    parse_document(sources, live, read_document)
}

/// [`parse_scene`], and the content of each file that the scene names.
pub(crate) fn parse_whole(sources: Sources<'_>, live: bool) -> Result<(Scene, Node, BTreeMap<PathBuf, Fingerprint>), SceneError> {
    parse_with_files(sources, live, read_document)
}

/// What `read` makes of a text, and the document that it is with the overrides in it.
pub(crate) fn parse_document<T>(
    sources: Sources<'_>,
    live: bool,
    read: impl FnOnce(&Node, Context<'_>) -> Option<T>,
) -> Result<(T, Node), SceneError> {
    parse_with_files(sources, live, read).map(|(whole, document, _)| (whole, document))
}

fn parse_with_files<T>(
    sources: Sources<'_>,
    live: bool,
    read: impl FnOnce(&Node, Context<'_>) -> Option<T>,
) -> Result<(T, Node, BTreeMap<PathBuf, Fingerprint>), SceneError> {
    let mut document = parse_toml(sources.text, sources)?;
    let faults = Faults::default();
    let files = Files::default();
    let context = Context { sources, faults: &faults, files: &files, axes: None, names: None, modulators: None, partial: false, live };
    overrides::apply(&mut document, sources.overrides, context);
    let whole = read(&document, context);
    match (faults.into_first(), whole) {
        (Some(error), _) => Err(error),
        (None, Some(whole)) => Ok((whole, document, files.into_held())),
        // Not reached: a reader that answers nothing has reported why. An error all the same, because text must never be able to cause a panic.
        (None, None) => Err(invalid(sources.diagnostic(BEGINNING, String::new(), "the file is refused: expected another one".to_owned()))),
    }
}

/// Reads every part, also after one that was refused, so that the first fault in the order of the text is found.
fn read_document(document: &Node, context: Context<'_>) -> Option<Scene> {
    let mut root = TableReader::new(document, context, "a table")?;
    root.know(&["scene", "object", "coordination", "simulation", "peer", "peers", "modulators", "link", "links", "timeline", "expect"]);
    let header_node = root.get("scene");
    let header = root.required("scene", "a table [scene] with a duration", read_header).unwrap_or_default();
    let Header { title, duration, seed, axes, count } = header;
    let peers_node = root.get("peers");
    let context = Context { axes, ..context };
    let names = count.and_then(|count| read_names(peers_node, count, context));
    let context = Context { names: names.as_ref(), ..context };
    let modulators = read_modulators(root.get("modulators"), context);
    let context = Context { modulators: modulators.as_ref(), ..context };
    // From here on the readers know axes, names and modulators.
    let object = root.required("object", "a table [object] with a mass", |node, _| read_object(node, context));
    let coordination_node = root.get("coordination");
    let coordination = root.required("coordination", "a table [coordination] with a strategy", read_coordination);
    let integrator = root.optional("simulation", cohaptic_peer::Integrator::default(), read_integrator);
    let defaults = root.get("peer");
    let update = coordination.as_ref().zip(coordination_node).map(|(coordination, node)| {
        let written = node.as_table().and_then(|table| table.get("update"));
        (coordination.update, written.map_or(node, |entry| &*entry.node))
    });
    let count_entry = header_node.and_then(Node::as_table).and_then(|table| table.get("count"));
    let peers = read_peers(PeerSources { defaults, entries: peers_node, count: count_entry, update }, object.as_ref(), context);
    let (link, links) = (root.get("link"), root.get("links"));
    let links = read_links(link, links, context);
    let timeline_node = root.get("timeline");
    let gains = coordination.as_ref().map(|coordination| coordination.gains);
    let timeline = read_timeline(timeline_node, duration, links.as_ref(), peers.as_deref(), gains, context);
    let expect = match root.get("expect") {
        Some(node) => read_expect(node, duration, peers.as_deref(), context).map(Some),
        None => Some(None),
    };
    root.finish();
    if let Some(names) = &names {
        check_enough(names, peers_node, context);
    }
    Some(Scene {
        file: context.sources.file.to_path_buf(),
        title: title?.unwrap_or_else(|| default_title(context.sources.file)),
        duration: duration?,
        seed: seed?,
        axes: axes?,
        object: object?,
        coordination: coordination?,
        integrator: integrator?,
        peers: peers?,
        links: links.as_ref().and_then(LinkClasses::table)?,
        timeline: timeline?,
        expect: expect?,
    })
}

/// The name of the file without its ending.
pub(crate) fn default_title(file: &Path) -> String {
    file.file_stem().map_or_else(|| "scene".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

fn invalid(diagnostic: Diagnostic) -> SceneError {
    SceneError::Invalid(Box::new(diagnostic))
}

/// The document as a tree. Of several faults of syntax, the first.
fn parse_toml(text: &str, sources: Sources<'_>) -> Result<Node, SceneError> {
    let (table, errors) = DeTable::parse_recoverable(text);
    let first = errors.iter().min_by_key(|error| error.span().map_or(usize::MAX, |span| span.start));
    if let Some(error) = first {
        let span = error.span().unwrap_or(text.len()..text.len());
        let key = key_at(text, &span);
        return Err(invalid(sources.diagnostic(Place::new(0, span), key, syntax_message(error.message()))));
    }
    Node::document(table.get_ref()).map_err(|TooDeep(place)| {
        let key = key_at(text, &(place.start..place.end));
        invalid(sources.diagnostic(place, key, TOO_DEEP.to_owned()))
    })
}

/// What the TOML parser says, with what was expected where it leaves that out.
fn syntax_message(message: &str) -> String {
    match message {
        "duplicate key" => "this key or table is there already: expected it once".to_owned(),
        "recursion limit" => TOO_DEEP.to_owned(),
        other if other.contains("expected") => format!("not TOML: {other}"),
        other => format!("not TOML: {other}: expected a key and its value, such as delay = \"8ms\""),
    }
}

/// The key in whose line a fault of syntax stands, as far as it can be made out.
fn key_at(text: &str, span: &Range<usize>) -> String {
    let is_key = |key: &&str| !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.'));
    let end = text.get(span.start..).and_then(|rest| rest.find('\n')).map_or(text.len(), |newline| span.start + newline);
    let mut lines = text.get(..end).unwrap_or(text).lines().rev().map(str::trim).peekable();
    let key = lines.peek().filter(|line| !line.starts_with('[')).and_then(|line| line.split_once('=')).map(|(key, _)| key.trim());
    let header = lines.find(|line| line.starts_with('['));
    let table = header.and_then(|line| line.trim_start_matches('[').split(']').next()).map(str::trim);
    [table, key].into_iter().flatten().filter(is_key).fold(String::new(), |path, key| join(&path, key))
}

/// The scenes that a path means: a file means itself, a folder every file below it that ends in `.toml`, in order of their paths.
///
/// Links to folders are not followed.
///
/// # Errors
///
/// [`SceneError::Read`] if the path or a folder below it cannot be read, [`SceneError::NoScene`] for a folder without a scene.
pub fn scene_files(path: &Path) -> Result<Vec<PathBuf>, SceneError> {
    let unreadable = |path: &Path, source| SceneError::Read { path: path.to_path_buf(), source, place: None };
    let kind = std::fs::metadata(path).map_err(|source| unreadable(path, source))?;
    if !kind.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let mut files = Vec::new();
    let mut folders = vec![path.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).map_err(|source| unreadable(&folder, source))? {
            let entry = entry.map_err(|source| unreadable(&folder, source))?;
            let path = entry.path();
            let kind = entry.file_type().map_err(|source| unreadable(&path, source))?;
            if kind.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "toml") && path.is_file() {
                files.push(path);
            }
        }
    }
    files.sort();
    if files.is_empty() { Err(SceneError::NoScene { folder: path.to_path_buf() }) } else { Ok(files) }
}
