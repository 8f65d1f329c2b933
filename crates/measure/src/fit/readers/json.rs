//! Files in JSON: finds the program by the keys, and converts errors of the parser.

use std::collections::BTreeMap;
use std::fmt::Display;

use serde::de::{DeserializeOwned, IgnoredAny};

use super::{Content, Direction, ReaderError, iperf3, irtt, netem_trace};

const EXPECTED: &str = "the JSON of irtt (key round_trips), of iperf3 (key intervals) or of netem-trace (one key, such as RepeatedBwPatternConfig)";

/// Reads JSON of one of the programs.
pub(super) fn read(text: &str, direction: Option<Direction>) -> Result<Content, ReaderError> {
    // netem-trace writes the list of a `TraceBwConfig` without its name if the program knows the type.
    if text.trim_start().starts_with('[') {
        return netem_trace::read_list(text).map(Content::Link);
    }
    let keys: BTreeMap<String, IgnoredAny> = parse(text)?;
    if keys.contains_key("round_trips") {
        irtt::read(text, direction).map(Content::Delays)
    } else if keys.contains_key("intervals") {
        iperf3::read(text).map(Content::Link)
    } else if let [name] = keys.keys().collect::<Vec<_>>()[..]
        && name.ends_with("Config")
    {
        netem_trace::read(text).map(Content::Link)
    } else {
        let names: Vec<&str> = keys.keys().map(String::as_str).collect();
        Err(ReaderError::found("line 1", format!("the keys {}", names.join(", ")), EXPECTED))
    }
}

/// Parses JSON of a type.
///
/// # Errors
///
/// [`ReaderError`] with line and column.
pub(super) fn parse<T: DeserializeOwned>(text: &str) -> Result<T, ReaderError> {
    serde_json::from_str(text).map_err(|error| {
        let place = format!("line {}, column {}", error.line(), error.column());
        // The parser repeats the place at the end of its text.
        let text = error.to_string();
        ReaderError::new(place, text.split(" at line ").next().unwrap_or(&text))
    })
}

/// Returns the value of a key, or the error that the key at `path` is missing.
pub(super) fn needed<T>(value: Option<T>, path: impl Display, expected: &str) -> Result<T, ReaderError> {
    value.ok_or_else(|| ReaderError::found(path, "nothing", expected))
}
