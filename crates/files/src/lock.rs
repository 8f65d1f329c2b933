//! Locks of the system (`flock`, or exclusive opening on Windows), for processes on one machine.
//!
//! Two uses: [`Lock`] is a lock with a file of its own, and [`hold`] and [`remove_left`] distinguish partial files in use from files left by killed processes.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

#[cfg(unix)]
use rustix::{
    fs::{FlockOperation, flock},
    io::Errno,
};

/// A lock on a file made for the lock and removed with the lock. The system releases the lock when the process ends, even if the process is killed.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// Open file carrying the lock; `None` only while the value is dropped.
    file: Option<File>,
}

impl Lock {
    /// Takes the lock, and creates a missing file. Returns `None` if another process or another value holds the lock. Does not wait.
    ///
    /// # Errors
    ///
    /// The system's error, also if the file system has no locks.
    pub fn take(path: &Path) -> io::Result<Option<Self>> {
        Ok(locked(path)?.map(|file| Self { path: path.to_path_buf(), file: Some(file) }))
    }

    /// Returns whether another process or another value holds the lock. Writes nothing. The answer is `false` on a file system without locks.
    #[must_use]
    pub fn is_held(path: &Path) -> bool {
        match File::open(path) {
            Ok(file) => is_locked(&file),
            // On Windows a held lock shows as a file that cannot be opened.
            Err(error) => cfg!(windows) && error.kind() != io::ErrorKind::NotFound,
        }
    }
}

#[cfg(unix)]
fn is_locked(file: &File) -> bool {
    // A shared lock is refused only if somebody holds the exclusive one. The shared lock ends when the caller closes the file.
    flock(file, FlockOperation::NonBlockingLockShared) == Err(Errno::WOULDBLOCK)
}

#[cfg(windows)]
fn is_locked(_: &File) -> bool {
    false
}

/// Opens and locks a file; `None` if another process holds the lock.
#[cfg(unix)]
fn locked(path: &Path) -> io::Result<Option<File>> {
    loop {
        let file = File::options().read(true).write(true).create(true).truncate(false).open(path).or_else(|error| {
            // A process of another user may have left the file. The file can then only be read, which is enough for a lock.
            if error.kind() == io::ErrorKind::PermissionDenied { File::open(path).map_err(|_| error) } else { Err(error) }
        })?;
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(Errno::WOULDBLOCK) => return Ok(None),
            Err(error) => return Err(error.into()),
        }
        // The holder before may have removed the file between `open` and `flock`. The lock would then be on a file without a name, and the loop begins again.
        if is_at(&file, path)? {
            return Ok(Some(file));
        }
    }
}

/// Returns whether `path` still names this open file.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt as _;
    let here = file.metadata()?;
    match std::fs::metadata(path) {
        Ok(there) => Ok((here.dev(), here.ino()) == (there.dev(), there.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Opens a file for this process only; `None` if another process has the file open.
#[cfg(windows)]
fn locked(path: &Path) -> io::Result<Option<File>> {
    use std::os::windows::fs::OpenOptionsExt as _;
    const ERROR_SHARING_VIOLATION: i32 = 32;
    match File::options().read(true).write(true).create(true).truncate(false).share_mode(0).open(path) {
        Ok(file) => Ok(Some(file)),
        Err(error) if error.raw_os_error() == Some(ERROR_SHARING_VIOLATION) => Ok(None),
        Err(error) => Err(error),
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        if cfg!(windows) {
            // Windows removes no open file. A process opening the file between the two lines owns the lock, and the removal fails.
            self.file = None;
        }
        // On other systems the file is removed before the lock is released, so no other process can own the lock. A leftover file does not block.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Returns whether an error of [`Lock::take`] says that the file system has no locks.
#[cfg(unix)]
pub(crate) fn is_impossible(error: &io::Error) -> bool {
    [Errno::NOLCK, Errno::NOSYS, Errno::OPNOTSUPP].iter().any(|errno| error.raw_os_error() == Some(errno.raw_os_error()))
}

#[cfg(not(unix))]
pub(crate) fn is_impossible(_: &io::Error) -> bool {
    false
}

/// Locks a new file of this process while the file is open, so that the file does not look abandoned. Returns `false` if another process was faster and
/// removes the file.
#[cfg(unix)]
pub(crate) fn hold(file: &File, path: &Path) -> io::Result<bool> {
    match flock(file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => is_at(file, path),
        Err(Errno::WOULDBLOCK) => Ok(false),
        // On a file system without locks, `remove_left` fails too, and no process removes the files of another.
        Err(_) => Ok(true),
    }
}

#[cfg(not(unix))]
pub(crate) fn hold(_: &File, _: &Path) -> io::Result<bool> {
    Ok(true)
}

/// Removes a file whose process has ended. Returns `true` if the name is free afterwards, and `false` if the name belongs to a living process, a folder or
/// a link.
#[cfg(unix)]
pub(crate) fn remove_left(path: &Path) -> bool {
    let is_gone = |error: &io::Error| error.kind() == io::ErrorKind::NotFound;
    match std::fs::symlink_metadata(path) {
        Ok(about) if about.is_file() => {}
        Ok(_) => return false,
        Err(error) => return is_gone(&error),
    }
    // Locks over NFS need a file that is open for writing.
    let file = match File::options().write(true).open(path) {
        Ok(file) => file,
        Err(error) => return is_gone(&error),
    };
    if flock(&file, FlockOperation::NonBlockingLockExclusive).is_err() {
        return false;
    }
    // Before the lock, the owner may have renamed the file and another process may have created a new one. After the lock, no other process touches the file.
    match is_at(&file, path) {
        Ok(true) => std::fs::remove_file(path).is_ok(),
        Ok(false) => true,
        Err(_) => false,
    }
}

#[cfg(not(unix))]
pub(crate) fn remove_left(_: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_is_refused_until_the_first_is_gone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        assert!(!Lock::is_held(&path));
        let first = Lock::take(&path).unwrap().unwrap();
        assert!(Lock::take(&path).unwrap().is_none() && Lock::is_held(&path));
        drop(first);
        assert!(!path.exists());
        // A killed process leaves its lock file behind. The file alone does not block.
        std::fs::write(&path, "").unwrap();
        assert!(Lock::take(&path).unwrap().is_some());
    }

    /// Root may write into every file, so this test can fail for other users only.
    #[test]
    #[cfg(unix)]
    fn a_file_that_may_only_be_read_can_be_locked() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let mut permissions = File::create(&path).unwrap().metadata().unwrap().permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&path, permissions).unwrap();
        let first = Lock::take(&path).unwrap();
        assert!(first.is_some() && Lock::take(&path).unwrap().is_none());
    }

    #[test]
    fn of_many_threads_one_has_it_at_a_time() {
        use std::sync::atomic::{AtomicU32, Ordering};
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let (inside, taken) = (AtomicU32::new(0), AtomicU32::new(0));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..200 {
                        if let Some(lock) = Lock::take(&path).unwrap() {
                            assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0);
                            taken.fetch_add(1, Ordering::SeqCst);
                            inside.fetch_sub(1, Ordering::SeqCst);
                            drop(lock);
                        }
                    }
                });
            }
        });
        assert!(taken.into_inner() > 0);
    }
}
