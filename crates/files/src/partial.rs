//! Creates the temporary file of a file being written.
//!
//! The file lies in the folder of the final file, so that a rename is enough to publish the bytes. A lock marks the file as in use: a file without a lock
//! was left by a killed process, and is removed.

use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use crate::lock;

/// End of the name of every incomplete file.
pub const PARTIAL: &str = ".partial";

/// Number of names tried by [`create`]. A name is taken if another process writes under the name at this moment, or if the file of that name cannot be removed.
const MOST: u32 = 1000;

/// Creates a file next to `beside`, and returns the open file and its path. The name is the name of `beside` followed by [`PARTIAL`], as in
/// `runs.csv.partial`. If that name is taken by a writing process, a link or a folder, a number from 2 on is put in: `runs.csv.2.partial`.
///
/// Never opens an existing file, and follows no link. A file left under the name by an ended process is removed first.
pub(crate) fn create(beside: &Path) -> io::Result<(File, PathBuf)> {
    let mut number = 1;
    loop {
        let path = name(beside, number);
        match File::options().read(true).write(true).create_new(true).open(&path) {
            Ok(file) if lock::hold(&file, &path)? => return Ok((file, path)),
            // Another process saw the new file before the lock, took the file for abandoned and removed the file. The name is free again.
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                // The same number again: the name is free now.
                if lock::remove_left(&path) {
                    continue;
                }
                // The error of the last attempt tells the user which name is in the way.
                if number == MOST {
                    return Err(error);
                }
                number += 1;
            }
            Err(error) => return Err(error),
        }
    }
}

/// Returns the name of the partial file with this number. The number 1 is not written.
fn name(beside: &Path, number: u32) -> PathBuf {
    let mut name = beside.as_os_str().to_owned();
    if number > 1 {
        name.push(format!(".{number}"));
    }
    name.push(PARTIAL);
    name.into()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn each_writer_has_a_name_of_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let beside = folder.path().join("runs.csv");
        let (_one, first) = create(&beside).unwrap();
        let (_two, second) = create(&beside).unwrap();
        assert_eq!([first, second], ["runs.csv.partial", "runs.csv.2.partial"].map(|name| folder.path().join(name)));
    }

    /// A process that has ended holds no lock.
    #[test]
    #[cfg(unix)]
    fn what_killed_processes_left_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["runs.csv.partial", "runs.csv.2.partial"] {
            fs::write(folder.path().join(name), "of a process that was killed").unwrap();
        }
        let (file, path) = create(&folder.path().join("runs.csv")).unwrap();
        assert_eq!((path, file.metadata().unwrap().len()), (folder.path().join("runs.csv.partial"), 0));
        let (_, path) = create(&folder.path().join("runs.csv")).unwrap();
        assert_eq!(path, folder.path().join("runs.csv.2.partial"));
        assert_eq!(names(folder.path()), ["runs.csv.2.partial", "runs.csv.partial"]);
    }

    #[test]
    #[cfg(unix)]
    fn a_link_in_the_place_of_the_name_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("victim"), "precious").unwrap();
        std::os::unix::fs::symlink("victim", folder.path().join("runs.csv.partial")).unwrap();
        std::os::unix::fs::symlink("nobody", folder.path().join("runs.csv.2.partial")).unwrap();
        let (_, path) = create(&folder.path().join("runs.csv")).unwrap();
        assert_eq!(path, folder.path().join("runs.csv.3.partial"));
        assert_eq!(fs::read_to_string(folder.path().join("victim")).unwrap(), "precious");
        assert!(!folder.path().join("nobody").exists());
    }

    #[test]
    fn threads_that_come_and_go_never_share_a_file() {
        use std::io::{Read as _, Seek as _, Write as _};
        let folder = tempfile::tempdir().unwrap();
        let beside = folder.path().join("runs.csv");
        std::thread::scope(|scope| {
            for thread in 0..4_u8 {
                let beside = &beside;
                scope.spawn(move || {
                    for _ in 0..100 {
                        let (mut file, path) = create(beside).unwrap();
                        file.write_all(&[thread; 100]).unwrap();
                        file.rewind().unwrap();
                        let mut bytes = Vec::new();
                        file.read_to_end(&mut bytes).unwrap();
                        assert_eq!((bytes, fs::metadata(&path).unwrap().len()), (vec![thread; 100], 100));
                        fs::remove_file(path).unwrap();
                    }
                });
            }
        });
    }
}
