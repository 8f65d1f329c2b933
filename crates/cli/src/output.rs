//! Standard output: text for people or one JSON document.

use std::io::{self, Write as _};
use std::path::Path;

use serde::Serialize;

use crate::failure::Failure;

/// Prints text, which ends with a line break. Titles and names of files may hold control characters, which are escaped before they disturb a
/// terminal.
pub(crate) fn text(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    let text = escape(text);
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(Failure::StandardOutput)
}

/// Prints one JSON document. Numbers that are not finite become `null`.
pub(crate) fn json(document: &impl Serialize) -> Result<(), Failure> {
    // At once: standard output is written line by line otherwise, and who has asked for the end waits for no million lines.
    let mut text = serde_json::to_vec_pretty(document).map_err(io::Error::from).map_err(Failure::StandardOutput)?;
    text.push(b'\n');
    let mut out = io::stdout().lock();
    out.write_all(&text).and_then(|()| out.flush()).map_err(Failure::StandardOutput)
}

/// A path as text. What is not Unicode in it is replaced: JSON cannot hold it.
pub(crate) fn path(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        if letter.is_control() && letter != '\n' {
            escaped.extend(letter.escape_default());
        } else {
            escaped.push(letter);
        }
    }
    escaped
}
