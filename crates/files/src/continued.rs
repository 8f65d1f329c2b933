//! Files that outlast the process that began them.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Seek as _, SeekFrom};
use std::path::Path;

/// Opens a file of rows with which the same work goes on after an interruption, or begins the file. Rows are added after the first `whole` bytes \[bytes\]; all
/// other bytes are cut off. One process at a time may do so: the owner of the folder ([`OwnFolder`](crate::OwnFolder)), or the worker whose name the file has.
///
/// # Errors
///
/// The error of the system; [`ErrorKind::InvalidInput`] for a link or a device. No process begins such a file, and the file that a link leads to would be cut off.
pub fn open_continued(path: &Path, whole: u64) -> io::Result<File> {
    if fs::symlink_metadata(path).is_ok_and(|about| !about.is_file()) {
        return Err(io::Error::new(ErrorKind::InvalidInput, "it is no regular file: expected one, or none"));
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
