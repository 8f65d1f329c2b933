//! Links by their keys, as they stand in a scene: one by itself, and those of a scene, to be shown and changed.

use core::fmt;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use cohaptic_units::{Instant, parse};
use cohaptic_wan::LinkModel;
use toml::de::DeTable;

use crate::SceneError;
use crate::link_table::pairs;
use crate::model::Scene;
use crate::read::{parse_document, parse_scene, with_text};
use crate::relay_file;
use crate::source::{BEGINNING, Sources};
use crate::toml_text::{key_text, value_text};
use crate::tree::{Node, Table, Value};

/// The least scene that has a link.
const AROUND: &str = "scene = { duration = \"1s\", count = 2 }\nobject = { mass = 1.0 }\n\
    coordination = { strategy = \"average-position\", stiffness = 1.0, damping = 1.0, update = \"1ms\" }\n\
    peer = { device = { mass = 1.0, damping = 1.0 }, coupling = { stiffness = 1.0, damping = 1.0 } }\n";

/// The link of these keys: texts `KEY=VALUE`, such as `delay=24ms` and `loss={ gilbert-elliott = { p = 0.01, r = 0.1 } }`, as in `[link]` of a scene.
/// Files that they name are looked for in the current folder.
///
/// # Errors
///
/// [`SceneError`], whose [`override_text`](crate::Diagnostic::override_text) is `link.` and the text with the fault.
pub fn link_from_keys(keys: &[String]) -> Result<LinkModel, SceneError> {
    let overrides: Vec<String> = keys.iter().map(|key| format!("link.{key}")).collect();
    let scene = Scene::parse(AROUND, Path::new("link.toml"), &overrides)?;
    Ok(scene.links.between(0, 1).clone())
}

/// The keys of one directed link and their values as TOML, in the order in which they were laid over each other: of two that exclude each other the later
/// one holds. Keys that are not there have their defaults.
///
/// Its display form is an inline table, `{ delay = "24ms", loss = 0.01 }`, which [`LinkKeys::read`] takes.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct LinkKeys {
    keys: Vec<(String, String)>,
    /// The list of the scene's modulators, as TOML; empty if there are none.
    modulators: Arc<str>,
}

impl LinkKeys {
    pub(crate) fn of_table(table: &Table, modulators: &Arc<str>) -> Self {
        Self { keys: keys_of(table), modulators: Arc::clone(modulators) }
    }

    /// Each key with its value as TOML.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.keys.iter().map(|(key, value)| (key.as_str(), value.as_str()))
    }

    /// The value of a key, as TOML; `None` if it is not there.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&str> {
        self.iter().find(|(name, _)| *name == key).map(|(_, value)| value)
    }

    /// These keys with one laid over them. What is not TOML is taken as text, as in `--set`: `8ms` needs no quotes. [`LinkKeys::model`] tells whether
    /// key and value make sense.
    #[must_use]
    pub fn with(&self, key: &str, value: &str) -> Self {
        let mut keys: Vec<_> = self.keys.iter().filter(|(name, _)| name != key).cloned().collect();
        keys.push((key.to_owned(), value.trim().to_owned()));
        Self { keys, modulators: Arc::clone(&self.modulators) }
    }

    /// The link that these keys make. `folder` is where files that they name are looked for: the folder of the scene.
    ///
    /// # Errors
    ///
    /// [`SceneError`], whose [`override_text`](crate::Diagnostic::override_text) is `link.KEY=VALUE` of the key with the fault.
    pub fn model(&self, folder: &Path) -> Result<LinkModel, SceneError> {
        let overrides: Vec<String> = self.iter().map(|(key, value)| format!("link.{key}={value}")).collect();
        let modulators = if self.modulators.is_empty() { String::new() } else { format!("modulators = {}\n", self.modulators) };
        let scene = Scene::parse(&format!("{AROUND}{modulators}"), &folder.join("link.toml"), &overrides)?;
        Ok(scene.links.between(0, 1).clone())
    }

    /// The keys in the display form of others, in the scene of these. `None` if the text is no table of keys and values; whether they make sense is told
    /// by [`LinkKeys::model`].
    #[must_use]
    pub fn read(&self, table: &str) -> Option<Self> {
        let text = format!("link = {table}");
        let document = Node::document(DeTable::parse(&text).ok()?.get_ref()).ok()?;
        let [only] = document.as_table()?.0.as_slice() else { return None };
        Some(Self { keys: keys_of(only.node.as_table()?), modulators: Arc::clone(&self.modulators) })
    }
}

