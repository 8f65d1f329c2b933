//! Converts values between JSON, text typed by people, and TOML text.
//!
//! Typed text follows the rule of `--set KEY=VALUE`: text that is valid TOML is taken as TOML, and all other text as a string. So `40ms`, `0.01` and `{
//! packets = [3] }` can be typed without quotes.

use serde_json::Value as Json;
use toml::{Table, Value as Toml};

/// Converts a JSON value to TOML text. A string at the top level counts as typed text; strings inside lists and objects stay strings.
///
/// # Errors
///
/// The reason why TOML cannot express the value: `null`, or an integer beyond a signed 64-bit integer.
pub(crate) fn from_json(value: &Json) -> Result<String, String> {
    match value {
        Json::String(text) => Ok(typed(text).to_string()),
        Json::Null | Json::Bool(_) | Json::Number(_) | Json::Array(_) | Json::Object(_) => Ok(converted(value)?.to_string()),
    }
}

/// Converts TOML text to the text that a person would type, without quotes where none are needed. [`from_json`] converts the result back.
pub(crate) fn shown(toml: &str) -> String {
    match parse(toml) {
        // Quotes stay around a string that would otherwise parse as another value, such as "1".
        Some(Toml::String(text)) if parse(&text).is_none() => text,
        Some(_) | None => toml.to_owned(),
    }
}

fn typed(text: &str) -> Toml {
    parse(text).unwrap_or_else(|| Toml::String(text.to_owned()))
}

/// Parses a text as a single TOML value; `None` if the text is anything else.
fn parse(text: &str) -> Option<Toml> {
    let mut table: Table = toml::from_str(&format!("value = {text}")).ok()?;
    let value = table.remove("value")?;
    // A text with a line break could define further keys, and is then no single value.
    table.is_empty().then_some(value)
}

fn converted(value: &Json) -> Result<Toml, String> {
    Ok(match value {
        Json::Null => {
            return Err(
                "null is not a value; the table of link keys names the value that switches a key off, such as \"0s\" or \"unlimited\"".to_owned()
            );
        }
        Json::Bool(value) => Toml::Boolean(*value),
        Json::Number(number) => match (number.as_i64(), number.as_f64()) {
            (Some(integer), _) => Toml::Integer(integer),
            // `as_f64` accepts integers above `i64::MAX` too, and would lose their last digits.
            (None, Some(float)) if !number.is_u64() => Toml::Float(float),
            (None, Some(_) | None) => return Err(format!("{number} is too large")),
        },
        Json::String(text) => Toml::String(text.clone()),
        Json::Array(values) => Toml::Array(values.iter().map(converted).collect::<Result<_, _>>()?),
        Json::Object(entries) => Toml::Table(entries.iter().map(|(key, value)| Ok((key.clone(), converted(value)?))).collect::<Result<_, String>>()?),
    })
}

#[cfg(test)]
mod tests {
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;
    use serde_json::json;

    use super::{Json, from_json, parse, shown};

    #[test]
    fn what_people_type_becomes_toml() {
        for (typed, toml) in [
            (json!("40ms"), "\"40ms\""),
            (json!("1%"), "\"1%\""),
            (json!("0.01"), "0.01"),
            (json!("none"), "\"none\""),
            (json!(""), "\"\""),
            (json!("true"), "true"),
            (json!("\"10 Mbit/s\""), "\"10 Mbit/s\""),
            (json!("{ packets = [3, \"10-19\"], every = 100 }"), "{ every = 100, packets = [3, \"10-19\"] }"),
            (json!(0), "0"),
            (json!(-3), "-3"),
            (json!(0.25), "0.25"),
            (json!(1e-6), "0.000001"),
            (json!(false), "false"),
            (json!([]), "[]"),
            (json!({ "limit": "30 kB", "red": { "min": 5 } }), "{ limit = \"30 kB\", red = { min = 5 } }"),
            // Within a table a string stays one.
            (json!({ "a": "1" }), "{ a = \"1\" }"),
            // A second line is no way to set a second key.
            (json!("1\nother = 2"), "\"\"\"\n1\nother = 2\"\"\""),
        ] {
            assert_eq!(from_json(&typed).unwrap(), toml, "{typed}");
        }
    }

    #[test]
    fn what_toml_cannot_say_is_refused() {
        assert!(from_json(&Json::Null).unwrap_err().contains("null"));
        assert!(from_json(&json!([1, null])).unwrap_err().contains("null"));
        assert!(from_json(&json!(u64::MAX)).unwrap_err().contains("too large"));
    }

    #[test]
    fn values_are_shown_as_they_are_typed() {
        assert_eq!(shown("\"40ms\""), "40ms");
        assert_eq!(shown("0.01"), "0.01");
        assert_eq!(shown("\"0.01\""), "\"0.01\"", "text, and stays text");
        assert_eq!(shown("{ packets = [3] }"), "{ packets = [3] }");
        assert_eq!(shown("no toml"), "no toml");
    }

    fn values() -> impl Strategy<Value = Json> {
        let leaf = prop_oneof![
            any::<bool>().prop_map(Json::from),
            any::<i64>().prop_map(Json::from),
            any::<f64>().prop_map(Json::from),
            any::<String>().prop_map(Json::from)
        ]
        .prop_filter("null, which NaN becomes, is no TOML", |value| !value.is_null());
        leaf.prop_recursive(4, 32, 5, |inner| {
            prop_oneof![
                prop::collection::vec(inner.clone(), 0..5).prop_map(Json::from),
                prop::collection::btree_map(any::<String>(), inner, 0..5).prop_map(|map| map.into_iter().collect())
            ]
        })
    }

    properties! {
        #[test]
        fn any_value_is_toml_and_reads_back_from_what_is_shown(value in values()) {
            let toml = from_json(&value).unwrap();
            prop_assert!(parse(&toml).is_some(), "{toml}");
            prop_assert_eq!(from_json(&Json::String(shown(&toml))).unwrap(), toml);
        }

        #[test]
        fn anything_typed_is_a_value(text in any::<String>()) {
            prop_assert!(parse(&from_json(&Json::String(text)).unwrap()).is_some());
        }
    }
}
