//! Files that are written, and the failure to write one.

use std::io::{self, Write as _};
use std::path::Path;

use cohaptic_files::write_whole;

use crate::failure::Failure;

/// Writes a whole file. If it cannot be written, on a disk that is full for instance, nothing of it is left: unlike a record, it can be made again.
pub(crate) fn write_file(path: &Path, content: impl AsRef<[u8]>) -> Result<(), Failure> {
    write_whole(path, |file| file.write_all(content.as_ref())).map_err(unwritten(path))
}

/// That a file cannot be written.
pub(crate) fn unwritten(path: &Path) -> impl Fn(io::Error) -> Failure {
    |error| Failure::File { verb: "write", path: path.to_path_buf(), error }
}
