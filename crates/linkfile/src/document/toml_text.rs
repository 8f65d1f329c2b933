//! Values of the document as TOML text on one line.

use core::fmt::Write;

use super::tree::{Node, Value};

/// Writes a value as TOML on one line. Parsing the text gives the same value.
#[must_use]
pub fn value_text(node: &Node) -> String {
    let mut text = String::new();
    write_value(node, &mut text);
    text
}

/// Writes a key: bare if TOML allows a bare key, else quoted.
#[must_use]
pub fn key_text(key: &str) -> String {
    let is_bare = !key.is_empty() && key.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_'));
    if is_bare { key.to_owned() } else { quoted(key) }
}

fn write_value(node: &Node, text: &mut String) {
    match &node.value {
        Value::Text(value) => text.push_str(&quoted(value)),
        Value::Integer(Some(integer)) => text.push_str(&integer.to_string()),
        Value::Float(float) => text.push_str(float),
        Value::Boolean(boolean) => text.push_str(if *boolean { "true" } else { "false" }),
        // Every reader refuses such a value, so no accepted document contains one. The text "?" would be refused in the same places.
        Value::Integer(None) | Value::Date => text.push_str("\"?\""),
        Value::List(elements) => {
            text.push('[');
            for (place, element) in elements.iter().enumerate() {
                text.push_str(if place == 0 { "" } else { ", " });
                write_value(element, text);
            }
            text.push(']');
        }
        Value::Table(table) => {
            text.push('{');
            for (place, entry) in table.0.iter().enumerate() {
                text.push_str(if place == 0 { " " } else { ", " });
                text.push_str(&key_text(&entry.name));
                text.push_str(" = ");
                write_value(&entry.node, text);
            }
            text.push_str(if table.0.is_empty() { "}" } else { " }" });
        }
    }
}

/// Writes a text as a basic string of TOML, with control characters escaped.
fn quoted(value: &str) -> String {
    let mut text = String::from("\"");
    for c in value.chars() {
        match c {
            '"' => text.push_str("\\\""),
            '\\' => text.push_str("\\\\"),
            c if c.is_control() => write!(text, "\\u{:04X}", u32::from(c)).expect("writing to memory does not fail"),
            c => text.push(c),
        }
    }
    text.push('"');
    text
}
