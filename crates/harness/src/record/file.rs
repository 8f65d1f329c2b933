//! The files of records, and the failure to write one.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use cohaptic_files::{WholeFile, partial_name};

/// Why a record could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}", path.display())]
pub struct RecordError {
    /// The file or folder.
    pub path: PathBuf,
    /// What the system says.
    pub source: io::Error,
}

/// Beside an observer that never fails.
impl From<std::convert::Infallible> for RecordError {
    fn from(never: std::convert::Infallible) -> Self {
        match never {}
    }
}

/// A record on its way: a [`WholeFile`] whose errors are those of a record. If it cannot be written to its end, its beginning stays under the name `….partial`.
#[derive(Debug)]
pub struct RecordFile(WholeFile);

impl RecordFile {
    /// Begins a file of that name.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if it cannot be made.
    pub fn create(path: PathBuf) -> Result<Self, RecordError> {
        let partial = partial_name(&path);
        WholeFile::create(path).map(Self).map_err(|source| RecordError { path: partial.into(), source })
    }

    /// Adds to it.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if that cannot be written.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), RecordError> {
        self.0.write_all(bytes).map_err(|source| RecordError { path: partial_name(self.0.path()).into(), source })
    }

    /// Writes the rest and gives the file its name.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if that cannot be done.
    pub fn finish(self) -> Result<PathBuf, RecordError> {
        let path = self.0.path().to_path_buf();
        self.0.finish().map_err(|source| RecordError { path: partial_name(&path).into(), source })?;
        Ok(path)
    }
}

/// Makes the folder for records.
pub(crate) fn create_folder(path: &Path) -> Result<(), RecordError> {
    fs::create_dir_all(path).map_err(|source| RecordError { path: path.to_path_buf(), source })
}

/// Adds a number with the fewest digits that read back as the same `f64`; `inf`, `-inf` and `NaN` for values that are not finite.
pub(crate) fn push_f64(line: &mut Vec<u8>, value: f64) {
    line.extend_from_slice(ryu::Buffer::new().format(value).as_bytes());
}

/// Adds something that prints itself.
pub(crate) fn push_display(line: &mut Vec<u8>, value: impl std::fmt::Display) {
    write!(line, "{value}").expect("writing to memory does not fail");
}
