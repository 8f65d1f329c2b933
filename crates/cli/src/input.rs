//! Scenes, relay files and router files as the user names them: by a path, or `-` for standard input.

use std::io::{self, Read as _};
use std::path::Path;
use std::sync::Mutex;

use cohaptic_files::MOST_TOML_BYTES;
use cohaptic_linkfile::reading::{file_text, text_of};
use cohaptic_scene::SceneError;

const STANDARD_INPUT: &str = "<standard input>";

/// What came from standard input, which can be read only once.
static READ: Mutex<Option<Vec<u8>>> = Mutex::new(None);

/// Whether standard input is meant.
pub(crate) fn is_standard_input(path: &Path) -> bool {
    path == Path::new("-")
}

/// What messages call the file. Its folder is where files that it names are looked for: of standard input the working directory.
pub(crate) fn named(path: &Path) -> &Path {
    if is_standard_input(path) { Path::new(STANDARD_INPUT) } else { path }
}

/// The text of a file and what it is called, read by `read`.
pub(crate) fn with<T>(path: &Path, read: impl FnOnce(&str, &Path) -> Result<T, SceneError>) -> Result<T, SceneError> {
    read(&text(path)?, named(path))
}

/// The text of a file.
pub(crate) fn text(path: &Path) -> Result<String, SceneError> {
    if !is_standard_input(path) {
        return file_text(path);
    }
    let unreadable = |source| SceneError::Read { path: STANDARD_INPUT.into(), source, place: None };
    let mut read = READ.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let bytes = match &mut *read {
        Some(bytes) => bytes,
        nothing => {
            let mut bytes = Vec::new();
            io::stdin().lock().take(MOST_TOML_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
            if bytes.len() as u64 > MOST_TOML_BYTES {
                return Err(unreadable(io::Error::other(format!("longer than {} MiB: expected a scene", MOST_TOML_BYTES >> 20))));
            }
            nothing.insert(bytes)
        }
    };
    text_of(named(path), bytes).map(str::to_owned)
}
