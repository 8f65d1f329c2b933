//! Folders of files that belong together.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use crate::lock::{self, Lock};

/// The name of the lock in a folder. The file is there as long as a process writes into the folder. The file of a killed process stays, and hinders nobody.
pub const FOLDER_LOCK: &str = "cohaptic.lock";

/// The most times that a folder is made which another process removes at the same time.
const TRIES: u32 = 100;

/// A folder that no other process takes as long as this value lives, so that its files are of one process. The system releases the folder when the process
/// ends, however the process ends.
///
/// On a file system without locks nobody is refused, and only single files are whole.
#[derive(Debug)]
pub struct OwnFolder {
    path: PathBuf,
    lock: Option<Lock>,
    is_new: bool,
}

impl OwnFolder {
    /// Makes the folder if there is none, and takes it. Does not wait.
    ///
    /// # Errors
    ///
    /// [`ErrorKind::ResourceBusy`] if another process has the folder; and what the system says.
    pub fn take(path: &Path) -> io::Result<Self> {
        let (mut is_new, mut tries) = (false, 1);
        loop {
            is_new |= !path.exists();
            match fs::create_dir_all(path).and_then(|()| Self::locked(path)) {
                Ok(lock) => return Ok(Self { path: path.to_path_buf(), lock, is_new }),
                // A process that wrote nothing removes the folder that it had made.
                Err(error) if tries < TRIES && matches!(error.kind(), ErrorKind::NotFound | ErrorKind::AlreadyExists) => tries += 1,
                Err(error) => return Err(error),
            }
        }
    }

    fn locked(path: &Path) -> io::Result<Option<Lock>> {
        let file = path.join(FOLDER_LOCK);
        match Lock::take(&file) {
            Ok(Some(lock)) => Ok(Some(lock)),
            Ok(None) => Err(io::Error::new(
                ErrorKind::ResourceBusy,
                "another process writes into this folder: expected to be the only one; wait for it, or choose another folder",
            )),
            Err(error) if lock::is_impossible(&error) => {
                let _ = fs::remove_file(file);
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// Whether another process, or another value, has the folder. Nothing is written.
    #[must_use]
    pub fn is_taken(path: &Path) -> bool {
        Lock::is_held(&path.join(FOLDER_LOCK))
    }
}

impl Drop for OwnFolder {
    fn drop(&mut self) {
        self.lock = None;
        if self.is_new {
            // Nothing came of it, unless there are files.
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
