//! Files that have their name only when they are whole and with the disk.

use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// What the name of a file ends in while it is written.
const PARTIAL: &str = ".partial";

/// Writes a file under another name, waits until it is with the disk, and gives it its name. If anything fails, nothing is left of it.
pub(crate) fn write_whole<E: From<io::Error>>(path: &Path, write: impl FnOnce(&File) -> Result<(), E>) -> Result<(), E> {
    let partial = PathBuf::from(partial_name(path));
    let written = write_and_name(path, &partial, write);
    if written.is_err() {
        // If that fails too, it is removed when the campaign goes on.
        let _ = std::fs::remove_file(&partial);
    }
    written
}

fn write_and_name<E: From<io::Error>>(path: &Path, partial: &Path, write: impl FnOnce(&File) -> Result<(), E>) -> Result<(), E> {
    let file = File::options().read(true).write(true).create(true).truncate(true).open(partial)?;
    write(&file)?;
    file.sync_all()?;
    drop(file);
    std::fs::rename(partial, path)?;
    // The name too is to outlast a loss of power. Not every file system can do that for folders; then the part may have to be computed again, and no more.
    if let Some(folder) = path.parent() {
        let _ = File::open(folder).and_then(|folder| folder.sync_all());
    }
    Ok(())
}

/// Under which name a file is written.
pub(super) fn partial_name(path: &Path) -> OsString {
    let mut name = path.as_os_str().to_owned();
    name.push(PARTIAL);
    name
}

/// Whether a file of a campaign was being written: `campaign.json.partial`, `part-….partial`, `runs.….partial`, `verdicts.csv.partial`.
pub(super) fn is_partial(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    name.ends_with(PARTIAL) && ["campaign.", "part-", "runs.", "verdicts."].iter().any(|begin| name.starts_with(begin))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    #[test]
    fn what_fails_leaves_nothing_and_what_was_there_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part-00000.csv");
        let fails = |mut file: &File| -> io::Result<()> {
            file.write_all(b"half")?;
            Err(io::ErrorKind::StorageFull.into())
        };
        assert_eq!(write_whole(&path, fails).unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        write_whole(&path, |mut file| file.write_all(b"whole")).unwrap();
        assert!(write_whole(&path, fails).is_err());
        assert_eq!((std::fs::read(&path).unwrap(), std::fs::read_dir(folder.path()).unwrap().count()), (b"whole".to_vec(), 1));
    }

    #[test]
    fn only_files_of_a_campaign_are_swept() {
        for (name, swept) in [
            ("a/part-00012.parquet.partial", true),
            ("runs.csv.partial", true),
            ("campaign.json.partial", true),
            ("part-00012.parquet", false),
            ("thesis.partial", false),
        ] {
            assert_eq!(is_partial(name.as_ref()), swept, "{name}");
        }
    }
}
