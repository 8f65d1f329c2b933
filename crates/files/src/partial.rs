//! Names of files that are being written.

use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use crate::lock;

/// The end of the name of a file that is being written.
pub const PARTIAL: &str = ".partial";

/// The most names that are tried: processes that write one file at the same time, and files under such names that cannot be removed.
const MOST: u32 = 1000;

/// Makes a new file beside another one, and returns it with its name: that of the other one and [`PARTIAL`], as in `runs.csv.partial`. If another process
/// writes under this name, or a link or a folder has it, a number stands before the end: `runs.csv.2.partial`.
///
/// Nothing is written into a file that is there already, and no link is followed. A file that a killed process left is removed.
pub(crate) fn create(beside: &Path) -> io::Result<(File, PathBuf)> {
    let mut number = 1;
    loop {
        let path = name(beside, number);
        match File::options().read(true).write(true).create_new(true).open(&path) {
            Ok(file) if lock::hold(&file, &path)? => return Ok((file, path)),
            // Before the new file was locked, another process took it for a left one and removed it: the name is free again.
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                if lock::remove_left(&path) {
                    continue;
                }
                if number == MOST {
                    return Err(error);
                }
                number += 1;
            }
            Err(error) => return Err(error),
        }
    }
}

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
