//! Files that have their name only when they are whole and with the disk.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// The end of the name of a file that is being written.
pub const PARTIAL: &str = ".partial";

/// The name under which a file is written: its own with [`PARTIAL`] behind it.
#[must_use]
pub fn partial_name(path: &Path) -> OsString {
    let mut name = path.as_os_str().to_owned();
    name.push(PARTIAL);
    name
}

/// A file being written under another name ([`partial_name`]), in the same folder. It takes its own name in [`finish`](Self::finish); a file that was there
/// until then is replaced. Dropped before that, its beginning stays under the other name.
#[derive(Debug)]
pub struct WholeFile {
    path: PathBuf,
    writer: BufWriter<File>,
}

impl WholeFile {
    /// Begins a file of that name.
    ///
    /// # Errors
    ///
    /// What the system says of the file beside it.
    pub fn create(path: impl Into<PathBuf>) -> io::Result<Self> {
        let path = path.into();
        let file = File::create(partial_name(&path))?;
        Ok(Self { path, writer: BufWriter::with_capacity(1 << 16, file) })
    }

    /// The name that it will have.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the rest, waits until all is with the disk, and gives the file its name.
    ///
    /// # Errors
    ///
    /// What the system says. The file stays under the other name.
    pub fn finish(mut self) -> io::Result<()> {
        self.writer.flush()?;
        self.writer.get_ref().sync_all()?;
        fs::rename(partial_name(&self.path), &self.path)?;
        // The name too is to outlast a loss of power. Not every file system can do that for folders; then the name of before may come back, and no more.
        if let Some(folder) = self.path.parent() {
            let _ = File::open(folder).and_then(|folder| folder.sync_all());
        }
        Ok(())
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// Writes a [`WholeFile`]. If anything fails, nothing of it is left, and the file that had the name before is as it was.
///
/// # Errors
///
/// Those of `write`, and of the system.
pub fn write_whole<E: From<io::Error>>(path: &Path, write: impl FnOnce(&mut WholeFile) -> Result<(), E>) -> Result<(), E> {
    let mut file = WholeFile::create(path)?;
    let written = write(&mut file).and_then(|()| Ok(file.finish()?));
    if written.is_err() {
        // That it could not be written is the error to report, not that its beginning is still there.
        let _ = fs::remove_file(partial_name(path));
    }
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_leaves_nothing_new_and_the_file_of_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part-00000.csv");
        let fails = |file: &mut WholeFile| -> io::Result<()> {
            file.write_all(b"half")?;
            Err(io::ErrorKind::StorageFull.into())
        };
        assert_eq!(write_whole(&path, fails).unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        write_whole(&path, |file| file.write_all(b"whole")).unwrap();
        assert!(write_whole(&path, fails).is_err());
        assert_eq!((fs::read(&path).unwrap(), fs::read_dir(folder.path()).unwrap().count()), (b"whole".to_vec(), 1));
    }

    #[test]
    fn a_file_that_is_not_finished_has_not_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trajectory.csv");
        let mut file = WholeFile::create(&path).unwrap();
        file.write_all(b"t,peer\n").unwrap();
        drop(file);
        assert!(!path.exists());
        assert_eq!(fs::read(partial_name(&path)).unwrap(), b"t,peer\n");
    }
}
