//! Files that live control may read: the files that the user named at the start, and the files of the folder of `--control-files`, if the user gave a folder.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, Read as _};
use std::os::fd::AsRawFd as _;
use std::path::{Component, Path, PathBuf};

use cohaptic_files::{LimitedFile, MOST_BYTES};
use cohaptic_linkfile::reading::FileReader;
use cohaptic_scene::LinkKeys;
use rustix::fs::{Mode, OFlags};

use crate::arguments::ControlFilesArguments;
use crate::failure::Failure;

/// Files that a person at a page of live control may name in keys of links.
///
/// A person with the token may change links. Names of files in keys must neither show the files of the user to this person nor stop the server with an endless
/// file.
#[derive(Clone, Debug, Default)]
pub(crate) struct ControlFiles {
    /// Folder of `--control-files`, with symbolic links resolved. `None` if only the files that the user named at the start may be named.
    folder: Option<PathBuf>,
}

impl ControlFiles {
    /// Resolves the folder that the command line allows. Without `--control-files`, no folder is allowed.
    pub(crate) fn of(arguments: &ControlFilesArguments) -> Result<Self, Failure> {
        let Some(path) = &arguments.control_files else { return Ok(Self::default()) };
        let refused = |error: io::Error| Failure::Input(format!("--control-files {}: {error}: expected a folder", path.display()));
        let folder = path.canonicalize().map_err(refused)?;
        if !folder.is_dir() {
            return Err(refused(io::ErrorKind::NotADirectory.into()));
        }
        Ok(Self { folder: Some(folder) })
    }

    /// Reads the bytes of the file `path`, named in the changed keys of a link. `keys` are the keys of the link before the change. `base` is the base folder of
    /// file names in `keys`.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::PermissionDenied`] for a file that may not be named, whether the file exists or not. Errors of the system, and an error for a file that
    /// is not a regular file.
    pub(crate) fn read(&self, keys: &LinkKeys, base: &Path, path: &Path) -> io::Result<Vec<u8>> {
        if let Some(within) = self.within(path) {
            let file = open_regular(&within, OFlags::NOFOLLOW)?;
            // After the path was resolved, somebody may have replaced a folder of the path by a symbolic link. The opened file then has another path and may
            // lie outside the folder.
            if std::fs::read_link(format!("/proc/self/fd/{}", file.as_raw_fd()))? != within {
                return Err(self.refusal());
            }
            return read(file);
        }
        // Earlier changes could add only files of the folder. A file of the old keys outside the folder was therefore named by the user at the start.
        if names(keys, base, path) { read(open_regular(path, OFlags::empty())?) } else { Err(self.refusal()) }
    }

    /// Returns the path with symbolic links resolved, if the path lies in the folder. A path with `..` is never accepted.
    fn within(&self, path: &Path) -> Option<PathBuf> {
        let folder = self.folder.as_ref()?;
        // `..` after a symbolic link leads to a folder not visible in the text of the path, so paths with `..` are refused before resolution.
        if path.components().any(|part| part == Component::ParentDir) {
            return None;
        }
        path.canonicalize().ok().filter(|real| real.starts_with(folder))
    }

    /// Returns the error for a file that may not be named. The message is the same for every path, so that nobody learns which files exist.
    fn refusal(&self) -> io::Error {
        let message = match &self.folder {
            Some(folder) => format!("live control reads only the files in {} (--control-files)", folder.display()),
            None => "live control reads no files unless it is started with --control-files DIR".to_owned(),
        };
        io::Error::new(io::ErrorKind::PermissionDenied, message)
    }
}

/// Returns whether `keys` name the file `path`. Reads all files of the keys, because a law with an unreadable first table does not ask for the second table.
fn names(keys: &LinkKeys, base: &Path, path: &Path) -> bool {
    let is_named = Cell::new(false);
    let reader = |named: &Path| {
        is_named.set(is_named.get() || named == path);
        read(open_regular(named, OFlags::empty())?)
    };
    // Only the names of the files are wanted here. The caller checks whether the keys make a valid link after the change.
    let _ = keys.model_with(base, FileReader(&reader));
    is_named.get()
}

