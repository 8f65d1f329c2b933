//! A file that is written: under another name until it is whole.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use crate::failure::Failure;

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
