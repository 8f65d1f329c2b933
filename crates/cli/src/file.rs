//! Reads text files of users, and writes files and folders. Errors become failures with the name of the file.

use std::io::{self, Read, Write as _};
use std::path::Path;

use cohaptic_files::{LimitedFile, MOST_CAPTURE_BYTES, OwnFolder, write_whole};
use cohaptic_measure::fates::{self, ReadError};
use cohaptic_wan::FateLog;

use crate::failure::Failure;
use crate::{interrupt, output};

/// Reads the text of a file.
///
/// # Errors
///
/// [`Failure::File`] if the file cannot be read, [`Failure::Input`] with the number of the line if the bytes are not UTF-8.
pub(crate) fn read_text(path: &Path) -> Result<String, Failure> {
    let bytes = cohaptic_files::read_bytes(path).map_err(|error| Failure::File { verb: "read", path: path.to_path_buf(), error })?;
    text_of(bytes, path)
}

/// Converts the bytes of the file `path` to text, with the same error for bytes that are not UTF-8 as [`read_text`].
pub(crate) fn text_of(bytes: Vec<u8>, path: &Path) -> Result<String, Failure> {
    String::from_utf8(bytes).map_err(|error| {
        // Lines are counted in the valid text before the first wrong byte.
        let right = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        not_text(path, right.iter().filter(|byte| **byte == b'\n').count() as u64 + 1)
    })
}

/// Returns the failure for a line that is not UTF-8. Lines count from 1.
pub(crate) fn not_text(path: &Path, line: u64) -> Failure {
    Failure::Input(format!("{}:{line}: not UTF-8: expected a text file", output::path(path)))
}

/// Reads a log of fates from `from`, a file that [`open_large`] has opened.
pub(crate) fn read_fates(path: &Path, from: impl Read) -> Result<FateLog, Failure> {
    fates::read(from).map_err(|error| match error {
        ReadError::Io(error) => Failure::File { verb: "read", path: path.to_path_buf(), error },
        ReadError::NotText { line } => not_text(path, line),
        other @ (ReadError::Log(_) | _) => Failure::Input(format!("{}: {other}", output::path(path))),
    })
}

/// Opens a large file for reading piece by piece.
pub(crate) fn open_large(path: &Path) -> Result<LimitedFile, Failure> {
    LimitedFile::open(path, MOST_CAPTURE_BYTES).map_err(|error| Failure::File { verb: "read", path: path.to_path_buf(), error })
}

/// Writes a whole file. If the write fails, for example on a full disk, no part of the file is left: unlike a record, the file can be made again.
pub(crate) fn write_file(path: &Path, content: impl AsRef<[u8]>) -> Result<(), Failure> {
    // From here on only a second signal ends the program, so that the first signal leaves no half of the file.
    interrupt::has_results();
    write_whole(path, |file| file.write_all(content.as_ref())).map_err(unwritten(path))
}

/// Writes a whole file into a folder, and returns the path of the file.
pub(crate) fn write_into(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> Result<String, Failure> {
    let path = folder.join(name);
    write_file(&path, content)?;
    Ok(output::path(&path))
}

/// Takes the folder of `--out` for this process alone, as long as the returned value lives, and creates the folder if it does not exist. Called before the
/// work, so that a refused folder does not cost the work.
pub(crate) fn own_folder(path: &Path) -> Result<OwnFolder, Failure> {
    OwnFolder::take(path).map_err(unwritten(path))
}

/// Returns a function from the error of writing `path` to a failure.
pub(crate) fn unwritten(path: &Path) -> impl Fn(io::Error) -> Failure {
    |error| Failure::File { verb: "write", path: path.to_path_buf(), error }
}
