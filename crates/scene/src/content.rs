//! Content of a scene: as a fingerprint, and key by key. A record compares the content, and so finds whether the record belongs to a scene and, if not, the
//! differing keys.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cohaptic_linkfile::document::{Node, Sources, Value, join, key_text, value_text};
use cohaptic_linkfile::reading::{Parsed, with_text};
use cohaptic_linkfile::{FileError, Fingerprint};

use crate::model::Scene;
use crate::read::parse_scene;

impl Scene {
    /// Returns the fingerprint of the content of the scene and of all named files. Path, folder, title and notation of values do not count: `"1s"` and
    /// `"1000ms"` give the same fingerprint.
    #[must_use]
    pub fn fingerprint(mut self) -> Fingerprint {
        self.file = PathBuf::new();
        self.title.clear();
        Fingerprint::of(format_args!("{self:?}"))
    }
}

/// Keys of a scene as written, overrides included, and the named files.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct SceneContent {
    /// Values as TOML, indexed by dotted path: the value of `link.delay` is `"24ms"`. Entries of lists have the paths of overrides. The order of entries of
    /// `peers` and `modulators` counts, so that these two paths also have a value, the list of names. Title, measures and expectations are left out, because
    /// these keys do not change a run.
    pub keys: BTreeMap<String, String>,
    /// Fingerprints of the files' contents, indexed by path relative to the folder of the scene.
    pub files: BTreeMap<String, Fingerprint>,
}

/// Returns the keys of a scene file, read as for a live session, and the fingerprints of the named files.
///
/// # Errors
///
/// As [`Scene::read_live`].
pub fn scene_content(path: &Path, overrides: &[String]) -> Result<SceneContent, FileError> {
    with_text(path, |text| scene_content_of_text(text, path, overrides))
}

/// Like [`scene_content`], for a scene in a text; `file` as in [`Scene::parse`].
///
/// # Errors
///
/// As [`Scene::parse_live`].
pub fn scene_content_of_text(text: &str, file: &Path, overrides: &[String]) -> Result<SceneContent, FileError> {
    let Parsed { document, files, .. } = parse_scene(Sources { file, text, overrides }, true, &mut |_, _, _| ())?;
    let mut keys = BTreeMap::new();
    collect(&document, "", &mut keys);
    let is_of = |key: &str, table: &str| key.strip_prefix(table).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    // `is_of` compares whole names, so that a key such as `measured` would stay.
    keys.retain(|key, _| key != "scene.title" && !is_of(key, "expect") && !is_of(key, "measure"));
    // Paths relative to the scene's folder: a scene moved together with all files has the same content.
    let folder = file.parent().unwrap_or_else(|| Path::new(""));
    let name = |path: PathBuf| path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().into_owned();
    Ok(SceneContent { keys, files: files.into_iter().map(|(path, bytes)| (name(path), bytes)).collect() })
}

/// Returns a scene as a text with the overrides, a line per key at the top level. `text` and `file` as in [`Scene::parse`].
///
/// # Errors
///
/// As [`Scene::parse_live`].
pub fn scene_text(text: &str, file: &Path, overrides: &[String]) -> Result<String, FileError> {
    let Parsed { document, .. } = parse_scene(Sources { file, text, overrides }, true, &mut |_, _, _| ())?;
    let entries = document.as_table().map(|table| table.0.as_slice()).unwrap_or_default();
    Ok(entries.iter().map(|entry| format!("{} = {}\n", key_text(&entry.name), value_text(&entry.node))).collect())
}