/// Opens a regular file and refuses everything else. `NONBLOCK` keeps the call from waiting for the writer of a named pipe.
fn open_regular(path: &Path, also: OFlags) -> io::Result<File> {
    let file = File::from(rustix::fs::open(path, OFlags::RDONLY | OFlags::CLOEXEC | OFlags::NONBLOCK | also, Mode::empty())?);
    // The type is taken from the open file, because the path may name another file by now.
    if file.metadata()?.is_file() { Ok(file) } else { Err(io::Error::other("it is not a regular file")) }
}

fn read(file: File) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    LimitedFile::of(file, MOST_BYTES)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;
    use std::process::Command;

    use super::*;

    const TRACE: &str = "0\n10\n20\n";

    /// Makes a folder `open` with files, and a file beside the folder.
    fn desk() -> (tempfile::TempDir, ControlFiles) {
        let desk = tempfile::tempdir().unwrap();
        let open = desk.path().join("open");
        std::fs::create_dir_all(open.join("deep")).unwrap();
        for file in ["open/a.trace", "open/deep/b.trace", "secret.trace"] {
            std::fs::write(desk.path().join(file), TRACE).unwrap();
        }
        let files = ControlFiles { folder: Some(open.canonicalize().unwrap()) };
        (desk, files)
    }

    fn refused(files: &ControlFiles, path: &Path) -> io::ErrorKind {
        files.read(&LinkKeys::default(), Path::new(""), path).unwrap_err().kind()
    }

    #[test]
    fn files_of_the_folder_are_read_and_no_others() {
        let (desk, files) = desk();
        let at = |name: &str| desk.path().join(name);
        for name in ["open/a.trace", "open/deep/b.trace", "open/./deep/b.trace"] {
            assert_eq!(files.read(&LinkKeys::default(), Path::new(""), &at(name)).unwrap(), TRACE.as_bytes(), "{name}");
        }
        symlink(at("open/a.trace"), at("open/inside")).unwrap();
        assert_eq!(files.read(&LinkKeys::default(), Path::new(""), &at("open/inside")).unwrap(), TRACE.as_bytes());
        symlink(at("secret.trace"), at("open/leads-out")).unwrap();
        symlink(desk.path(), at("open/up")).unwrap();
        for name in ["secret.trace", "open/../secret.trace", "open/deep/../a.trace", "open/leads-out", "open/up/secret.trace", "open/none", "none"] {
            assert_eq!(refused(&files, &at(name)), io::ErrorKind::PermissionDenied, "{name}");
        }
        let none = ControlFiles::default();
        let said = |path: &Path| none.read(&LinkKeys::default(), Path::new(""), path).unwrap_err().to_string();
        assert_eq!(said(&at("open/a.trace")), said(Path::new("/none")), "nobody learns which files there are");
    }

    /// A read of a pipe without a writer never ends, so this test would not return if the pipe were read.
    #[test]
    fn what_is_no_regular_file_is_not_waited_for() {
        let (desk, files) = desk();
        let pipe = desk.path().join("open/pipe");
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for path in [pipe, desk.path().join("open/deep")] {
            let error = files.read(&LinkKeys::default(), Path::new(""), &path).unwrap_err();
            assert_eq!(error.to_string(), "it is not a regular file");
        }
    }

    #[test]
    fn a_file_that_the_user_named_may_be_named_again() {
        let (desk, _) = desk();
        let keys = LinkKeys::default().with("trace", "\"secret.trace\"").with("jitter", "{ sd = \"1ms\", distribution = { table = \"none.dist\" } }");
        let none = ControlFiles::default();
        let path = desk.path().join("secret.trace");
        assert_eq!(none.read(&keys, desk.path(), &path).unwrap(), TRACE.as_bytes());
        assert_eq!(none.read(&keys, desk.path(), &desk.path().join("none.dist")).unwrap_err().kind(), io::ErrorKind::NotFound);
        assert_eq!(none.read(&keys, desk.path(), &desk.path().join("open/a.trace")).unwrap_err().kind(), io::ErrorKind::PermissionDenied);
    }
}
