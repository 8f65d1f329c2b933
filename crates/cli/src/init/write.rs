//! Writes a scene as TOML text with a comment for every key. Keys without a value in the scene follow a `#`, as proposals.
//!
//! Meanings, units and defaults come from the schema of scene files, so that no text about a key stands twice in the program.

use std::fmt::Write as _;

use cohaptic_linkfile::schema::{Form, Key, Need, Table};
use cohaptic_scene::schema::FileSchema;
use toml::Value;

/// Column in which the comment of a line begins, unless key and value need more columns.
const COLUMN: usize = 30;

/// Proposed values of keys without a useful default in the schema.
const EXAMPLES: [(&str, &str); 6] = [
    ("enclosure", "{ min = -0.1, max = 0.1, stiffness = 1000.0, damping = 5.0 }"),
    ("clock", "{ offset = \"300us\", drift = \"20ppm\" }"),
    ("uplink", "{ rate = \"10Mbit\" }"),
    ("downlink", "{ rate = \"10Mbit\" }"),
    ("jitter", "\"2ms\""),
    ("queue", "{ limit = \"100 packets\" }"),
];

/// Keys without a proposal: each key has a meaning only together with other keys, some only with an inertia of the object.
const NOT_PROPOSED: [&str; 8] = ["count", "substeps", "netem-profile", "name", "orientation", "angular-velocity", "grasp", "rotation-steps"];

/// Returns `scene` as commented text. `other_number` is the number of peers of the shipped scene `name`, if `scene` has a different number.
pub(super) fn scene(scene: &toml::Table, name: &str, other_number: Option<usize>) -> String {
    let mut text = format!(
        "# A scene to begin with, written by cohaptic init --from {name}.\n\
         # Keys after a # have no effect. They are proposals, most of them with the default value.\n\
         # All keys: docs/reference-keys.md. To run it: cohaptic run FILE. To vary it: --set link.delay=40ms.\n\
         # An editor for TOML explains and completes keys with the file that cohaptic schema prints.\n"
    );
    for key in FileSchema::Scene.root().keys() {
        part(&mut text, key, scene.get(key.name));
    }
    // Writing to a string does not fail.
    let _ = match other_number {
        Some(number) => writeln!(text, "\n# The expectations of scenarios/{name}.toml hold for its {number} peers, and are left out here."),
        None => writeln!(text, "\n# scenarios/{name}.toml says where the numbers of this scene come from."),
    };
    text
}

/// Appends one top-level key of the scene: a table, or every entry of a list of tables. A key of another form appends nothing.
fn part(text: &mut String, key: &Key, value: Option<&Value>) {
    // These tables hold the keys that users change first, and are written even if the scene lacks the table.
    let is_proposed = matches!(key.name, "simulation" | "peer" | "link");
    if let Form::Table(table) = &key.form
        && (value.is_some() || is_proposed)
    {
        let _ = writeln!(text, "\n# {}.\n[{}]", key.about, key.name);
        let nothing = toml::Table::new();
        // Expectations follow from the other keys, so that none is proposed.
        fields(text, table, value.and_then(Value::as_table).unwrap_or(&nothing), key.name != "expect");
    }
    if let (Form::List(Form::Table(table)), Some(entries)) = (&key.form, value.and_then(Value::as_array)) {
        for (number, entry) in entries.iter().enumerate() {
            // The meaning of the list stands only above the first entry.
            let about = if number == 0 { format!("# {}.\n", key.about) } else { String::new() };
            let _ = writeln!(text, "\n{about}[[{}]]", key.name);
            if let Some(entry) = entry.as_table() {
                fields(text, table, entry, false);
            }
        }
    }
}

/// Appends the keys of `table` with a value in `values` and, if `propose`, the remaining keys as proposals. The order is the order of the schema.
fn fields(text: &mut String, table: &Table, values: &toml::Table, propose: bool) {
    for key in table.keys() {
        match values.get(key.name) {
            Some(value) => field(text, key, value),
            None if propose => proposal(text, key),
            None => {}
        }
    }
}

/// Appends a key of the scene. Comments on an inline table or on a list of tables stand above the key, because the line itself is long.
fn field(text: &mut String, key: &Key, value: &Value) {
    if let Some(within) = value.as_table() {
        let _ = writeln!(text, "# {}: {}", key.name, about(key));
        explain(text, key.name, &key.form, within);
        let _ = writeln!(text, "{} = {value}", key.name);
    } else if let Some(list) = value.as_array().filter(|list| list.iter().any(Value::is_table)) {
        let _ = writeln!(text, "# {}: {}", key.name, about(key));
        let _ = writeln!(text, "{} = [", key.name);
        for element in list {
            let _ = writeln!(text, "    {element},");
        }
        text.push_str("]\n");
    } else {
        line(text, &format!("{} = {value}", key.name), &about(key));
    }
}

/// Appends a key as a proposal after a `#`. A key with neither an example nor a default is left out.
fn proposal(text: &mut String, key: &Key) {
    let example = EXAMPLES.iter().find(|(name, _)| *name == key.name).map(|(_, example)| *example);
    let value = match (example, key.need) {
        (Some(example), _) => example,
        (None, Need::Default(default)) => default,
        (None, Need::Required | Need::RequiredSomewhere | Need::Optional) => return,
    };
    if !NOT_PROPOSED.contains(&key.name) {
        line(text, &format!("# {} = {value}", key.name), &about(key));
    }
}

/// Appends `said` with `about` as the comment on the same line.
fn line(text: &mut String, said: &str, about: &str) {
    let _ = writeln!(text, "{said:<COLUMN$}  # {about}");
}

/// Appends one comment line per key of an inline table, nested tables included. `path` names the table, with a dot between keys.
fn explain(text: &mut String, path: &str, form: &Form, values: &toml::Table) {
    let Some(table) = form.table() else { return };
    for key in table.keys() {
        let Some(value) = values.get(key.name) else { continue };
        let path = format!("{path}.{}", key.name);
        let _ = writeln!(text, "#   {path}: {}", about(key));
        if let Some(within) = value.as_table() {
            explain(text, &path, &key.form, within);
        }
    }
}

/// Returns the meaning of a key, with the unit in brackets if the key has a unit.
fn about(key: &Key) -> String {
    let unit = key.form.unit();
    if unit.is_empty() { key.about.to_owned() } else { format!("{} [{unit}]", key.about) }
}
