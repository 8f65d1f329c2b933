//! Decides where bytes written under a name must go: into a new file that is renamed, or into an existing stream.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Destination of bytes written under a name.
#[derive(Debug)]
pub(crate) enum Target {
    /// Path of a regular file, or of a file to be created, with all links resolved. The path can be replaced by a rename.
    Named(PathBuf),
    /// An open device, pipe, socket or file. Bytes are written at once, and the file of the name is never replaced.
    Stream(File),
}

/// Number of links that are followed before a name counts as a circle. Linux has the same limit.
const MOST_LINKS: u32 = 40;

impl Target {
    /// Resolves a name. Opens the name if it belongs to a stream; opening a pipe waits for the reader.
    ///
    /// # Errors
    ///
    /// The system's error, or [`ErrorKind::IsADirectory`] for a folder.
    pub(crate) fn of(path: &Path) -> io::Result<Self> {
        // The standard streams come first: a regular file that is standard output must not be renamed over.
        match fs::metadata(path) {
            Ok(about) if about.is_dir() => Err(ErrorKind::IsADirectory.into()),
            Ok(about) => match standard_stream(&about) {
                Some(stream) => Ok(Self::Stream(stream)),
                None if about.is_file() => Self::followed(path),
                None => open_stream(path, &about).map(Self::Stream),
            },
            // The target of a dangling link is created, as `open` with `O_CREAT` would do.
            Err(error) if error.kind() == ErrorKind::NotFound => Self::followed(path),
            Err(error) => Err(error),
        }
    }

    /// Returns the target to which the links of `path` lead. Follows the links one by one, because `canonicalize` fails for a file that does not exist yet.
    fn followed(path: &Path) -> io::Result<Self> {
        let mut name = path.to_path_buf();
        for _ in 0..MOST_LINKS {
            if !fs::symlink_metadata(&name).is_ok_and(|about| about.is_symlink()) {
                return Ok(Self::Named(name));
            }
            let folder = name.parent().unwrap_or_else(|| Path::new("")).to_path_buf();
            if is_of_processes(&folder) {
                // Appends, because a shell has already truncated the file for `3> rows.csv`, and must keep the old rows for `3>> rows.csv`.
                return File::options().append(true).open(path).map(Self::Stream);
            }
            name = folder.join(fs::read_link(&name)?);
        }
        Err(io::Error::other("too many links lead from one to the next"))
    }
}

/// Returns whether the links in a folder stand for open files of a process, as `/dev/fd/3` does. The text of such a link need not be a path to the file:
/// the file may be deleted or belong to another root.
fn is_of_processes(folder: &Path) -> bool {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    fs::canonicalize(folder).is_ok_and(|folder| folder.starts_with("/proc"))
}

/// Returns standard output or standard error if either of the two is the file `about`. A file opened a second time would be written from its beginning,
/// over the text that was printed before.
#[cfg(unix)]
fn standard_stream(about: &Metadata) -> Option<File> {
    use std::os::fd::AsFd as _;
    use std::os::unix::fs::MetadataExt as _;
    let is_same = |stream: &File| stream.metadata().is_ok_and(|open| (open.dev(), open.ino()) == (about.dev(), about.ino()));
    let streams = [io::stdout().as_fd().try_clone_to_owned(), io::stderr().as_fd().try_clone_to_owned()];
    streams.into_iter().flatten().map(File::from).find(is_same)
}

#[cfg(not(unix))]
fn standard_stream(_: &Metadata) -> Option<File> {
    None
}

/// Opens a device or a pipe for writing, or connects to a socket, which `open` refuses.
#[cfg(unix)]
fn open_stream(path: &Path, about: &Metadata) -> io::Result<File> {
    use std::os::{fd::OwnedFd, unix::fs::FileTypeExt as _, unix::net::UnixStream};
    if about.file_type().is_socket() {
        return UnixStream::connect(path).map(|socket| File::from(OwnedFd::from(socket)));
    }
    File::options().write(true).open(path)
}

