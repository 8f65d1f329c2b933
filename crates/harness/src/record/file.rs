//! A file that has its name only when it is whole.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Why a record could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}", path.display())]
#[non_exhaustive]
pub struct RecordError {
    /// The file or folder.
    pub path: PathBuf,
    /// What the system says.
    pub source: io::Error,
}

/// A file being written under the name `….partial`.
#[derive(Debug)]
pub struct PartialFile {
    path: PathBuf,
    partial: PathBuf,
    writer: BufWriter<File>,
}

impl PartialFile {
    /// Begins a file of that name.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if it cannot be made.
    pub fn create(path: PathBuf) -> Result<Self, RecordError> {
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push(".partial");
        let partial = path.with_file_name(name);
        let file = File::create(&partial).map_err(|source| RecordError { path: partial.clone(), source })?;
        Ok(Self { path, partial, writer: BufWriter::with_capacity(1 << 16, file) })
    }

    /// Adds to it.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if that cannot be written.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), RecordError> {
        self.writer.write_all(bytes).map_err(|source| RecordError { path: self.partial.clone(), source })
    }

    /// Writes what is left and gives the file its name.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if that cannot be done.
    pub fn finish(self) -> Result<PathBuf, RecordError> {
        let Self { path, partial, mut writer } = self;
        writer.flush().and_then(|()| fs::rename(&partial, &path)).map_err(|source| RecordError { path: partial, source })?;
        Ok(path)
    }
}

/// Makes the folder for records.
pub(crate) fn create_folder(path: &Path) -> Result<(), RecordError> {
    fs::create_dir_all(path).map_err(|source| RecordError { path: path.to_path_buf(), source })
}

/// Adds a number with the fewest digits that read back as the same `f64`; `inf`, `-inf` and `NaN` for what is no number.
pub(crate) fn push_f64(line: &mut Vec<u8>, value: f64) {
    line.extend_from_slice(ryu::Buffer::new().format(value).as_bytes());
}

/// Adds something that prints itself.
pub(crate) fn push_display(line: &mut Vec<u8>, value: impl std::fmt::Display) {
    write!(line, "{value}").expect("writing to memory does not fail");
}