impl fmt::Display for LinkKeys {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.keys.is_empty() {
            return f.write_str("{}");
        }
        let mut before = "{";
        for (key, value) in &self.keys {
            // A text without quotes is given them: the display form is TOML.
            let value = if is_toml(value) { value.clone() } else { value_text(&text_node(value)) };
            write!(f, "{before} {} = {value}", key_text(key))?;
            before = ",";
        }
        f.write_str(" }")
    }
}

/// The keys of directed links, by the places of sender and receiver.
pub type KeysOfLinks = BTreeMap<(usize, usize), LinkKeys>;

/// The keys of every directed link of a scene file as it begins: what an entry `[[links]]` says is laid over `[link]`.
///
/// # Errors
///
/// As [`Scene::read_live`].
pub fn link_keys(path: &Path, overrides: &[String]) -> Result<KeysOfLinks, SceneError> {
    with_text(path, |text| link_keys_of_text(text, path, overrides))
}

/// [`link_keys`] of a scene that is a text; `file` as in [`Scene::parse`].
///
/// # Errors
///
/// As [`Scene::parse_live`].
pub fn link_keys_of_text(text: &str, file: &Path, overrides: &[String]) -> Result<KeysOfLinks, SceneError> {
    let (scene, document) = parse_scene(Sources { file, text, overrides }, true)?;
    Ok(keys_of_mesh(&document, scene.peers.len(), |name| scene.peer_index(name)))
}

/// What the timeline of a scene file makes of the keys of links: when, and all keys of each link that it changes then. In order of time, as in
/// [`Scene::timeline`]. What somebody has changed by hand in between does not count: the timeline says what a link is.
///
/// # Errors
///
/// As [`Scene::read_live`].
pub fn link_key_changes(path: &Path, overrides: &[String]) -> Result<Vec<(Instant, KeysOfLinks)>, SceneError> {
    with_text(path, |text| link_key_changes_of_text(text, path, overrides))
}

/// [`link_key_changes`] of a scene that is a text.
///
/// # Errors
///
/// As [`Scene::parse_live`].
pub fn link_key_changes_of_text(text: &str, file: &Path, overrides: &[String]) -> Result<Vec<(Instant, KeysOfLinks)>, SceneError> {
    let (scene, document) = parse_scene(Sources { file, text, overrides }, true)?;
    let mut links = keys_of_mesh(&document, scene.peers.len(), |name| scene.peer_index(name));
    let Some(Value::List(entries)) = part(&document, "timeline").map(|node| &node.value) else { return Ok(Vec::new()) };
    let value = |entry: &Node, key: &str| entry.as_table().and_then(|table| table.get(key)).map(|entry| Arc::clone(&entry.node));
    let planned = entries.iter().filter_map(|entry| {
        let span = parse::duration(value(entry, "at")?.as_text()?).ok()?;
        Some((Instant::ZERO.checked_add(span)?, value(entry, "link")?, value(entry, "set")?))
    });
    let mut planned: Vec<_> = planned.collect();
    // Stable: equal instants stay in the order of the file.
    planned.sort_by_key(|(at, ..)| *at);
    let mut changes = Vec::new();
    for (at, link, set) in planned {
        let ends = ends_of(&link, &|name| scene.peer_index(name));
        let concerned = links.iter_mut().filter(|(pair, _)| ends.is_none_or(|ends| ends == **pair));
        let changed = concerned.map(|(pair, keys)| {
            *keys = set.as_table().map_or_else(Vec::new, keys_of).iter().fold(keys.clone(), |keys, (key, value)| keys.with(key, value));
            (*pair, keys.clone())
        });
        changes.push((at, changed.collect()));
    }
    Ok(changes)
}

/// The keys of every directed link of a relay file, as [`link_keys`] gives those of a scene: by the places of its programs.
///
/// # Errors
///
/// As [`RelayFile::read`](crate::RelayFile::read).
pub fn relay_link_keys(path: &Path, overrides: &[String]) -> Result<KeysOfLinks, SceneError> {
    with_text(path, |text| relay_link_keys_of_text(text, path, overrides))
}

/// [`relay_link_keys`] of a relay file that is a text.
///
/// # Errors
///
/// As [`RelayFile::parse`](crate::RelayFile::parse).
pub fn relay_link_keys_of_text(text: &str, file: &Path, overrides: &[String]) -> Result<KeysOfLinks, SceneError> {
    let (relay, document) = parse_document(Sources { file, text, overrides }, false, relay_file::read_document)?;
    let place = |name: &str| relay.programs.iter().position(|program| program.name == name);
    Ok(keys_of_mesh(&document, relay.programs.len(), place))
}

