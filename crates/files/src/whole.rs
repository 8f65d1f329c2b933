//! A file with its final name only when all bytes are on the disk.
//!
//! The bytes go into a partial file in the same folder, which is renamed at the end. Streams (devices, pipes, sockets, open files) cannot be renamed and
//! take the bytes directly.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::partial;
use crate::target::Target;

/// A file that is written under a temporary name in the same folder. The temporary name ends in [`PARTIAL`](crate::PARTIAL) and is used by this value only.
/// [`finish`](Self::finish) gives the file its final name and replaces an older file of that name. If two processes write files of the same name, the file
/// finished last stays, complete. A value dropped unfinished leaves the temporary file until the next writer of the same name removes the leftover.
///
/// If the final name is a link, the target of the link is written or created. A device, a pipe or a socket takes the bytes as they are written, and so does
/// a file to which standard output or standard error goes.
#[derive(Debug)]
pub struct WholeFile {
    /// Path as the caller gave it, before links are followed.
    path: PathBuf,
    place: Place,
    writer: BufWriter<File>,
}

/// Destination of the bytes.
#[derive(Debug)]
enum Place {
    /// The new file `partial`, which is renamed to `target` at the end.
    Beside { partial: PathBuf, target: PathBuf },
    /// The stream that has the caller's name: a device, a pipe, a socket or an open file.
    Within,
}

impl WholeFile {
    /// Begins a file with the final name `path`. Waits for the reader if `path` is a pipe.
    ///
    /// # Errors
    ///
    /// The system's error about `path`, or about the temporary file.
    pub fn create(path: impl Into<PathBuf>) -> io::Result<Self> {
        Self::begin(path.into(), "")
    }

    /// Begins a file with the final name `path`, possibly written by processes on other machines at the same time. The temporary name contains `worker`,
    /// because locks do not tell abandoned temporary files of other machines.
    ///
    /// # Errors
    ///
    /// The errors of [`WholeFile::create`].
    fn create_by(path: impl Into<PathBuf>, worker: &str) -> io::Result<Self> {
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

    /// Returns the final name, as the caller gave it.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the path under which the bytes lie until [`finish`](Self::finish): the temporary path, or the final path of a stream.
    #[must_use]
    pub fn written_to(&self) -> &Path {
        match &self.place {
            Place::Beside { partial, .. } => partial,
            Place::Within => &self.path,
        }
    }

    /// Writes buffered bytes, waits until all bytes are on the disk, and gives the file its final name.
    ///
    /// # Errors
    ///
    /// The system's error. The file then keeps its temporary name.
    pub fn finish(mut self) -> io::Result<()> {
        self.give_name()
    }

    fn give_name(&mut self) -> io::Result<()> {
        self.writer.flush()?;
        let synced = self.writer.get_ref().sync_all();
        let Place::Beside { partial, target } = &self.place else {
            // Pipes, terminals and most devices store nothing, and refuse `fsync` with either of these errors, although the bytes have arrived.
            return synced
                .or_else(|error| if matches!(error.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) { Ok(()) } else { Err(error) });
        };
        synced?;
        // Read before the rename: the length identifies the file if the answer to the rename is lost.
        let length = self.writer.get_ref().metadata()?.len();
        fs::rename(partial, target).or_else(|error| if is_renamed(partial, target, length) { Ok(()) } else { Err(error) })?;
        // The folder is synced too, so that the new name survives a loss of power. Some file systems cannot sync folders. After a loss of power, the older
        // file can then have the name, which is still a complete file.
        if let Some(folder) = target.parent() {
            let _ = File::open(folder).and_then(|folder| folder.sync_all());
        }
        Ok(())
    }

    /// Removes the temporary file after a failed write.
    fn abandon(self) {
        if let Place::Beside { partial, .. } = &self.place {
            // The caller reports the failed write. A temporary file that cannot be removed is harmless.
            let _ = fs::remove_file(partial);
        }
    }
}

/// Returns whether `partial` was renamed to `target` although the system reported an error. A network file system repeats a request whose answer was lost,
/// and the second request finds no `partial`.
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

/// Writes a file through [`WholeFile`]. If anything fails, the temporary file is removed, and an older file of the name is unchanged.
///
/// # Errors
///
/// The error of `write`, or the system's error.
pub fn write_whole<E: From<io::Error>>(path: &Path, write: impl FnOnce(&mut WholeFile) -> Result<(), E>) -> Result<(), E> {
    written(WholeFile::create(path)?, write)
}

/// Like [`write_whole`], for a file possibly written by processes on other machines at the same time. The temporary name contains `worker`, because locks do
/// not tell abandoned temporary files of other machines.
///
/// # Errors
///
/// The errors of [`write_whole`].
pub fn write_whole_by<E: From<io::Error>>(path: &Path, worker: &str, write: impl FnOnce(&mut WholeFile) -> Result<(), E>) -> Result<(), E> {
    written(WholeFile::create_by(path, worker)?, write)
}

/// Runs `write` and finishes the file, or removes the file if one of the two fails.
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
        // The next writer of the name removes the temporary file that nobody continues.
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

    /// The first rename succeeded and its answer was lost; the repeated rename finds no file to rename.
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
