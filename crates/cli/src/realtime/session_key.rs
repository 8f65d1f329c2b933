//! Session key of `--key-file`.

use std::path::Path;

use cohaptic_live::{KeyFileError, SessionKey};

use crate::failure::Failure;

/// Reads the session key in a file, or returns `None` without a file.
///
/// # Errors
///
/// [`Failure::System`] if the file cannot be read. [`Failure::Input`] if other users may access the file, or if the content is not a key.
pub(crate) fn session_key(file: Option<&Path>) -> Result<Option<SessionKey>, Failure> {
    let refused = |error: KeyFileError| {
        let message = error.to_string();
        if matches!(error, KeyFileError::Read { .. }) { Failure::System(message) } else { Failure::Input(message) }
    };
    file.map(SessionKey::read_from).transpose().map_err(refused)
}