/// The keys of all links between so many ends, of a document with `[link]` and `[[links]]`.
fn keys_of_mesh(document: &Node, ends: usize, place: impl Fn(&str) -> Option<usize>) -> KeysOfLinks {
    let modulators = modulators_of(document);
    let nothing = Node::empty_table(BEGINNING, "link".to_owned());
    let usual = part(document, "link").unwrap_or(&nothing);
    let nothing_said = Table::default();
    let keys = |node: &Node| LinkKeys::of_table(node.as_table().unwrap_or(&nothing_said), &modulators);
    let shared = keys(usual);
    let mut links: KeysOfLinks = pairs(ends).map(|pair| (pair, shared.clone())).collect();
    let Some(Value::List(entries)) = part(document, "links").map(|node| &node.value) else { return links };
    for entry in entries {
        if let Some(ends) = ends_of(entry, &place) {
            links.insert(ends, keys(&entry.without(&["from", "to"]).over(usual, &[])));
        }
    }
    links
}

fn part<'a>(document: &'a Node, name: &str) -> Option<&'a Node> {
    document.as_table().and_then(|table| table.get(name)).map(|entry| &*entry.node)
}

/// The modulators of a document as TOML; empty if it has none.
pub(crate) fn modulators_of(document: &Node) -> Arc<str> {
    part(document, "modulators").map_or_else(String::new, value_text).into()
}

/// The places of those that `from` and `to` of a table name; `None` if it has no such keys.
fn ends_of(table: &Node, place: &impl Fn(&str) -> Option<usize>) -> Option<(usize, usize)> {
    let end = |key: &str| place(table.as_table()?.get(key)?.node.as_text()?);
    Some((end("from")?, end("to")?))
}

fn keys_of(table: &Table) -> Vec<(String, String)> {
    table.0.iter().map(|entry| (entry.name.clone(), value_text(&entry.node))).collect()
}

fn is_toml(value: &str) -> bool {
    toml::de::DeValue::parse(value).is_ok()
}

