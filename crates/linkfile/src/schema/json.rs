//! Catalogue of keys as a JSON Schema.
//!
//! The schema follows draft 7, the newest draft with the support of all editors for TOML. No part refers to another part: Taplo (Even Better TOML) shows no
//! description beside a `$ref` and stops at an `allOf`, and Tombi does not follow every `$ref`.

use serde_json::{Map, Value, json};

use cohaptic_wan::parameters::{Form, Key, Need, Quantity, Table, Words};

/// Pattern of a quantity: a number, optional space, and the letters of a unit. The units themselves are left to the readers, whose messages name the units.
const WITH_UNIT: &str = r"^\s*[0-9.]+\s*[A-Za-zµμ]+\s*$";

/// Returns the JSON Schema (draft 7) of a kind of file, made from the table at the top of the file and a title.
#[must_use]
pub fn json_schema(root: &Table, title: &str) -> Value {
    let mut schema = table(root);
    if let Some(members) = schema.as_object_mut() {
        members.insert("$schema".to_owned(), json!("http://json-schema.org/draft-07/schema#"));
        members.insert("title".to_owned(), json!(title));
    }
    schema
}

/// Returns the schema of a table: an object with one property per key.
fn table(table: &Table) -> Value {
    let properties: Map<String, Value> = table.keys().map(|key| (key.name.to_owned(), property(key, table.is_laid_over))).collect();
    let required: Vec<&str> = table.keys().filter(|key| key.need == Need::Required).map(|key| key.name).collect();
    let mut schema = json!({ "type": "object", "properties": properties, "additionalProperties": table.others.map_or(json!(false), form) });
    // Draft 4 forbids an empty list of required keys, and an editor may read the schema as draft 4.
    if let (Some(members), false) = (schema.as_object_mut(), required.is_empty()) {
        members.insert("required".to_owned(), json!(required));
    }
    schema
}

/// Returns the schema of a key, described by meaning, unit, and default. `is_laid_over`: whether the table is laid over another table, so that a missing key
/// has the value of the other table.
fn property(key: &Key, is_laid_over: bool) -> Value {
    let mut schema = form(&key.form);
    let mut about = key.about.to_owned();
    if !key.form.unit().is_empty() {
        about = format!("{about} [{}]", key.form.unit());
    }
    about.push('.');
    match key.need {
        Need::Required => about.push_str(" Must be given."),
        Need::RequiredSomewhere => about.push_str(" Must be given, here or in the table that holds for all."),
        Need::Default(default) if is_laid_over => {
            about.push_str(&format!(" Default: as in what this is laid over; if that says nothing, {default}."))
        }
        Need::Default(default) => about.push_str(&format!(" Default: {default}.")),
        Need::Optional => {}
    }
    if let Some(members) = schema.as_object_mut() {
        members.insert("description".to_owned(), json!(about));
        // A table laid over another table has no default: a missing key keeps the value of the other table. Numbers, booleans and texts in quotes read the same
        // in TOML and in JSON; any other default stays in the description only.
        if let Need::Default(default) = key.need
            && !is_laid_over
            && let Ok(default) = serde_json::from_str::<Value>(default)
        {
            members.insert("default".to_owned(), default);
        }
    }
    schema
}

/// Returns the schema of the values of a form.
fn form(form_of: &Form) -> Value {
    match form_of {
        Form::Text | Form::File => json!({ "type": "string" }),
        Form::Boolean => json!({ "type": "boolean" }),
        Form::Integer(least, most) => json!({ "type": "integer", "minimum": least, "maximum": most }),
        Form::Number(amount) => number(*amount),
        Form::Vector(amount) => {
            json!({ "anyOf": [number(*amount), { "type": "array", "items": number(*amount), "minItems": 1, "maxItems": 3 }] })
        }
        Form::Triple(amount) => json!({ "type": "array", "items": number(*amount), "minItems": 3, "maxItems": 3 }),
        Form::Duration | Form::PositiveDuration => with_unit(&["8ms", "1.5s", "250us"]),
        Form::Rate => with_unit(&["10Mbit", "64kbit"]),
        Form::Size => with_unit(&["1500B", "64kB"]),
        // A number is from 0 to 1, and a percentage is a text.
        Form::Probability => json!({ "anyOf": [
            { "type": "number", "minimum": 0, "maximum": 1 },
            { "type": "string", "pattern": r"^\s*[0-9.]+\s*%\s*$", "examples": ["1%", "1.5%"] },
        ] }),
        Form::Like(examples) => json!({ "type": "string", "examples": examples }),
        Form::Words(choices) => words(choices),
        Form::Table(fields) => table(fields),
        Form::List(element) => json!({ "type": "array", "items": form(element) }),
        Form::Pair(element) => json!({ "type": "array", "items": form(element), "minItems": 2, "maxItems": 2 }),
        Form::AnyOf(forms) => json!({ "anyOf": forms.iter().map(form).collect::<Vec<_>>() }),
    }
}

/// Returns the schema of a number with its bounds.
fn number(amount: Quantity) -> Value {
    let mut schema = json!({ "type": "number" });
    if let Some(members) = schema.as_object_mut() {
        members.extend(amount.bounds().iter().map(|(keyword, bound)| ((*keyword).to_owned(), json!(bound))));
    }
    schema
}

/// Returns the schema of a text of a number and a unit.
fn with_unit(examples: &[&str]) -> Value {
    json!({ "type": "string", "pattern": WITH_UNIT, "examples": examples })
}

/// Returns the schema of a choice of words. Taplo reads the meanings of the words under `x-taplo`.
fn words(choices: Words) -> Value {
    let (names, meanings): (Vec<&str>, Vec<&str>) = choices.iter().copied().unzip();
    json!({ "type": "string", "enum": names, "x-taplo": { "docs": { "enumValues": meanings } } })
}
