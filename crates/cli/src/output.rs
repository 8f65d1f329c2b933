//! Standard output: text for people or one JSON document.

use std::io::{self, Write as _};
use std::path::Path;

use cohaptic_units::visible_lines;
use serde::Serialize;

use crate::failure::Failure;

/// Prints text, which ends with a line break. Titles and names of files may hold control characters, which are escaped before they disturb a
/// terminal.
pub(crate) fn text(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    let text = visible_lines(text);
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(Failure::StandardOutput)
}

/// Prints one JSON document. Numbers that are not finite become `null`.
pub(crate) fn json(document: &impl Serialize) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    serde_json::to_writer_pretty(&mut out, document).map_err(io::Error::from).map_err(Failure::StandardOutput)?;
    out.write_all(b"\n").and_then(|()| out.flush()).map_err(Failure::StandardOutput)
}

/// A path as text. What is not Unicode in it is replaced: JSON cannot hold it.
pub(crate) fn path(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}
