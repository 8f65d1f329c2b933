//! Identity of the scene of a record of inputs, to notice a replay with a different scene.
//!
//! The identity stands before all inputs in a record, as rows of its own:
//!
//! ```text
//! 0,program,,,0.1.0
//! 0,scene,,,85944171f73967e8
//! 0,file,,,"""hand.csv"" = ""f00d… (the fingerprint of what it holds)"""
//! 0,key,,,"""link.delay"" = ""24ms"""
//! ```

use core::fmt;
use std::collections::BTreeMap;

use cohaptic_scene::{Fingerprint, Scene, SceneContent};
use cohaptic_units::print::csv_quoted;

use super::inputs::{HEADER, InputsError, shorten};

/// Identity of the scene of a record of inputs.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RecordedScene {
    /// Version of the recording program.
    program: String,
    /// Fingerprint of the scene without its expectations.
    fingerprint: Fingerprint,
    /// Keys and files of the scene.
    content: SceneContent,
}

/// Difference between a recorded scene and a present one. Values are TOML; `None`: absent.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum SceneDifference {
    /// A key differs.
    Key {
        /// Dotted path of the key.
        key: String,
        /// Recorded value.
        recorded: Option<String>,
        /// Present value.
        now: Option<String>,
    },
    /// A file named by the scene differs.
    File {
        /// Path relative to the folder of the scene.
        name: String,
        /// Fingerprint of the recorded content.
        recorded: Option<Fingerprint>,
        /// Fingerprint of the present content.
        now: Option<Fingerprint>,
    },
    /// The scenes differ, but the record has no keys and files to compare.
    Unsaid,
    /// No key and no file differs: the present version of the program reads the scene differently.
    Program {
        /// Version of the recording program.
        recorded: String,
        /// Version of the present program.
        now: String,
    },
}

impl fmt::Display for SceneDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A value can be a long list, for example the samples of a table, so messages show only its beginning.
        let value = |value: &Option<String>| value.as_deref().map(shorten);
        match self {
            Self::Key { key, recorded, now } => match (value(recorded), value(now)) {
                (Some(recorded), Some(now)) => write!(f, "{key}: {recorded} in the record, {now} now"),
                (Some(recorded), None) => write!(f, "{key}: {recorded} in the record, not there now"),
                (None, Some(now)) => write!(f, "{key}: not in the record, {now} now"),
                (None, None) => write!(f, "{key}"),
            },
            Self::File { name, recorded: Some(_), now: Some(_) } => write!(f, "the file {name}: something else in the record than now"),
            Self::File { name, recorded: Some(_), now: None } => write!(f, "the file {name}: named in the record, not now"),
            Self::File { name, .. } => write!(f, "the file {name}: not named in the record"),
            Self::Unsaid => f.write_str("something; the record does not hold the keys of its scene"),
            Self::Program { recorded, now } => {
                write!(f, "no key and no file, but their meaning: cohaptic {recorded} in the record, {now} now")
            }
        }
    }
}

/// Version of the present program.
const PROGRAM: &str = env!("CARGO_PKG_VERSION");

/// Kinds of rows about the scene.
const KINDS: [&str; 4] = ["program", "scene", "file", "key"];

impl RecordedScene {
    /// Returns the identity of a scene. `content`: keys and files from [`cohaptic_scene::scene_content`]. With empty content, a replay can notice a different
    /// scene but cannot name the difference.
    #[must_use]
    pub fn of(scene: &Scene, content: SceneContent) -> Self {
        Self { program: PROGRAM.to_owned(), fingerprint: Self::fingerprint_of(scene), content }
    }

    /// Returns the fingerprint that a record has of a scene, without the expectations of the scene: expectations do not change a run.
    #[must_use]
    pub fn fingerprint_of(scene: &Scene) -> Fingerprint {
        Scene { expect: None, ..scene.clone() }.fingerprint()
    }

