//! Text files of users.

use std::path::Path;

use crate::failure::Failure;
use crate::output;

/// The text of a file; bytes that are no text are refused at their line.
pub(crate) fn read(path: &Path) -> Result<String, Failure> {
    let bytes = cohaptic_files::read_bytes(path).map_err(|error| Failure::File { verb: "read", path: path.to_path_buf(), error })?;
    of_bytes(bytes, path)
}

/// The bytes of a file as text.
pub(crate) fn of_bytes(bytes: Vec<u8>, path: &Path) -> Result<String, Failure> {
    String::from_utf8(bytes).map_err(|error| {
        let right = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = right.iter().filter(|byte| **byte == b'\n').count() + 1;
        Failure::Input(format!("{}:{line}: not UTF-8: expected a text file", output::path(path)))
    })
}