/// Inserts into `keys` every value below `node` that is not a table. `path` is the path of `node`.
fn collect(node: &Node, path: &str, keys: &mut BTreeMap<String, String>) {
    match &node.value {
        Value::Table(table) => {
            for entry in &table.0 {
                collect(&entry.node, &join(path, &entry.name), keys);
            }
        }
        // A list of tables, such as `peers`: each entry has a path, by name where the entry has a name.
        Value::List(elements) if !elements.is_empty() && elements.iter().all(|element| element.as_table().is_some()) => {
            let name = |element: &Node| element.as_table()?.get("name").map(|entry| value_text(&entry.node));
            let names: Option<Vec<String>> = elements.iter().map(|element| name(element)).collect();
            // The paths of named entries do not show the order of the entries, so that the list of names is a value too. Paths of other entries contain the
            // index.
            if let Some(names) = names {
                keys.insert(path.to_owned(), format!("[{}]", names.join(", ")));
            }
            for element in elements {
                collect(element, &element.path, keys);
            }
        }
        Value::List(_) | Value::Text(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date => {
            keys.insert(path.to_owned(), value_text(node));
        }
    }
}

impl SceneContent {
    /// Returns a line of TOML for the name of a key or of a file and the value: `"link.delay" = "24ms"`. [`SceneContent::read_line`] reads the line.
    #[must_use]
    pub fn line(name: &str, value: &str) -> String {
        format!("{} = {value}", key_text(name))
    }

    /// Returns name and value of a line, the value as TOML. `None` if the text is not a single key with a value.
    #[must_use]
    pub fn read_line(line: &str) -> Option<(String, String)> {
        // The line is TOML, so that the parser undoes the quotes of names and values.
        let document = Node::document(toml::de::DeTable::parse(line).ok()?.get_ref()).ok()?;
        let [only] = document.as_table()?.0.as_slice() else { return None };
        Some((only.name.clone(), value_text(&only.node)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "scene = { duration = \"1s\", title = \"a title\" }\nobject = { mass = 1.0 }\n\
        coordination = { strategy = \"average-position\", stiffness = 1.0, damping = 1.0, update = \"1ms\" }\n\
        peer = { device = { mass = 1.0, damping = 1.0 }, coupling = { stiffness = 1.0, damping = 1.0 } }\n\
        peers = [{ name = \"left\", contact = \"none\", hand = { file = \"hand.csv\" } }, { name = \"right\" }]\nlink = { delay = \"24ms\" }\n\
        timeline = [{ at = \"0.5s\", link = \"all\", set = { loss = 0.5 } }]\n[measure]\nband = 0.002\n[expect]\nstable = true\n";

    #[test]
    fn the_text_of_a_scene_with_overrides_is_that_scene() {
        let (_folder, file) = desk();
        let overrides = ["link.delay=8ms", "peers.right.contact=none", "links.left.right.loss=5%"].map(str::to_owned);
        let text = scene_text(TEXT, &file, &overrides).unwrap();
        let (one, other) = (Scene::parse_live(TEXT, &file, &overrides).unwrap(), Scene::parse_live(&text, &file, &[]).unwrap());
        assert_eq!(one, other, "{text}");
        assert_eq!(scene_content_of_text(TEXT, &file, &overrides).unwrap(), scene_content_of_text(&text, &file, &[]).unwrap());
    }

    fn desk() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("hand.csv"), "t,fx\n0,1\n").unwrap();
        let file = folder.path().join("two.toml");
        (folder, file)
    }

    #[test]
    fn what_a_scene_says_is_its_keys_with_the_overrides_and_what_its_files_hold() {
        let (_folder, file) = desk();
        let content = scene_content_of_text(TEXT, &file, &["peers.right.device.mass=2".to_owned(), "link.delay=8ms".to_owned()]);
        let content = content.unwrap_or_else(|error| panic!("{error}"));
        let value = |key: &str| content.keys.get(key).map(String::as_str);
        assert_eq!(value("link.delay"), Some("\"8ms\""));
        assert_eq!(value("peers"), Some("[\"left\", \"right\"]"));
        assert_eq!(value("peers.left.contact"), Some("\"none\""));
        assert_eq!(value("peers.right.device.mass"), Some("2"));
        assert_eq!(value("timeline.0.set.loss"), Some("0.5"));
        assert_eq!((value("scene.title"), value("measure.band"), value("expect.stable")), (None, None, None));
        assert_eq!(content.files, BTreeMap::from([("hand.csv".to_owned(), Fingerprint::of("t,fx\n0,1\n"))]));
    }

    #[test]
    fn a_line_is_read_back() {
        for (name, value) in [("link.delay", "\"24ms\""), ("peers.a \"b\"\n.x", "[1.0, 2]"), ("a", "\"\\u0007\"")] {
            assert_eq!(SceneContent::read_line(&SceneContent::line(name, value)), Some((name.to_owned(), value.to_owned())));
        }
        for line in ["", "a", "a = ", "a = 1\nb = 2"] {
            assert_eq!(SceneContent::read_line(line), None, "{line:?}");
        }
    }
}
