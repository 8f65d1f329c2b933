//! Opens a file of rows that a later process continues after an interruption.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Seek as _, SeekFrom};
use std::path::Path;

/// Opens a file of rows to continue it, or creates the file. Keeps the first `whole` bytes, cuts off all bytes after them, and writes after them. Only one
/// process at a time may call this for a file: the owner of the folder ([`OwnFolder`](crate::OwnFolder)), or the worker whose name is part of the file's
/// name.
///
/// # Errors
///
/// The system's error, or [`ErrorKind::InvalidInput`] for a link or a device. This crate never creates a link under such a name, and the target of a link
/// would lose its bytes.
pub fn open_continued(path: &Path, whole: u64) -> io::Result<File> {
    // `symlink_metadata`, because `metadata` would look at the target of the link.
    if fs::symlink_metadata(path).is_ok_and(|about| !about.is_file()) {
        return Err(io::Error::new(ErrorKind::InvalidInput, "it is not a regular file: expected a regular file, or none"));
    }
    let mut file = File::options().write(true).create(true).truncate(false).open(path)?;
    file.set_len(whole)?;
    file.seek(SeekFrom::End(0))?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    #[test]
    fn whole_rows_are_kept_and_the_rest_is_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows");
        open_continued(&path, 0).unwrap().write_all(b"1\n2").unwrap();
        open_continued(&path, 2).unwrap().write_all(b"2\n").unwrap();
        assert_eq!(fs::read(path).unwrap(), b"1\n2\n");
    }

    #[test]
    #[cfg(unix)]
    fn a_link_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let [path, victim] = ["rows", "victim"].map(|name| folder.path().join(name));
        fs::write(&victim, "no rows").unwrap();
        std::os::unix::fs::symlink(&victim, &path).unwrap();
        assert_eq!(open_continued(&path, 0).unwrap_err().kind(), ErrorKind::InvalidInput);
        assert_eq!(fs::read(victim).unwrap(), b"no rows");
    }
}
