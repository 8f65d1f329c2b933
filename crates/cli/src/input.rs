//! Reads scenes, relay files and router files from a path, or from standard input for `-`.

use std::io::{self, Read as _};
use std::path::Path;
use std::sync::Mutex;

use cohaptic_files::MOST_TOML_BYTES;
use cohaptic_linkfile::reading::{file_text, text_of};
use cohaptic_scene::SceneError;

const STANDARD_INPUT: &str = "<standard input>";

/// Bytes of standard input, kept because several callers need the text and standard input can be read only once.
static READ: Mutex<Option<Vec<u8>>> = Mutex::new(None);

/// Returns whether the path stands for standard input.
pub(crate) fn is_standard_input(path: &Path) -> bool {
    path == Path::new("-")
}

/// Returns the name of the file in messages. File names within the file are relative to the folder of this name, which for standard input is the working
/// directory.
pub(crate) fn named(path: &Path) -> &Path {
    if is_standard_input(path) { Path::new(STANDARD_INPUT) } else { path }
}

/// Calls `read` with the text of a file and the name of the file in messages.
pub(crate) fn with<T>(path: &Path, read: impl FnOnce(&str, &Path) -> Result<T, SceneError>) -> Result<T, SceneError> {
    read(&text(path)?, named(path))
}

/// Returns the text of a file or of standard input.
///
/// # Errors
///
/// [`SceneError`] if the file cannot be read, is too long or is not UTF-8.
pub(crate) fn text(path: &Path) -> Result<String, SceneError> {
    if !is_standard_input(path) {
        return file_text(path);
    }
    let unreadable = |source| SceneError::Read { path: STANDARD_INPUT.into(), source, place: None };
    // The lock is held during the read, so that a second caller waits and gets the same bytes.
    let mut read = READ.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let bytes = match &mut *read {
        Some(bytes) => bytes,
        nothing => {
            let mut bytes = Vec::new();
            // One byte more than the limit is read, so that a text that is too long is refused instead of cut.
            io::stdin().lock().take(MOST_TOML_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
            if bytes.len() as u64 > MOST_TOML_BYTES {
                return Err(unreadable(io::Error::other(format!("longer than {} MiB: expected a scene", MOST_TOML_BYTES >> 20))));
            }
            nothing.insert(bytes)
        }
    };
    text_of(named(path), bytes).map(str::to_owned)
}
