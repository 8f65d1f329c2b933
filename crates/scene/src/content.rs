//! What a scene says: as one number, and key by key, so that a record can tell whether it belongs to a scene and, if it does not, what differs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cohaptic_linkfile::document::{Node, Sources, Value, join, key_text, value_text};
use cohaptic_linkfile::reading::{Parsed, with_text};
use cohaptic_linkfile::{FileError, Fingerprint};

use crate::model::Scene;
use crate::read::parse_scene;

impl Scene {
    /// That of all that the scene says, and that the files say which it names. The same scene under another name, in another folder, with other words for the
    /// same values has the same one; a title that is written counts as nothing.
    #[must_use]
    pub fn fingerprint(mut self) -> Fingerprint {
        self.file = PathBuf::new();
        self.title.clear();
        Fingerprint::of(format_args!("{self:?}"))
    }
}

/// The keys of a scene as they are written, overrides included, and the files that it names.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct SceneContent {
    /// Each value as TOML, by its dotted path: `link.delay` is `"24ms"`. Entries of lists are called as in overrides; `peers` and `modulators`, whose order
    /// counts, have their names besides. Title, measures and expectations, which change nothing that happens, are left out.
    pub keys: BTreeMap<String, String>,
    /// What each file holds, by its path relative to the folder of the scene.
    pub files: BTreeMap<String, Fingerprint>,
}

/// The keys of a scene file, read as for a live session, and the files that it names.
///
/// # Errors
///
/// As [`Scene::read_live`].
pub fn scene_content(path: &Path, overrides: &[String]) -> Result<SceneContent, FileError> {
    with_text(path, |text| scene_content_of_text(text, path, overrides))
}

/// [`scene_content`] of a scene that is a text; `file` as in [`Scene::parse`].
///
/// # Errors
///
/// As [`Scene::parse_live`].
pub fn scene_content_of_text(text: &str, file: &Path, overrides: &[String]) -> Result<SceneContent, FileError> {
    let Parsed { document, files, .. } = parse_scene(Sources { file, text, overrides }, true, &mut |_, _, _| ())?;
    let mut keys = BTreeMap::new();
    collect(&document, "", &mut keys);
    let is_of = |key: &str, table: &str| key.strip_prefix(table).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    keys.retain(|key, _| key != "scene.title" && !is_of(key, "expect") && !is_of(key, "measure"));
    let folder = file.parent().unwrap_or_else(|| Path::new(""));
    let name = |path: PathBuf| path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().into_owned();
    Ok(SceneContent { keys, files: files.into_iter().map(|(path, bytes)| (name(path), bytes)).collect() })
}

/// A scene as one text with its overrides in it: a line for each key at the top. `text` and `file` as in [`Scene::parse`].
///
/// # Errors
///
/// As [`Scene::parse_live`].
pub fn scene_text(text: &str, file: &Path, overrides: &[String]) -> Result<String, FileError> {
    let Parsed { document, .. } = parse_scene(Sources { file, text, overrides }, true, &mut |_, _, _| ())?;
    let entries = document.as_table().map(|table| table.0.as_slice()).unwrap_or_default();
    Ok(entries.iter().map(|entry| format!("{} = {}\n", key_text(&entry.name), value_text(&entry.node))).collect())
}

/// Every value below a node that is no table.
fn collect(node: &Node, path: &str, keys: &mut BTreeMap<String, String>) {
    match &node.value {
        Value::Table(table) => {
            for entry in &table.0 {
                collect(&entry.node, &join(path, &entry.name), keys);
            }
        }
        Value::List(elements) if !elements.is_empty() && elements.iter().all(|element| element.as_table().is_some()) => {
            let name = |element: &Node| element.as_table()?.get("name").map(|entry| value_text(&entry.node));
            let names: Option<Vec<String>> = elements.iter().map(|element| name(element)).collect();
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
    /// A key or the name of a file and what it is, as one line of TOML: `"link.delay" = "24ms"`. [`SceneContent::read_line`] takes it.
    #[must_use]
    pub fn line(name: &str, value: &str) -> String {
        format!("{} = {value}", key_text(name))
    }

    /// The name and the value of a line, the value as TOML. `None` for anything else.
    #[must_use]
    pub fn read_line(line: &str) -> Option<(String, String)> {
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
