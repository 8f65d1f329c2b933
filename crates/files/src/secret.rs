//! Checks the permissions of files with a secret, such as a key or a token.

use std::fs::File;
use std::io;

/// Returns the permissions (lowest nine bits of the mode) if users other than the owner may read, write or run the file, and `None` if only the owner may.
///
/// The function asks the open file and not its path, so nobody can replace the file between this check and the reading. On systems without such permissions
/// the answer is always `None`.
///
/// # Errors
///
/// The system's error.
#[cfg(unix)]
pub fn open_to_others(file: &File) -> io::Result<Option<u32>> {
    use std::os::unix::fs::PermissionsExt as _;

    let mode = file.metadata()?.permissions().mode() & 0o777;
    Ok((mode & 0o077 != 0).then_some(mode))
}

/// Returns `None`, because the system has no such permissions.
///
/// # Errors
///
/// None.
#[cfg(not(unix))]
pub fn open_to_others(_file: &File) -> io::Result<Option<u32>> {
    Ok(None)
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    #[test]
    fn a_single_permission_of_others_is_one_too_many() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let asked = |mode: u32| {
            file.as_file().set_permissions(std::fs::Permissions::from_mode(mode)).unwrap();
            open_to_others(file.as_file()).unwrap()
        };
        for mode in [0o600, 0o400, 0o700, 0o000] {
            assert_eq!(asked(mode), None, "{mode:o}");
        }
        for bit in 0..6 {
            assert_eq!(asked(0o600 | 1 << bit), Some(0o600 | 1 << bit));
        }
    }
}
