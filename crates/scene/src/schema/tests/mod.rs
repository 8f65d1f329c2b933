//! The catalogue against the readers, both ways, and the JSON Schema against files.

mod samples;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use cohaptic_linkfile::reading::testing::take_seen;
use cohaptic_linkfile::schema::{Form, Need, Table};
use serde_json::{Map, Value, json};
use toml::de::{DeTable, DeValue};

use samples::{SCENES, Sample, read, root, samples};

use super::FileSchema;
use crate::Scene;

/// The tables of the catalogue that a path leads to. An element of a list may have several names in a path: a link between two ends has two.
fn tables_at(form: &'static Form, path: &[&str], names: usize) -> Vec<&'static Table> {
    match form {
        Form::Table(table) => within(table, path),
        // A key of a table that may stand there is no element of a list that may.
        Form::AnyOf(forms) => match form.table().filter(|table| path.first().is_some_and(|first| table.key(first).is_some())) {
            Some(table) => within(table, path),
            None => forms.iter().flat_map(|form| tables_at(form, path, names)).collect(),
        },
        Form::List(element) | Form::Pair(element) => path.get(names..).map_or_else(Vec::new, |rest| tables_at(element, rest, 1)),
        Form::Text
        | Form::File
        | Form::Boolean
        | Form::Integer(..)
        | Form::Number(_)
        | Form::Vector(_)
        | Form::Triple(_)
        | Form::Duration
        | Form::Rate
        | Form::Size
        | Form::Probability
        | Form::Like(_)
        | Form::Words(_) => Vec::new(),
    }
}

fn within(table: &'static Table, path: &[&str]) -> Vec<&'static Table> {
    let Some((first, rest)) = path.split_first() else { return vec![table] };
    match (table.key(first), table.others) {
        (Some(key), _) => tables_at(&key.form, rest, if *first == "links" { 2 } else { 1 }),
        (None, Some(others)) => tables_at(others, rest, 1),
        (None, None) => Vec::new(),
    }
}

fn split(path: &str) -> Vec<&str> {
    path.split('.').filter(|name| !name.is_empty()).collect()
}

/// Every table of the catalogue, each once, with a way to it for messages.
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

/// Where readers of tables were, by table of the catalogue: in which sample and under which path, and which keys they knew.
type Visits = BTreeMap<*const Table, (BTreeSet<&'static str>, Vec<(usize, String)>)>;

fn visits(samples: &[Sample]) -> Visits {
    let mut visits = Visits::new();
    for (number, sample) in samples.iter().enumerate() {
        let _ = take_seen();
        read(sample, &[]).unwrap_or_else(|error| panic!("{}: {error}", sample.path.display()));
        for (path, known) in take_seen() {
            let found = within(sample.kind.root(), &split(&path));
            assert!(!found.is_empty(), "the catalogue has no table {path}, which the reader reads in {}", sample.path.display());
            for table in found {
                let (keys, places) = visits.entry(core::ptr::from_ref(table)).or_default();
                keys.extend(known.iter().copied());
                places.push((number, path.clone()));
            }
        }
    }
    visits
}

#[test]
fn the_catalogue_has_the_keys_that_the_readers_ask_for_and_no_other() {
    let visits = visits(&samples());
    for (table, (way, fields)) in tables() {
        // Under names that the file makes up, a reader takes any key and requires none.
        if fields.others.is_some() {
            continue;
        }
        let (asked, _) = visits.get(&table).unwrap_or_else(|| panic!("no sample has a table {way}"));
        let listed: BTreeSet<&str> = fields.keys().map(|key| key.name).collect();
        assert_eq!(listed, *asked, "{way}");
    }
}

/// Wherever a table is read, a default of the catalogue changes nothing; each can be written in at least one place.
#[test]
fn a_default_of_the_catalogue_is_what_the_reader_takes_without_the_key() {
    let samples = samples();
    let visits = visits(&samples);
    let as_written: Vec<String> = samples.iter().map(|sample| read(sample, &[]).unwrap()).collect();
    let tables = tables();
    for (table, (_, places)) in &visits {
        let (way, fields) = &tables[table];
        // Without a key, what it is laid over holds.
        if fields.is_laid_over {
            continue;
        }
        for key in fields.keys() {
            let Need::Default(default) = key.need else { continue };
            let mut accepted = 0;
            for (number, path) in places {
                let sample = &samples[*number];
                let full = if path.is_empty() { key.name.to_owned() } else { format!("{path}.{}", key.name) };
                if has(&sample.text, &split(&full)) {
                    continue;
                }
                let Ok(with) = read(sample, &[format!("{full}={default}")]) else { continue };
                // What an entry says replaces what it is laid over, so that it is no default where that says something else.
                accepted += usize::from(with == as_written[*number]);
                if accepted > 0 {
                    break;
                }
            }
            assert!(accepted > 0, "{way}: {} = {default} is not what holds without it, in any of {places:?}", key.name);
        }
    }
}

/// Whether a text has a key, as far as its tables have names: elements of lists are not followed.
fn has(text: &str, path: &[&str]) -> bool {
    let Ok(document) = DeTable::parse(text) else { return false };
    let mut table = document.get_ref();
    for (place, name) in path.iter().enumerate() {
        match table.get(*name).map(toml::Spanned::get_ref) {
            Some(DeValue::Table(inner)) if place + 1 < path.len() => table = inner,
            found => return found.is_some() && place + 1 == path.len(),
        }
    }
    false
}

/// A document as JSON, for the validator.
fn json_of(text: &str) -> Value {
    fn table(fields: &DeTable<'_>) -> Value {
        Value::Object(fields.iter().map(|(key, field)| (key.get_ref().to_string(), value(field.get_ref()))).collect::<Map<_, _>>())
    }
    fn value(found: &DeValue<'_>) -> Value {
        match found {
            DeValue::String(text) => json!(text),
            DeValue::Integer(integer) => json!(i64::from_str_radix(integer.as_str(), integer.radix()).unwrap()),
            DeValue::Float(float) => json!(float.as_str().parse::<f64>().unwrap()),
            DeValue::Boolean(boolean) => json!(boolean),
            DeValue::Datetime(date) => json!(date.to_string()),
            DeValue::Array(elements) => elements.iter().map(|element| value(element.get_ref())).collect(),
            DeValue::Table(fields) => table(fields),
        }
    }
    table(DeTable::parse(text).unwrap().get_ref())
}

#[test]
fn the_json_schemas_are_sound_and_take_every_sample() {
    let samples = samples();
    for kind in FileSchema::ALL {
        let schema = kind.json();
        assert!(jsonschema::draft7::meta::is_valid(&schema), "{kind:?}");
        let validator = jsonschema::draft7::new(&schema).unwrap();
        for sample in samples.iter().filter(|sample| sample.kind == kind) {
            let errors: Vec<String> =
                validator.iter_errors(&json_of(&sample.text)).map(|error| format!("{}: {error}", error.instance_path())).collect();
            assert!(errors.is_empty(), "{}: {errors:#?}", sample.path.display());
        }
    }
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_json_schemas_refuse_what_the_readers_refuse_wherever_it_stands() {
    let samples = samples();
    for sample in &samples {
        let validator = jsonschema::draft7::new(&sample.kind.json()).unwrap();
        let whole = json_of(&sample.text);
        for (pointer, count) in objects(&whole) {
            let mut spoilt = whole.clone();
            let object = spoilt.pointer_mut(&pointer).and_then(Value::as_object_mut).unwrap();
            object.insert("no-such-key".to_owned(), json!({ "no-such-key": 1 }));
            assert!(!validator.is_valid(&spoilt), "{}: an unknown key in {pointer}, which has {count}", sample.path.display());
        }
    }
    let validator = jsonschema::draft7::new(&FileSchema::Scene.json()).unwrap();
    for (of, by) in [
        ("mass = 1, enclosure", "mass = -1, enclosure"),
        ("mass = 1, enclosure", "mass = \"1kg\", enclosure"),
        ("\"average-position\"", "\"average\""),
        ("duration = \"4s\"", "duration = 4"),
        ("duration = \"4s\"", "duration = \"4\""),
        ("duration = \"4s\"", "title = \"x\""),
        ("stages = 2", "stages = 2.5"),
        ("loss = \"5%\"", "loss = 1.5"),
    ] {
        let text = SCENES[0].replacen(of, by, 1);
        assert_ne!(text, SCENES[0]);
        assert!(Scene::parse(&text, Path::new("x.toml"), &[]).is_err(), "{by}");
        assert!(!validator.is_valid(&json_of(&text)), "{by}");
    }
}

/// The pointers of all objects within a document.
fn objects(value: &Value) -> Vec<(String, usize)> {
    let within = |name: String, inner: &Value| {
        objects(inner).into_iter().map(move |(pointer, count)| (format!("/{name}{pointer}"), count)).collect::<Vec<_>>()
    };
    match value {
        Value::Object(members) => {
            let inner = members.iter().flat_map(|(name, inner)| within(name.clone(), inner));
            core::iter::once((String::new(), members.len())).chain(inner).collect()
        }
        Value::Array(elements) => elements.iter().enumerate().flat_map(|(place, inner)| within(place.to_string(), inner)).collect(),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => Vec::new(),
    }
}

/// A key has a hover text that says more than its name, with its unit and default.
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

/// The pages of reference and the catalogue name the same keys.
#[test]
fn the_reference_has_the_keys_of_the_catalogue() {
    let page = |name: &str| std::fs::read_to_string(root().join("docs").join(name)).unwrap();
    let links = page("reference-link-keys.md");
    let of_links = links.split("\n## Keys of a link\n\n").nth(1).unwrap();
    let rows: Vec<&str> = of_links.lines().take_while(|line| line.starts_with("- `")).filter_map(|line| line.split('`').nth(1)).collect();
    assert_eq!(rows, cohaptic_linkfile::link::LINK_KEYS, "the list of the keys of a link");

    let listed: BTreeSet<&str> = tables().values().flat_map(|(_, table)| table.keys().map(|key| key.name)).collect();
    let pages = links + &page("reference-keys.md") + &page("reference-network-keys.md");
    let mut named = BTreeSet::new();
    for row in pages.lines().filter(|line| line.starts_with("- `")) {
        let path = row.split('`').nth(1).unwrap();
        for name in path.split('.').map(|name| name.trim_end_matches("[]")).filter(|name| !["", "…", "NAME"].contains(name)) {
            named.insert(name);
        }
    }
    // The tables at the top of a file are headings.
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
