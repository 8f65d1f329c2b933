//! Reference of JSON documents: the meaning of each key, checked against documents that the commands print.

mod list;
mod parts;

use std::collections::BTreeSet;

use cohaptic_scene::Measure;
use serde_json::Value;

use super::{WRITTEN, entry, prose};
use crate::pages::folder::Folder;
use list::{DOCUMENTS, NAMESPACES};
use parts::{PARTS, Part};

const INTRODUCTION: &str = "\
The documents of `--json`, command by command. Every document begins with `schema`, its kind, and `version` ([commands.md](commands.md#json)); they are left out here. Keys end in their
unit. A number that is not finite is `null`. Brackets, `links[]`, mark a list; `NAME` stands for any name. An entry with a link has all keys of another part.
";

const MEASURES: &str = "\
The names under `measures`, of columns of a campaign, and of `[measure]` and `[expect]` in a scene. Definitions are in [model.md](model.md#measures).
";

/// The heading of a part, and whether a key of it is left out.
fn part_of(key: &str) -> Option<(&str, &'static Part, Option<&str>)> {
    let (prefix, name) = key.split_once('@')?;
    let (name, without) = name.split_once(" but ").map_or((name, None), |(name, without)| (name, Some(without)));
    let part = PARTS.iter().find(|part| part.name == name).unwrap_or_else(|| panic!("there is no part {name}"));
    Some((prefix, part, without))
}

/// The keys of rows, one by one.
fn keys(rows: &'static [(&'static str, &'static str)]) -> Vec<String> {
    let one = |key: &'static str| match part_of(key) {
        Some((prefix, part, without)) => {
            let inner = keys(part.rows).into_iter().filter(|key| Some(key.as_str()) != without);
            inner.map(|key| format!("{prefix}{key}")).collect()
        }
        None => vec![key.to_owned()],
    };
    rows.iter().flat_map(|(keys, _)| keys.split(", ")).flat_map(one).collect()
}

fn shown(keys: &str) -> String {
    let one = |key: &str| match part_of(key) {
        Some((prefix, part, without)) => {
            let but = without.map_or_else(String::new, |key| format!(" but `{key}`"));
            let link = format!("[{}](#{}){but}", part.name, part.name.to_lowercase().replace(' ', "-"));
            if prefix.is_empty() { link } else { format!("`{prefix}…` {link}") }
        }
        None => format!("`{key}`"),
    };
    keys.split(", ").map(one).collect::<Vec<_>>().join(", ")
}

fn rows(of: &[(&str, &str)]) -> String {
    of.iter().map(|(keys, about)| entry(&shown(keys), &[], about)).collect::<String>() + "\n"
}

/// The whole page.
pub(super) fn page() -> String {
    let mut page = format!("# Reference: JSON documents\n\n{WRITTEN}\n\n{INTRODUCTION}\n");
    for document in DOCUMENTS.into_iter().flatten() {
        page += &format!("## {}\n\n{}", document.command, rows(document.rows));
    }
    page += "## Parts of several documents\n\n";
    for part in &PARTS {
        page += &format!("### {}\n\n{}", part.name, rows(part.rows));
    }
    page += &format!("## Measures\n\n{MEASURES}\n");
    page.extend(Measure::ALL.iter().map(|measure| entry(&format!("`{}`", measure.pattern()), &[measure.unit()], &prose(measure.about()))));
    page.trim_end().to_owned() + "\n"
}

/// The paths of all keys within a value that hold no table.
fn paths(path: &str, value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(members) if !members.is_empty() => {
            for (name, member) in members {
                paths(&if path.is_empty() { name.clone() } else { format!("{path}.{name}") }, member, found);
            }
        }
        Value::Array(elements) if elements.iter().any(Value::is_object) => {
            elements.iter().for_each(|element| paths(&format!("{path}[]"), element, found))
        }
        Value::Array(_) | Value::Object(_) | Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {
            found.insert(path.to_owned());
        }
    }
}

/// Returns whether a path belongs to a key of the table. `NAME` at the end of the key stands for any name and for all keys within.
fn is_of(path: &str, key: &str) -> bool {
    match key.strip_suffix("NAME") {
        Some(prefix) => path.starts_with(prefix) || prefix.strip_suffix('.') == Some(path),
        None => path == key,
    }
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn documents_have_the_keys_of_the_page_and_no_other() {
    for document in DOCUMENTS.into_iter().flatten() {
        let keys = keys(document.rows);
        let (mut all, mut documents) = (BTreeSet::new(), String::new());
        for line in document.lines {
            let folder = Folder::new();
            let is_in_namespaces = document.command == "router" || document.command.starts_with("exec");
            let needs = if is_in_namespaces { NAMESPACES } else { "python3" };
            if (is_in_namespaces || line.contains("python3")) && !folder.has(needs) {
                eprintln!("the document of {} is not read here, for want of `{needs}`", document.command);
                continue;
            }
            let printed = folder.run(&format!("{{ {line}; }} 2> said-besides"), "").printed;
            let begin = printed.find('{').unwrap_or_else(|| panic!("{line}: no document: {printed}"));
            let value: Value = serde_json::from_str(&printed[begin..]).unwrap_or_else(|error| panic!("{line}: {error}: {printed}"));
            paths("", &value, &mut all);
            documents += &printed;
        }
        // A second document within the first has the same keys.
        all.retain(|path| path != "schema" && path != "version" && !path.starts_with("against."));
        for path in &all {
            let is_list = keys.iter().any(|key| key.strip_prefix(path.as_str()).is_some_and(|rest| rest.starts_with("[]") || rest.starts_with('.')));
            assert!(is_list || keys.iter().any(|key| is_of(path, key)), "{}: the page has no key {path}: {documents}", document.command);
        }
        let is_seen =
            |key: &String| all.is_empty() || key == "against" || all.iter().any(|path| is_of(path, key) || path.starts_with(&format!("{key}.")));
        let missing: Vec<&String> = keys.iter().filter(|key| !is_seen(key)).collect();
        assert!(missing.is_empty(), "{}: no document has {missing:?}", document.command);
    }
}
