//! Files that have their name only when they are whole and with the disk.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::partial;
use crate::target::Target;

/// A file being written under another name in the same folder. The other name ends in [`PARTIAL`](crate::PARTIAL), and no other process writes under it. The
/// file takes its own name in [`finish`](Self::finish); a file that was there until then is replaced. If two processes write one file, the file of the last is
/// there, whole. If the file is dropped unfinished, its beginning stays under the other name until the file is written again.
///
/// A link is followed: the file that it leads to is written, or made. A device, a pipe or a socket takes the bytes as they come, and stays what it is. So does
/// a file to which standard output or standard error goes.
#[derive(Debug)]
pub struct WholeFile {
    path: PathBuf,
    place: Place,
    writer: BufWriter<File>,
}

/// Where bytes go.
#[derive(Debug)]
enum Place {
    /// Into a new file, which takes the name of the target.
    Beside { partial: PathBuf, target: PathBuf },
    /// Into the device, the pipe, the socket or the open file that has the name.
    Within,
}

impl WholeFile {
    /// Begins a file of that name. For a pipe, waits for its reader.
    ///
    /// # Errors
    ///
    /// The error of the system about the name, or about the file beside it.
    pub fn create(path: impl Into<PathBuf>) -> io::Result<Self> {
        Self::begin(path.into(), "")
    }

    /// Begins a file of that name, which processes on other machines may be writing too: the other name has that of this worker in it.
    ///
    /// # Errors
    ///
    /// As [`WholeFile::create`].
    pub fn create_by(path: impl Into<PathBuf>, worker: &str) -> io::Result<Self> {
        Self::begin(path.into(), &format!(".{worker}"))
    }

    fn begin(path: PathBuf, worker: &str) -> io::Result<Self> {
        let (file, place) = match Target::of(&path)? {
            Target::Stream(file) => (file, Place::Within),
            Target::Named(target) => {
                let mut beside = target.clone().into_os_string();
                beside.push(worker);
                let (file, partial) = partial::create(beside.as_ref())?;
                (file, Place::Beside { partial, target })
            }
        };
        Ok(Self { path, place, writer: BufWriter::with_capacity(1 << 16, file) })
    }

    /// The name that it was begun with.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The name of the file in which the bytes are until [`finish`](Self::finish).
    #[must_use]
    pub fn written_to(&self) -> &Path {
        match &self.place {
            Place::Beside { partial, .. } => partial,
            Place::Within => &self.path,
        }
    }

    /// Writes the rest, waits until all is with the disk, and gives the file its name.
    ///
    /// # Errors
    ///
    /// The error of the system. The file stays under the other name.
    pub fn finish(mut self) -> io::Result<()> {
        self.give_name()
    }

    fn give_name(&mut self) -> io::Result<()> {
        self.writer.flush()?;
        let synced = self.writer.get_ref().sync_all();
        let Place::Beside { partial, target } = &self.place else {
            // Pipes, terminals and most devices keep nothing that could be waited for, and say so.
            return synced
                .or_else(|error| if matches!(error.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) { Ok(()) } else { Err(error) });
        };
        synced?;
        let length = self.writer.get_ref().metadata()?.len();
        fs::rename(partial, target).or_else(|error| if is_renamed(partial, target, length) { Ok(()) } else { Err(error) })?;
        // The name too is to outlast a loss of power. Not every file system can do that for folders; then the name of before may come back, and no more.
        if let Some(folder) = target.parent() {
            let _ = File::open(folder).and_then(|folder| folder.sync_all());
        }
        Ok(())
    }

    /// Removes the beginning of a file that could not be written.
    fn abandon(self) {
        if let Place::Beside { partial, .. } = &self.place {
            // The error to report is the failure to write, not a beginning that stays.
            let _ = fs::remove_file(partial);
        }
    }
}

/// Whether a file was renamed although the system says that it was not: a file server that answers too late is asked again, and finds the other name gone.
fn is_renamed(partial: &Path, target: &Path, length: u64) -> bool {
    let is_whole = || fs::metadata(target).is_ok_and(|found| found.len() == length);
    fs::symlink_metadata(partial).is_err_and(|error| error.kind() == ErrorKind::NotFound) && is_whole()
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
    let written = write(&mut file).and_then(|()| Ok(file.give_name()?));
    if written.is_err() {
        file.abandon();
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
            Err(ErrorKind::StorageFull.into())
        };
        assert_eq!(write_whole(&path, fails).unwrap_err().kind(), ErrorKind::StorageFull);
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
        assert_eq!(fs::read(folder.path().join("trajectory.csv.partial")).unwrap(), b"t,peer\n");
        // The next one takes the place of a beginning that nobody goes on with.
        WholeFile::create(&path).unwrap().finish().unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn of_two_that_write_the_same_name_the_last_is_there_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fates.csv");
        let mut files = [(); 2].map(|()| WholeFile::create(&path).unwrap());
        for (file, row) in files.iter_mut().zip([b"one\n", b"two\n"]) {
            (0..100_000).for_each(|_| file.write_all(row).unwrap());
        }
        for (file, row) in files.into_iter().zip(["one\n", "two\n"]) {
            file.finish().unwrap();
            assert!(fs::read_to_string(&path).unwrap() == row.repeat(100_000));
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
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
        fs::rename(file.written_to(), &path).unwrap();
        file.finish().unwrap();
        let file = begun();
        fs::remove_file(file.written_to()).unwrap();
        fs::write(&path, b"something else").unwrap();
        assert_eq!(file.finish().unwrap_err().kind(), ErrorKind::NotFound);
    }
}
