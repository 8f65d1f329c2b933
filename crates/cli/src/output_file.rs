//! A file that is written: under another name until it is whole.

use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

use crate::failure::Failure;

/// Writes a whole file, which has its name only then. If it cannot be written, on a disk that is full for instance, nothing of it is left.
pub(crate) fn write_file(path: &Path, content: impl AsRef<[u8]>) -> Result<(), Failure> {
    let (file, mut to) = OutputFile::create(path)?;
    let written = to.write_all(content.as_ref()).and_then(|()| to.flush());
    if written.is_err() {
        // What it holds can be made again, unlike a record. That it could not be written is the error to report, not that it is still there.
        let _ = std::fs::remove_file(&file.partial);
    }
    file.finish(written.map(|()| to))
}

/// A field of a CSV file, quoted where it must be (RFC 4180).
pub(crate) fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// A file on its way.
#[derive(Debug)]
pub(crate) struct OutputFile {
    path: PathBuf,
    partial: PathBuf,
}

impl OutputFile {
    /// Begins `PATH.partial`.
    pub(crate) fn create(path: &Path) -> Result<(Self, BufWriter<File>), Failure> {
        let mut partial = path.as_os_str().to_owned();
        partial.push(".partial");
        let file = Self { path: path.to_path_buf(), partial: partial.into() };
        let to = File::create(&file.partial).map_err(|error| file.failure(error))?;
        Ok((file, BufWriter::new(to)))
    }

    /// Gives the whole file its name.
    pub(crate) fn finish(self, written: io::Result<BufWriter<File>>) -> Result<(), Failure> {
        let named = written.map(drop).and_then(|()| std::fs::rename(&self.partial, &self.path));
        named.map_err(|error| self.failure(error))
    }

    /// What went wrong with it.
    pub(crate) fn failure(&self, error: io::Error) -> Failure {
        Failure::File { verb: "write", path: self.path.clone(), error }
    }
}
