//! Locks of the system, for processes on one machine.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

#[cfg(unix)]
use rustix::{
    fs::{FlockOperation, flock},
    io::Errno,
};

/// A lock on a file of its own, which is removed with it. The system lets go of it when the process ends, however it ends.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// Open as long as the lock is held.
    file: Option<File>,
}

impl Lock {
    /// Makes the file if there is none, and locks it. `None` if another process has it. Does not wait.
    ///
    /// # Errors
    ///
    /// The error of the system, also that its file system has no locks.
    pub fn take(path: &Path) -> io::Result<Option<Self>> {
        Ok(locked(path)?.map(|file| Self { path: path.to_path_buf(), file: Some(file) }))
    }

    /// Whether another process has it. Nothing is written; where the file system has no locks, none is held.
    #[must_use]
    pub fn is_held(path: &Path) -> bool {
        match File::open(path) {
            Ok(file) => is_locked(&file),
            // On Windows the file is open for its process alone.
            Err(error) => cfg!(windows) && error.kind() != io::ErrorKind::NotFound,
        }
    }
}

#[cfg(unix)]
fn is_locked(file: &File) -> bool {
    flock(file, FlockOperation::NonBlockingLockShared) == Err(Errno::WOULDBLOCK)
}

#[cfg(windows)]
fn is_locked(_: &File) -> bool {
    false
}

/// The file, open and locked; `None` if another process has locked it.
#[cfg(unix)]
fn locked(path: &Path) -> io::Result<Option<File>> {
    loop {
        let file = File::options().read(true).write(true).create(true).truncate(false).open(path).or_else(|error| {
            // A process of another user may have left the file, which is then open for reading alone, and can be locked all the same.
            if error.kind() == io::ErrorKind::PermissionDenied { File::open(path).map_err(|_| error) } else { Err(error) }
        })?;
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(Errno::WOULDBLOCK) => return Ok(None),
            Err(error) => return Err(error.into()),
        }
        // The process that had it may have removed the file in between: the locked file is then no lock for anybody.
        if is_at(&file, path)? {
            return Ok(Some(file));
        }
    }
}

/// Whether that is the file of that name.
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

/// The file, open for this process alone; `None` if another process has it open.
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
            // No open file is removed there. A process that opens it now keeps it, and the file stays.
            self.file = None;
        }
        // Elsewhere while it is held: no other process can have taken it. A file that stays hinders nobody.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Whether an error of [`Lock::take`] says that the file system has no locks.
#[cfg(unix)]
pub(crate) fn is_impossible(error: &io::Error) -> bool {
    [Errno::NOLCK, Errno::NOSYS, Errno::OPNOTSUPP].iter().any(|errno| error.raw_os_error() == Some(errno.raw_os_error()))
}

#[cfg(not(unix))]
pub(crate) fn is_impossible(_: &io::Error) -> bool {
    false
}

/// Locks a file that this process has made, as long as it is open, so that no other process takes it for one that was left. `false` if another process did that
/// already, and removes it.
#[cfg(unix)]
pub(crate) fn hold(file: &File, path: &Path) -> io::Result<bool> {
    match flock(file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => is_at(file, path),
        Err(Errno::WOULDBLOCK) => Ok(false),
        // Where there are no locks, no process removes the file of another one.
        Err(_) => Ok(true),
    }
}

#[cfg(not(unix))]
pub(crate) fn hold(_: &File, _: &Path) -> io::Result<bool> {
    Ok(true)
}

/// Removes a file that a process has left which has ended. `false` if something is there that cannot be told to be such a file.
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
    // Its owner may have renamed it before it was locked. After that only the owner of the lock does.
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
        // One that a killed process left is no hindrance.
        std::fs::write(&path, "").unwrap();
        assert!(Lock::take(&path).unwrap().is_some());
    }

    /// Root may write into every file: this can fail for other users alone.
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