    /// Reads the identity from the text of a record of inputs; `None` if the record has none, as records of early versions.
    ///
    /// # Errors
    ///
    /// [`InputsError`] if a row about the scene cannot be read.
    pub fn read(text: &str) -> Result<Option<Self>, InputsError> {
        let (mut program, mut fingerprint, mut content) = (None, None, SceneContent::default());
        for (line, row) in (1..).zip(text.lines()).skip(1) {
            // Rows about the scene come first, and the first different row ends them.
            let Some((kind, value)) = kind_and_value(row) else { break };
            let refused = |expected: &str| InputsError::Cell { line, column: "value", found: shorten(value), expected: expected.to_owned() };
            match kind {
                "program" => program = Some(value.to_owned()),
                "scene" => fingerprint = Some(value.parse().map_err(|_| refused("16 hexadecimal digits"))?),
                "file" => {
                    let (name, bytes) = line_in(value).ok_or_else(|| refused("the name of a file and 16 hexadecimal digits, in quotes"))?;
                    let bytes = bytes.trim_matches('"').parse().map_err(|_| refused("the name of a file and 16 hexadecimal digits, in quotes"))?;
                    content.files.insert(name, bytes);
                }
                _ => {
                    let (key, value) = line_in(value).ok_or_else(|| refused("a key and its value as TOML, in quotes"))?;
                    content.keys.insert(key, value);
                }
            }
        }
        Ok(fingerprint.map(|fingerprint| Self { program: program.unwrap_or_default(), fingerprint, content }))
    }

    /// Returns the differences to the present scene `other`. Empty if both are the same.
    #[must_use]
    pub fn differences(&self, other: &Self) -> Vec<SceneDifference> {
        if self.fingerprint == other.fingerprint {
            return Vec::new();
        }
        if self.content.keys.is_empty() {
            return vec![SceneDifference::Unsaid];
        }
        let keys = differing(&self.content.keys, &other.content.keys);
        let files = differing(&self.content.files, &other.content.files);
        let mut differences: Vec<SceneDifference> = keys.map(|(key, recorded, now)| SceneDifference::Key { key, recorded, now }).collect();
        differences.extend(files.map(|(name, recorded, now)| SceneDifference::File { name, recorded, now }));
        // The fingerprints differ although keys and files are equal.
        if differences.is_empty() {
            differences.push(SceneDifference::Program { recorded: self.program.clone(), now: other.program.clone() });
        }
        differences
    }
}

/// Returns the names whose entries in two maps differ, with both entries, in the order of the names.
fn differing<T: Clone + PartialEq>(one: &BTreeMap<String, T>, other: &BTreeMap<String, T>) -> impl Iterator<Item = (String, Option<T>, Option<T>)> {
    // A name may stand in only one of the maps, so the names of both are joined.
    let mut names: Vec<&String> = one.keys().chain(other.keys()).collect();
    names.sort();
    names.dedup();
    let row = |name: &String| (name.clone(), one.get(name).cloned(), other.get(name).cloned());
    names.into_iter().map(row).filter(|(_, one, other)| one != other).collect::<Vec<_>>().into_iter()
}

/// Returns whether a line of a record is about its scene.
pub(super) fn is_about_the_scene(row: &str) -> bool {
    kind_and_value(row).is_some()
}

/// Returns the kind and the value of a row about the scene; `None` for different rows.
fn kind_and_value(row: &str) -> Option<(&str, &str)> {
    // Rows about the scene have the instant 0 and neither peer nor receiver, so their cells are empty.
    let (kind, rest) = row.strip_prefix("0,")?.split_once(',')?;
    let value = rest.strip_prefix(",,")?;
    KINDS.contains(&kind).then_some((kind, value))
}

/// Returns the name and the value in a quoted cell; `None` if the cell has a different form.
fn line_in(cell: &str) -> Option<(String, String)> {
    let quoted = cell.strip_prefix('"')?.strip_suffix('"')?;
    // In a quoted cell of CSV, a doubled quotation mark stands for one.
    SceneContent::read_line(&quoted.replace("\"\"", "\""))
}

