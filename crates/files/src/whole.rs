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
    partial: PathBuf,
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
        let partial = partial_name(&path).into();
        Self::create_under(path, partial)
    }

    /// Begins a file of that name, which other processes may be writing too: the other name has that of this worker in it.
    ///
    /// # Errors
    ///
    /// As [`WholeFile::create`].
    pub fn create_by(path: impl Into<PathBuf>, worker: &str) -> io::Result<Self> {
        let path = path.into();
        let mut partial = path.as_os_str().to_owned();
        partial.push(format!(".{worker}{PARTIAL}"));
        Self::create_under(path, partial.into())
    }

    fn create_under(path: PathBuf, partial: PathBuf) -> io::Result<Self> {
        let file = File::create(&partial)?;
        Ok(Self { path, partial, writer: BufWriter::with_capacity(1 << 16, file) })
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
        let length = self.writer.get_ref().metadata()?.len();
        fs::rename(&self.partial, &self.path).or_else(|error| if self.has_its_name(length) { Ok(()) } else { Err(error) })?;
        // The name too is to outlast a loss of power. Not every file system can do that for folders; then the name of before may come back, and no more.
        if let Some(folder) = self.path.parent() {
            let _ = File::open(folder).and_then(|folder| folder.sync_all());
        }
        Ok(())
    }

    /// Whether the file was renamed although the system says that it was not: a file server that answers too late is asked again, and finds the other name gone.
    fn has_its_name(&self, length: u64) -> bool {
        let is_whole = || fs::metadata(&self.path).is_ok_and(|found| found.len() == length);
        fs::symlink_metadata(&self.partial).is_err_and(|error| error.kind() == io::ErrorKind::NotFound) && is_whole()
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
    written(WholeFile::create(path)?, write)
}

/// [`write_whole`] of a file that other processes may be writing too: see [`WholeFile::create_by`].
///
/// # Errors
///
/// Those of [`write_whole`].
pub fn write_whole_by<E: From<io::Error>>(path: &Path, worker: &str, write: impl FnOnce(&mut WholeFile) -> Result<(), E>) -> Result<(), E> {
    written(WholeFile::create_by(path, worker)?, write)
}

fn written<E: From<io::Error>>(mut file: WholeFile, write: impl FnOnce(&mut WholeFile) -> Result<(), E>) -> Result<(), E> {
    let partial = file.partial.clone();
    let written = write(&mut file).and_then(|()| Ok(file.finish()?));
    if written.is_err() {
        // That it could not be written is the error to report, not that its beginning is still there.
        let _ = fs::remove_file(partial);
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

    #[test]
    fn two_workers_write_the_same_file_without_harm() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part-00000.csv");
        let [mut one, mut other] = ["a-1", "b-1"].map(|worker| WholeFile::create_by(&path, worker).unwrap());
        one.write_all(b"the ").unwrap();
        other.write_all(b"the same").unwrap();
        one.write_all(b"same").unwrap();
        for file in [other, one] {
            file.finish().unwrap();
            assert_eq!(fs::read(&path).unwrap(), b"the same");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// The answer of a file server to the first request was lost, and the second finds nothing to rename.
    #[test]
    fn a_file_that_has_its_name_already_is_finished_and_another_one_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs.csv");
        let begun = || {
            let mut file = WholeFile::create(&path).unwrap();
            file.write_all(b"whole").unwrap();
            file.flush().unwrap();
            file
        };
        let file = begun();
        fs::rename(partial_name(&path), &path).unwrap();
        file.finish().unwrap();
        let file = begun();
        fs::remove_file(partial_name(&path)).unwrap();
        fs::write(&path, b"something else").unwrap();
        assert_eq!(file.finish().unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
