//! Tests of the catalogue of keys against readers and pages. `python/tests/test_schema.py` tests the JSON Schemas against files.

mod samples;

use std::collections::{BTreeMap, BTreeSet};

use cohaptic_linkfile::document::{Node, Value};
use cohaptic_linkfile::schema::link::LINK_TABLE;
use cohaptic_linkfile::schema::{Form, Table};
use toml::de::DeTable;

use samples::{read, root, samples};

use super::FileSchema;

/// Returns every table of the catalogue once, with a path to the table for messages. The map is indexed by address, because several keys share a table.
fn tables() -> BTreeMap<*const Table, (String, &'static Table)> {
    fn walk(way: &str, table: &'static Table, all: &mut BTreeMap<*const Table, (String, &'static Table)>) {
        if all.insert(core::ptr::from_ref(table), (way.to_owned(), table)).is_some() {
            return;
        }
        for key in table.keys() {
            walk_form(&format!("{way}.{}", key.name), &key.form, all);
        }
        table.others.into_iter().for_each(|form| walk_form(&format!("{way}.*"), form, all));
    }
    fn walk_form(way: &str, form: &'static Form, all: &mut BTreeMap<*const Table, (String, &'static Table)>) {
        if let Form::Table(table) = form {
            walk(way, table, all);
        } else if let Form::AnyOf(forms) = form {
            forms.iter().for_each(|form| walk_form(way, form, all));
        } else if let Form::List(form) | Form::Pair(form) = form {
            walk_form(way, form, all);
        }
    }
    let mut all = BTreeMap::new();
    FileSchema::ALL.iter().for_each(|kind| walk(kind.title(), kind.root(), &mut all));
    all
}

/// Returns the path of every table of a document.
fn paths(node: &Node) -> Vec<&str> {
    match &node.value {
        Value::Table(table) => core::iter::once(node.path.as_str()).chain(table.0.iter().flat_map(|entry| paths(&entry.node))).collect(),
        Value::List(elements) => elements.iter().flat_map(|element| paths(element)).collect(),
        Value::Text(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date => Vec::new(),
    }
}

/// Readers ask for every declared key. The test puts an unknown key into each table: the message lists the keys that the reader knows, and must list all
/// declared keys. Readers cannot ask for a key that is not declared.
#[test]
fn readers_take_every_key_that_is_declared() {
    let keys = |declared: &'static Table| declared.keys().map(|key| key.name.to_owned()).collect::<BTreeSet<String>>();
    let mut taken: BTreeMap<*const Table, BTreeSet<String>> = BTreeMap::new();
    for sample in &samples() {
        let document = Node::document(DeTable::parse(&sample.text).unwrap().get_ref()).unwrap();
        for path in paths(&document) {
            // The path of a link holds the two names of its ends; the catalogue has one table for all entries of the list.
            let ends = path.strip_prefix("links.").filter(|_| sample.kind != FileSchema::Router);
            let below = ends.map_or_else(|| path.to_owned(), |ends| format!("links.{}", ends.split_once('.').unwrap().1));
            let declared = if path.is_empty() { sample.kind.root() } else { sample.kind.root().table(&below) };
            let known = taken.entry(core::ptr::from_ref(declared)).or_default();
            if declared.others.is_none() && *known != keys(declared) {
                let refused = read(sample, &[format!("{path}.no-such-key=1").trim_start_matches('.').to_owned()]).unwrap_err();
                let message = refused.diagnostic().unwrap().message();
                let listed = message.strip_prefix("unknown key: expected ").unwrap_or_else(|| panic!("{path}: {message}"));
                known.extend(listed.trim_start_matches("one of ").split(", ").map(str::to_owned));
            }
        }
    }
    for (table, (way, declared)) in tables().into_iter().filter(|(_, (_, declared))| declared.others.is_none()) {
        assert_eq!(Some(&keys(declared)), taken.get(&table), "{way}");
    }
}

/// Every key has a description, and the schema shows description, unit and default.
#[test]
fn every_property_is_described() {
    for (_, (way, table)) in tables() {
        for key in table.keys() {
            assert!(key.about.len() >= 6 && !key.about.ends_with('.') && key.about.starts_with(char::is_uppercase), "{way}.{}", key.name);
        }
    }
    let schema = FileSchema::Scene.json();
    let stiffness = &schema["properties"]["coordination"]["properties"]["stiffness"];
    assert_eq!(stiffness["description"], "Gain on the difference of positions, K_T [N/m]. Must be given.");
    assert_eq!(stiffness["minimum"], 0);
    assert_eq!(schema["properties"]["peer"]["properties"]["tick"]["default"], "1ms");
    let text = schema.to_string();
    assert!(!text.contains("$ref") && !text.contains("allOf"), "editors for TOML do not take them");
}

/// The reference pages and the catalogue name the same keys.
#[test]
fn the_reference_has_the_keys_of_the_catalogue() {
    let page = |name: &str| std::fs::read_to_string(root().join("docs").join(name)).unwrap();
    let links = page("reference-link-keys.md");
    let of_links = links.split("\n## Keys of a link\n\n").nth(1).unwrap();
    let rows: Vec<&str> = of_links.lines().take_while(|line| line.starts_with("- `")).filter_map(|line| line.split('`').nth(1)).collect();
    assert_eq!(rows, LINK_TABLE.keys().map(|key| key.name).collect::<Vec<_>>(), "the list of the keys of a link");

    let listed: BTreeSet<&str> = tables().values().flat_map(|(_, table)| table.keys().map(|key| key.name)).collect();
    let pages = links + &page("reference-keys.md") + &page("reference-network-keys.md");
    let mut named = BTreeSet::new();
    for row in pages.lines().filter(|line| line.starts_with("- `")) {
        let path = row.split('`').nth(1).unwrap();
        for name in path.split('.').map(|name| name.trim_end_matches("[]")).filter(|name| !["", "…", "NAME"].contains(name)) {
            named.insert(name);
        }
    }
    // The tables at the top level of a file are headings of the pages, not entries of a list.
    for heading in pages.lines().filter(|line| line.starts_with("## ") || line.starts_with("### ")) {
        named.extend(heading.split('`').nth(1).map(|name| name.trim_matches(['[', ']']).split('.').next().unwrap_or_default()));
    }
    assert_eq!(named, listed);
}

#[test]
fn numbers_have_the_units_of_mechanics_and_texts_have_none() {
    for (key, unit) in [
        ("coordination.stiffness", "N/m"),
        ("coordination.damping", "N·s/m"),
        ("object.mass", "kg"),
        ("peer.coupling.stiffness", "N/m"),
        ("peers.anna.coupling.damping", "N·s/m"),
        ("link.delay", ""),
        ("link.loss", ""),
        ("links.anna.bob.delay", ""),
        ("coordination.strategy", ""),
        ("scene.seed", ""),
        ("scene", ""),
        ("coordination.stifness", ""),
        ("", ""),
    ] {
        assert_eq!(FileSchema::Scene.unit_of(key), unit, "{key}");
    }
}
