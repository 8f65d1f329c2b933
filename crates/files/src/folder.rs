//! A folder with one writing process at a time, so all files in the folder come from the same process.
//!
//! The owner is the process holding the lock file [`FOLDER_LOCK`] in the folder. Dropping the ownership removes a folder made by the owner if the folder is
//! still empty.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use crate::lock::{self, Lock};

/// Name of the lock file in an owned folder. The file exists while a process owns the folder. A killed process leaves its lock file behind; the file alone
/// does not block the next owner.
pub const FOLDER_LOCK: &str = "cohaptic.lock";

/// Number of attempts to make a folder that another process keeps removing.
const TRIES: u32 = 100;

/// Ownership of a folder: no other process can take the folder while this value lives. The system ends the ownership when the process ends, even if the
/// process is killed.
///
/// On a file system without locks, no process is refused. Single files are still written as a whole there, but files of two processes can mix.
#[derive(Debug)]
pub struct OwnFolder {
    path: PathBuf,
    /// Lock on [`FOLDER_LOCK`]; `None` on a file system without locks.
    lock: Option<Lock>,
    /// `true` if the folder did not exist before [`OwnFolder::take`].
    is_new: bool,
}

impl OwnFolder {
    /// Takes the folder, and makes missing folders of the path. Does not wait for another owner.
    ///
    /// # Errors
    ///
    /// [`ErrorKind::ResourceBusy`] if another process or another value owns the folder; otherwise the system's error.
    pub fn take(path: &Path) -> io::Result<Self> {
        let (mut is_new, mut tries) = (false, 1);
        loop {
            is_new |= !path.exists();
            match fs::create_dir_all(path).and_then(|()| Self::locked(path)) {
                Ok(lock) => return Ok(Self { path: path.to_path_buf(), lock, is_new }),
                // The owner before may remove its empty folder between `create_dir_all` and the creation of the lock file. The next round makes the folder
                // again.
                Err(error) if tries < TRIES && matches!(error.kind(), ErrorKind::NotFound | ErrorKind::AlreadyExists) => tries += 1,
                Err(error) => return Err(error),
            }
        }
    }

    /// Locks the folder's lock file. Returns `None` if the file system has no locks.
    fn locked(path: &Path) -> io::Result<Option<Lock>> {
        let file = path.join(FOLDER_LOCK);
        match Lock::take(&file) {
            Ok(Some(lock)) => Ok(Some(lock)),
            Ok(None) => Err(io::Error::new(
                ErrorKind::ResourceBusy,
                "another process writes into this folder: wait until it has ended, or choose another folder",
            )),
            Err(error) if lock::is_impossible(&error) => {
                // The attempt to lock has created the file, which nobody would remove later.
                let _ = fs::remove_file(file);
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// Returns whether another process, or another value of this process, owns the folder. Writes nothing.
    #[must_use]
    pub fn is_taken(path: &Path) -> bool {
        Lock::is_held(&path.join(FOLDER_LOCK))
    }
}

impl Drop for OwnFolder {
    fn drop(&mut self) {
        // The lock file must be gone before `remove_dir`, which removes empty folders only.
        self.lock = None;
        if self.is_new {
            // Fails on purpose if the owner wrote files.
            let _ = fs::remove_dir(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_is_refused_until_the_first_is_gone() {
        let base = tempfile::tempdir().unwrap();
        let path = base.path().join("deep/out");
        assert!(!OwnFolder::is_taken(&path));
        let first = OwnFolder::take(&path).unwrap();
        assert_eq!(OwnFolder::take(&path).unwrap_err().kind(), ErrorKind::ResourceBusy);
        assert!(OwnFolder::is_taken(&path));
        fs::write(path.join("rows.csv"), "1\n").unwrap();
        drop(first);
        let names: Vec<_> = fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(names, ["rows.csv"]);
        drop(OwnFolder::take(&path).unwrap());
        assert!(path.join("rows.csv").exists());
    }

    #[test]
    fn a_new_folder_that_stays_empty_is_removed_and_another_one_is_not() {
        let base = tempfile::tempdir().unwrap();
        let path = base.path().join("out");
        drop(OwnFolder::take(&path).unwrap());
        assert!(!path.exists());
        fs::create_dir(&path).unwrap();
        drop(OwnFolder::take(&path).unwrap());
        assert!(path.exists());
    }

    #[test]
    fn threads_that_make_and_remove_the_folder_find_it() {
        let base = tempfile::tempdir().unwrap();
        let path = base.path().join("out");
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..100 {
                        let taken = OwnFolder::take(&path);
                        assert!(taken.is_ok() || taken.is_err_and(|error| error.kind() == ErrorKind::ResourceBusy));
                    }
                });
            }
        });
    }
}
