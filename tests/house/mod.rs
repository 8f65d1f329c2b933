//! Rules that the project keeps to: its packages and their licences, the systems on which they build, its loop in real time, the order of its modules, the
//! runner of its property tests, and the terms of its pages.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail as tests do")]

mod actions;
mod dependencies;
mod metadata;
mod packages;
mod properties;
mod real_time;
mod rooms;
mod systems;
mod terms;

use std::fs;
use std::path::{Path, PathBuf};

/// The folder of the project.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

/// All files below a folder whose names end so, in order. Links to folders are not followed, and folders of built or fetched files are left out.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut left = vec![folder.to_path_buf()];
    while let Some(folder) = left.pop() {
        for entry in fs::read_dir(&folder).unwrap().map(Result::unwrap) {
            let (path, kind, name) = (entry.path(), entry.file_type().unwrap(), entry.file_name());
            let is_ours = name == ".github" || !(name.to_string_lossy().starts_with('.') || name == "target" || name == "node_modules");
            if kind.is_dir() && is_ours {
                left.push(path);
            } else if kind.is_file() && path.extension().is_some_and(|end| end == extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// The path of a file from the folder of the project.
fn name(path: &Path) -> String {
    path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned()
}