#[cfg(not(unix))]
fn open_stream(path: &Path, _: &Metadata) -> io::Result<File> {
    File::options().write(true).open(path)
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use std::io::{Read as _, Write as _};
    use std::os::unix::fs::{FileTypeExt as _, symlink};
    use std::os::unix::net::UnixListener;
    use std::process::Command;

    use super::*;
    use crate::write_whole;

    fn write(path: &Path, text: &str) -> io::Result<()> {
        write_whole(path, |file| file.write_all(text.as_bytes()))
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_link_is_followed_to_a_file_and_to_a_free_name() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("elsewhere")).unwrap();
        fs::write(at("elsewhere/there"), "old").unwrap();
        symlink("elsewhere/to-there", at("link")).unwrap();
        symlink("there", at("elsewhere/to-there")).unwrap();
        symlink("elsewhere/free", at("dangling")).unwrap();
        for (link, file) in [("link", "elsewhere/there"), ("dangling", "elsewhere/free")] {
            write(&at(link), "new").unwrap();
            assert!(fs::symlink_metadata(at(link)).unwrap().is_symlink(), "{link}");
            assert_eq!(fs::read_to_string(at(file)).unwrap(), "new");
        }
        assert_eq!(names(&at("elsewhere")), ["free", "there", "to-there"]);
        symlink("circle", at("circle")).unwrap();
        assert!(write(&at("circle"), "new").is_err() && fs::symlink_metadata(at("circle")).unwrap().is_symlink());
    }

    #[test]
    fn a_pipe_has_all_bytes_and_stays_a_pipe() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        // Open at both ends, so that nothing waits if the pipe is not written to.
        let open = File::options().read(true).write(true).open(&pipe).unwrap();
        let reader = File::open(&pipe).unwrap();
        let text = "row\n".repeat(100_000);
        let read = std::thread::spawn(move || io::read_to_string(reader).unwrap());
        write(&pipe, &text).unwrap();
        drop(open);
        assert!(read.join().unwrap() == text);
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
        assert_eq!(names(folder.path()), ["pipe"]);
    }

    #[test]
    fn a_socket_has_all_bytes_and_stays_a_socket() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("socket");
        let listener = UnixListener::bind(&path).unwrap();
        write(&path, "row\n").unwrap();
        listener.set_nonblocking(true).unwrap();
        let mut text = String::new();
        listener.accept().unwrap().0.read_to_string(&mut text).unwrap();
        assert_eq!((text.as_str(), fs::metadata(&path).unwrap().file_type().is_socket()), ("row\n", true));
    }

    /// Uses links to devices, so that a fault in this crate replaces a link and not a device.
    #[test]
    #[cfg(target_os = "linux")]
    fn a_device_is_written_to_and_its_errors_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let [null, full] = ["null", "full"].map(|device| folder.path().join(device));
        for device in [&null, &full] {
            symlink(Path::new("/dev").join(device.file_name().unwrap()), device).unwrap();
        }
        write(&null, "row\n").unwrap();
        assert_eq!(write(&full, "row\n").unwrap_err().kind(), ErrorKind::StorageFull);
        assert_eq!(names(folder.path()), ["full", "null"]);
        assert!([null, full].iter().all(|device| fs::metadata(device).unwrap().file_type().is_char_device()));
    }

    /// The shell command `program --csv /dev/fd/3 3>> rows.csv` does this.
    #[test]
    #[cfg(target_os = "linux")]
    fn a_file_that_is_open_is_added_to() {
        use std::os::fd::AsRawFd as _;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.csv");
        fs::write(&path, "first\n").unwrap();
        let mut open = File::options().append(true).open(&path).unwrap();
        write(Path::new(&format!("/dev/fd/{}", open.as_raw_fd())), "second\n").unwrap();
        open.write_all(b"third\n").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "first\nsecond\nthird\n");
    }

    #[test]
    fn a_folder_is_refused_before_anything_is_written() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Target::of(folder.path()).unwrap_err().kind(), ErrorKind::IsADirectory);
        assert_eq!(names(folder.path()), [""; 0]);
    }
}