/// Writes the lines of a record before its inputs: the header, and the rows about the scene.
impl fmt::Display for RecordedScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{HEADER}")?;
        writeln!(f, "0,program,,,{}", self.program)?;
        writeln!(f, "0,scene,,,{}", self.fingerprint)?;
        let mut row = |kind: &str, name: &str, value: &str| writeln!(f, "0,{kind},,,{}", csv_quoted(&SceneContent::line(name, value)));
        for (name, bytes) in &self.content.files {
            row("file", name, &format!("\"{bytes}\""))?;
        }
        for (key, value) in &self.content.keys {
            row("key", key, value)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cohaptic_scene::scene_content_of_text;

    use super::*;

    const TEXT: &str = "scene = { duration = \"1s\", title = \"a title\" }\nobject = { mass = 1.0 }\n\
        coordination = { strategy = \"average-position\", stiffness = 1.0, damping = 1.0, update = \"1ms\" }\n\
        peer = { device = { mass = 1.0, damping = 1.0 }, coupling = { stiffness = 1.0, damping = 1.0 } }\n\
        peers = [{ name = \"left\", hand = { file = \"hand.csv\" } }, { name = \"right\" }]\nlink = { delay = \"24ms\" }\n";

    fn recorded(folder: &Path, text: &str, overrides: &[&str]) -> RecordedScene {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        let file = folder.join("two.toml");
        let scene = Scene::parse_live(text, &file, &overrides).unwrap_or_else(|error| panic!("{error}"));
        RecordedScene::of(&scene, scene_content_of_text(text, &file, &overrides).unwrap())
    }

    fn folder(hand: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("hand.csv"), hand).unwrap();
        folder
    }

    #[test]
    fn what_is_written_is_read_back() {
        let folder = folder("t,fx\n0,1\n");
        let written = recorded(folder.path(), TEXT, &["peers.left.contact=none"]);
        assert_eq!(RecordedScene::read(&format!("{written}5,end,,,\n")), Ok(Some(written.clone())));
        assert_eq!(RecordedScene::read(&format!("{HEADER}\n5,end,,,\n")), Ok(None));
        assert_eq!(RecordedScene::read(""), Ok(None));
        for row in ["0,scene,,,x", "0,file,,,x", "0,file,,,\"a = 1\"", "0,key,,,\"a\"", "0,key,,,a = 1"] {
            assert!(RecordedScene::read(&format!("{HEADER}\n{row}\n")).is_err(), "{row}");
        }
    }

    #[test]
    fn the_same_scene_in_other_words_in_another_folder_is_the_same() {
        let [here, there] = ["t,fx\n0,1\n", "t,fx\n0,1\n"].map(folder);
        let one = recorded(here.path(), TEXT, &[]);
        let title = TEXT.replace("a title", "another title");
        for (text, overrides) in [(TEXT, &[][..]), (&title, &["link.delay=24000us"]), (TEXT, &["expect={ }"]), (TEXT, &["object.mass=1"])] {
            assert_eq!(one.differences(&recorded(there.path(), text, overrides)), []);
        }
    }

    #[test]
    fn each_key_and_each_file_that_differs_is_named() {
        let [here, there] = ["t,fx\n0,1\n", "t,fx\n0,2\n"].map(folder);
        let one = recorded(here.path(), TEXT, &["link.loss=1%"]);
        let changed = TEXT.replace("\"24ms\"", "\"25ms\"").replace("name = \"right\"", "name = \"right\", contact = \"none\"");
        let lines: Vec<String> = one.differences(&recorded(there.path(), &changed, &[])).iter().map(ToString::to_string).collect();
        let expected = [
            "link.delay: \"24ms\" in the record, \"25ms\" now",
            "link.loss: \"1%\" in the record, not there now",
            "peers.right.contact: not in the record, \"none\" now",
            "the file hand.csv: something else in the record than now",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn the_order_of_peers_counts() {
        let folder = folder("t,fx\n0,1\n");
        let turned = TEXT.replace(
            "{ name = \"left\", hand = { file = \"hand.csv\" } }, { name = \"right\" }",
            "{ name = \"right\" }, { name = \"left\", hand = { file = \"hand.csv\" } }",
        );
        let differences = recorded(folder.path(), TEXT, &[]).differences(&recorded(folder.path(), &turned, &[]));
        let lines: Vec<String> = differences.iter().map(ToString::to_string).collect();
        assert_eq!(lines, ["peers: [\"left\", \"right\"] in the record, [\"right\", \"left\"] now"]);
    }

    #[test]
    fn a_scene_that_another_version_reads_in_another_way_says_so() {
        let folder = folder("t,fx\n0,1\n");
        let one = recorded(folder.path(), TEXT, &[]);
        let other = RecordedScene { program: "0.0.1".to_owned(), fingerprint: Fingerprint::of("x"), ..one.clone() };
        let lines: Vec<String> = other.differences(&one).iter().map(ToString::to_string).collect();
        assert_eq!(lines, [format!("no key and no file, but their meaning: cohaptic 0.0.1 in the record, {PROGRAM} now")]);
    }
}