fn text_node(text: &str) -> Node {
    Node { value: Value::Text(text.to_owned()), place: BEGINNING, path: String::new() }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_units::Probability;
    use cohaptic_wan::{Delay, Distribution, Jitter, LinkConfig, Loss};

    use super::*;

    fn link(keys: &[&str]) -> Result<LinkModel, SceneError> {
        link_from_keys(&keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn keys_make_the_link_that_they_make_in_a_scene() {
        let delay = Delay::with_jitter(Duration::from_millis(24), Jitter::new(Duration::from_millis(2), Distribution::Normal)).unwrap();
        let expected = LinkConfig { delay, loss: Loss::Independent(Probability::new(0.01).unwrap()), ..LinkConfig::default() };
        assert_eq!(link(&["delay=24ms", "jitter={ sd = \"2ms\" }", "loss=1%"]).unwrap(), expected.into());
        assert_eq!(link(&[]).unwrap(), LinkModel::default());
    }

    #[test]
    fn a_fault_names_the_text_that_has_it() {
        for (keys, text) in [
            (["delay=24ms", "los=1%"], "link.los=1%"),
            (["delay=24 parsecs", "loss=1%"], "link.delay=24 parsecs"),
            (["delay", "loss=1%"], "link.delay"),
        ] {
            let error = link(&keys).unwrap_err();
            let diagnostic = error.diagnostic().unwrap();
            assert_eq!(diagnostic.override_text(), Some(text), "{error}");
            assert!(diagnostic.message().contains("expected"), "{error}");
        }
    }

    /// Links of every sort: each link of the scene is the link of its keys, also after its keys were written down and read back.
    #[test]
    fn the_keys_of_a_scene_make_its_links() {
        let text = format!(
            "{AROUND}{}",
            r#"
            modulators = [{ name = "cell", states = [{ name = "good", sojourn = "5s", next = "bad" }, { name = "bad", sojourn = "1s", next = "good" }] }]
            [link]
            delay = "24ms"
            jitter = { sd = "2ms", distribution = "pareto" }
            loss = { gilbert-elliott = { p = 0.01, r = 1e-1 } }
            rate = "1Mbit"
            [[links]]
            from = "peer1"
            to = "peer2"
            netem = "delay 20ms 5ms 25% distribution normal loss gemodel 1% 10%"
            [[links]]
            from = "peer2"
            to = "peer1"
            modulated = { by = "cell", good = { delay = "10ms" }, bad = { loss = "50%" } }
            [[links]]
            from = "peer3"
            to = "peer1"
            loss = { packets = [3, "10-19"], every = 100 }
        "#
        )
        .replace("count = 2", "count = 3");
        let overrides = ["links.peer1.peer3.delay=7ms".to_owned()];
        let file = Path::new("x.toml");
        let scene = Scene::parse(&text, file, &overrides).unwrap_or_else(|error| panic!("{error}"));
        let keys = link_keys_of_text(&text, file, &overrides).unwrap();
        assert_eq!(keys.len(), 6);
        for ((from, to), keys) in &keys {
            let folder = Path::new("");
            let expected = scene.links.between(*from, *to);
            assert_eq!(&keys.model(folder).unwrap_or_else(|error| panic!("{error}")), expected, "{from} {to}: {keys}");
            let again = LinkKeys { keys: Vec::new(), ..keys.clone() }.read(&keys.to_string()).unwrap();
            assert_eq!(&again.model(folder).unwrap(), expected, "{keys}");
            assert_eq!(&again, keys);
        }
        assert_eq!(keys[&(0, 2)].get("delay"), Some("\"7ms\""));
        assert_eq!(keys[&(1, 2)].iter().map(|(key, _)| key).collect::<Vec<_>>(), ["delay", "jitter", "loss", "rate"]);
    }

    /// The timeline's keys make the links that it makes, one change after the other, also where the file is not in order of time.
    #[test]
    fn the_keys_of_a_timeline_make_its_links() {
        let text = format!(
            "{AROUND}{}",
            r#"
            [link]
            delay = "24ms"
            loss = "1%"
            [[timeline]]
            at = "800ms"
            link = { from = "peer2", to = "peer1" }
            set = { netem = "delay 3ms loss 2%" }
            [[timeline]]
            at = "100ms"
            link = "all"
            set = { delay = "8ms", rate = "1Mbit" }
            [[timeline]]
            at = "500ms"
            peer = "peer1"
            set = { contact = "none" }
        "#
        );
        let file = Path::new("x.toml");
        let scene = Scene::parse(&text, file, &[]).unwrap_or_else(|error| panic!("{error}"));
        let changes = link_key_changes_of_text(&text, file, &[]).unwrap();
        let linked: Vec<_> = scene.timeline.iter().filter(|change| !matches!(change.what, crate::ChangeKind::Contact { .. })).collect();
        assert_eq!((changes.len(), linked.len()), (2, 2));
        for ((at, links), change) in changes.iter().zip(linked) {
            assert_eq!(*at, change.at);
            match &change.what {
                crate::ChangeKind::AllLinks(table) => {
                    assert_eq!(links.len(), 2);
                    assert!(links.iter().all(|((from, to), keys)| keys.model(Path::new("")).unwrap() == *table.between(*from, *to)));
                }
                crate::ChangeKind::Link(link) => {
                    assert_eq!(links.len(), 1);
                    assert_eq!(links[&(link.from, link.to)].model(Path::new("")).unwrap(), *link.config);
                }
                crate::ChangeKind::Contact { .. } | crate::ChangeKind::Hand { .. } | crate::ChangeKind::Coordination(_) => panic!("{change:?}"),
            }
        }
    }

    #[test]
    fn a_key_is_replaced_or_added_and_a_fault_in_it_is_named() {
        let keys = LinkKeys::default().with("delay", "8ms").with("loss", "0.1").with("delay", "\"9ms\"");
        assert_eq!(keys.to_string(), "{ loss = 0.1, delay = \"9ms\" }");
        let folder = Path::new("");
        assert_eq!(keys.model(folder).unwrap(), link(&["loss=0.1", "delay=9ms"]).unwrap());
        let text = keys.with("delay", "4 \"µs\"\n");
        assert_eq!(LinkKeys::default().read(&text.to_string()).unwrap().get("delay"), Some(r#""4 \"µs\"""#));
        let error = keys.with("delay", "4 parsecs").model(folder).unwrap_err();
        assert_eq!(error.diagnostic().unwrap().override_text(), Some("link.delay=4 parsecs"));
        assert!(keys.with("from", "left").model(folder).is_err());
        assert!(keys.with("scene", "1").with("", "1").model(folder).is_err());
        for text in ["", "{", "{ a = 1 } b", "7", "{}\nscene = 3", "{ a = 1 }\n[b]"] {
            assert_eq!(keys.read(text), None, "{text}");
        }
    }
}
