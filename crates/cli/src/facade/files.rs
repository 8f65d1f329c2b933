//! Folders of generated files.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::file::write_file;

/// Folder whose files are written only if they change, so that cargo compiles nothing again that is the same.
pub(super) struct Files {
    folder: PathBuf,
    written: BTreeSet<String>,
}

impl Files {
    pub(super) fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), written: BTreeSet::new() }
    }

    pub(super) fn write(&mut self, name: &str, text: &str) -> Result<(), Failure> {
        let path = self.folder.join(name);
        if fs::read(&path).is_ok_and(|old| old == text.as_bytes()) {
            self.written.insert(name.to_owned());
            return Ok(());
        }
        make_folder(path.parent().unwrap_or(&self.folder))?;
        write_file(&path, text)?;
        self.written.insert(name.to_owned());
        Ok(())
    }

    /// Removes files of another version.
    pub(super) fn remove_others(&self) -> Result<(), Failure> {
        for name in list(&self.folder, Path::new(""))? {
            // Cargo writes the lock file and the folder `target` if somebody builds the package by itself.
            if !self.written.contains(&name) && name.starts_with("src/") {
                let path = self.folder.join(name);
                fs::remove_file(&path).map_err(|error| Failure::File { verb: "remove", path, error })?;
            }
        }
        Ok(())
    }
}

/// Makes a folder with the folders above it.
pub(super) fn make_folder(path: &Path) -> Result<(), Failure> {
    fs::create_dir_all(path).map_err(|error| Failure::File { verb: "make", path: path.to_owned(), error })
}

/// Returns the paths of all files below `folder` with `/` between names, relative to `folder`.
pub(super) fn list(folder: &Path, below: &Path) -> Result<Vec<String>, Failure> {
    let here = folder.join(below);
    let unread = |error| Failure::File { verb: "read", path: here.clone(), error };
    let mut found = Vec::new();
    for entry in fs::read_dir(&here).map_err(unread)? {
        let entry = entry.map_err(unread)?;
        let path = below.join(entry.file_name());
        if entry.file_type().map_err(unread)?.is_dir() {
            found.append(&mut list(folder, &path)?);
        } else {
            found.push(path.to_string_lossy().replace('\\', "/"));
        }
    }
    Ok(found)
}
