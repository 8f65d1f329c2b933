//! Folder written as a whole.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use super::WriteError;

/// First words of the marked file. A folder with such a file was written by a test bed.
pub(super) const MARK: &str = "What happened in a test bed";

/// Name of the marked file.
pub(super) const MARKED: &str = "summary.txt";

/// Counter for temporary names, so that two tests of a process never write to the same name.
static COUNT: AtomicU64 = AtomicU64::new(0);

/// Writes files into a folder, in place of the files of an earlier run. At every instant the folder is complete or missing.
pub(super) fn replace(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), WriteError> {
    let Some(name) = folder.file_name() else { return Err(WriteError::NoName { folder: folder.to_path_buf() }) };
    if !is_ours(folder) {
        return Err(WriteError::NotOurs { folder: folder.to_path_buf() });
    }
    let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    fs::create_dir_all(parent).map_err(failed(parent))?;
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    // In the same parent, because a rename works only within a file system.
    let beside = |what: &str| parent.join(format!(".{}.{}-{count}.{what}", name.to_string_lossy(), std::process::id()));
    let (new, old) = (beside("new"), beside("old"));
    let written = write_all(&new, files).and_then(|()| put(&new, folder, &old));
    if written.is_err() {
        // The incomplete folder is of no use. An error of its removal is ignored, because the error of the writing is reported.
        let _ = fs::remove_dir_all(&new);
    }
    written
}

fn write_all(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), WriteError> {
    fs::create_dir(folder).map_err(failed(folder))?;
    for (name, bytes) in files {
        let path = folder.join(name);
        fs::write(&path, bytes).map_err(failed(&path))?;
    }
    Ok(())
}

/// Renames the folder `new` to `folder`. A folder that was there is moved to `old` and then removed.
fn put(new: &Path, folder: &Path, old: &Path) -> Result<(), WriteError> {
    match fs::rename(folder, old) {
        Ok(()) => {
            if let Err(error) = fs::rename(new, folder) {
                // The earlier folder is restored, if possible.
                let _ = fs::rename(old, folder);
                return Err(failed(folder)(error));
            }
            // An old folder that cannot be removed does no harm.
            let _ = fs::remove_dir_all(old);
            Ok(())
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => fs::rename(new, folder).map_err(failed(folder)),
        Err(error) => Err(failed(folder)(error)),
    }
}

/// Returns whether a folder may be replaced: it is missing or empty, or was written by a test bed.
fn is_ours(folder: &Path) -> bool {
    if fs::symlink_metadata(folder).is_err() {
        return true;
    }
    let is_empty = fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none());
    is_empty || fs::read(folder.join(MARKED)).is_ok_and(|text| text.starts_with(MARK.as_bytes()))
}

fn failed(path: &Path) -> impl FnOnce(io::Error) -> WriteError {
    let path: PathBuf = path.to_path_buf();
    move |source| WriteError::Io { path, source }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(text: &str) -> Vec<(String, Vec<u8>)> {
        vec![(MARKED.to_owned(), format!("{MARK}\n{text}").into_bytes()), (text.to_owned(), Vec::new())]
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn what_an_earlier_failure_left_is_replaced_as_a_whole_and_nothing_lies_beside_it() {
        let base = tempfile::tempdir().unwrap();
        let folder = base.path().join("deep/er");
        replace(&folder, &files("one")).unwrap();
        assert_eq!(names(&folder), ["one", MARKED]);
        replace(&folder, &files("two")).unwrap();
        assert_eq!(names(&folder), [MARKED, "two"]);
        assert_eq!(names(&base.path().join("deep")), ["er"]);
    }

    #[test]
    fn a_folder_of_somebody_else_is_left_alone() {
        let base = tempfile::tempdir().unwrap();
        fs::write(base.path().join("precious"), "x").unwrap();
        assert!(matches!(replace(base.path(), &files("one")), Err(WriteError::NotOurs { .. })));
        assert_eq!(names(base.path()), ["precious"]);
        let file = base.path().join("precious");
        assert!(matches!(replace(&file, &files("one")), Err(WriteError::NotOurs { .. })));
        let error = replace(&file.join("below"), &files("one")).unwrap_err().to_string();
        assert!(error.starts_with(&file.display().to_string()), "{error}");
        assert!(matches!(replace(Path::new(".."), &files("one")), Err(WriteError::NoName { .. })));
        // An empty folder may be replaced.
        let empty = base.path().join("empty");
        fs::create_dir(&empty).unwrap();
        replace(&empty, &files("one")).unwrap();
        assert_eq!(names(base.path()), ["empty", "precious"]);
    }

    #[test]
    fn what_cannot_be_written_leaves_what_was_there() {
        let base = tempfile::tempdir().unwrap();
        let folder = base.path().join("kept");
        replace(&folder, &files("one")).unwrap();
        // The subfolder of this file does not exist.
        let error = replace(&folder, &[("no/such".to_owned(), Vec::new())]).unwrap_err();
        assert!(matches!(error, WriteError::Io { .. }));
        assert_eq!(names(base.path()), ["kept"]);
        assert_eq!(names(&folder), ["one", MARKED]);
    }
}
