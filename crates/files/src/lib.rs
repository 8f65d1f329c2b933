//! Files: read up to a limit, written as a whole, and shared by processes on several machines.
//!
//! You need it if your program reads files that may be too long, must never leave half a file under its name, or shares a folder with processes elsewhere
//! ([`Lease`]).
//!
//! A regular file that is longer than the limit is refused before it is read. A pipe or a device has no length and is read up to the limit.
//!
//! The feature `write` has all that writes. A file has its name only when it is whole ([`WholeFile`]). Files that belong together lie in a folder into which
//! one process at a time writes ([`OwnFolder`]).
//! ```
//! use std::io::Write as _;
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("link.toml");
//! cohaptic_files::write_whole(&path, |file| file.write_all(b"delay = \"24ms\""))?;
//! assert_eq!(cohaptic_files::read_text(&path)?, "delay = \"24ms\"");
//! # Ok::<(), std::io::Error>(())
//! ```

#[cfg(feature = "write")]
mod continued;
#[cfg(feature = "write")]
mod folder;
#[cfg(feature = "write")]
mod lease;
#[cfg(feature = "write")]
mod lock;
#[cfg(feature = "write")]
mod partial;
#[cfg(feature = "write")]
mod scratch;
mod secret;
#[cfg(feature = "write")]
mod standard_output;
#[cfg(feature = "write")]
mod target;
#[cfg(feature = "write")]
mod whole;

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

pub use secret::open_to_others;
#[cfg(feature = "write")]
pub use {
    continued::open_continued,
    folder::{FOLDER_LOCK, OwnFolder},
    lease::{BEAT, Holder, Lease, Owner, STALE, Taking, leases},
    lock::Lock,
    partial::PARTIAL,
    scratch::ScratchFile,
    standard_output::print,
    whole::{WholeFile, write_whole, write_whole_by},
};

/// The most bytes of a TOML file, 16 MiB: a scene, or a file of links, of a relay or of a router. The tree of a text takes fifty times its length.
pub const MOST_TOML_BYTES: u64 = 16 << 20;

/// The most bytes of another file that is read as a whole, 256 MiB: a trace, a replay of a scene, recorded motion, a table of a distribution, inputs,
/// measurements, weights.
pub const MOST_BYTES: u64 = 256 << 20;

/// The most bytes of a file that is read piece by piece, 4 GiB: a capture, a log of fates, a part of a campaign.
pub const MOST_CAPTURE_BYTES: u64 = 4 << 30;

/// Opens a file that is read piece by piece and from several places, with a limit of its length \[bytes\].
///
/// # Errors
///
/// As [`LimitedFile::open`].
pub fn open(path: &Path, most: u64) -> io::Result<File> {
    LimitedFile::open(path, most).map(|limited| limited.file)
}

/// The bytes of a file.
///
/// # Errors
///
/// The error of the system; and [`io::ErrorKind::FileTooLarge`] beyond [`MOST_BYTES`].
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    read_bytes_up_to(path, MOST_BYTES)
}

/// The bytes of a file, with a limit of their number.
///
/// # Errors
///
/// The error of the system; and [`io::ErrorKind::FileTooLarge`] beyond the limit.
pub fn read_bytes_up_to(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut from = LimitedFile::open(path, most)?;
    let mut bytes = Vec::new();
    from.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The text of a file.
///
/// # Errors
///
/// As [`read_bytes`], and [`io::ErrorKind::InvalidData`] for bytes that are no UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    read_text_up_to(path, MOST_BYTES)
}

/// The text of a file, with a limit of its length \[bytes\].
///
/// # Errors
///
/// As [`read_bytes_up_to`], and [`io::ErrorKind::InvalidData`] for bytes that are no UTF-8.
pub fn read_text_up_to(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(read_bytes_up_to(path, most)?).map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is no text: expected UTF-8"))
}

/// A file that is read up to a limit, beyond which there is an error.
#[derive(Debug)]
pub struct LimitedFile {
    file: File,
    most: u64,
    left: u64,
}

impl LimitedFile {
    /// Opens a file with a limit of its length \[bytes\].
    ///
    /// # Errors
    ///
    /// The error of the system; and [`io::ErrorKind::FileTooLarge`] for a regular file that is longer.
    pub fn open(path: &Path, most: u64) -> io::Result<Self> {
        Self::of(File::open(path)?, most)
    }

    /// Puts a limit \[bytes\] on an open file.
    ///
    /// # Errors
    ///
    /// As [`LimitedFile::open`].
    pub fn of(file: File, most: u64) -> io::Result<Self> {
        Self { file, most, left: most }.limited_to(most)
    }

    /// The file with a lower limit of its length \[bytes\], once the bytes that were read have shown of which kind it is.
    ///
    /// # Errors
    ///
    /// The error of the system; and [`io::ErrorKind::FileTooLarge`] for a regular file that is longer, or if more was read.
    pub fn limited_to(self, most: u64) -> io::Result<Self> {
        let about = self.file.metadata()?;
        let read = self.most - self.left;
        let left = most.checked_sub(read).filter(|_| !about.is_file() || about.len() <= most);
        left.map(|left| Self { most, left, ..self }).ok_or_else(|| too_large(most))
    }
}

impl Read for LimitedFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // One byte more, to tell the end of the file from that of the limit.
        let room = usize::try_from(self.left.saturating_add(1)).unwrap_or(usize::MAX).min(buffer.len());
        let count = self.file.read(&mut buffer[..room])?;
        match self.left.checked_sub(count as u64) {
            Some(left) => {
                self.left = left;
                Ok(count)
            }
            None => Err(too_large(self.most)),
        }
    }
}

fn too_large(most: u64) -> io::Error {
    let mebibytes = most >> 20;
    io::Error::new(io::ErrorKind::FileTooLarge, format!("it is longer than {mebibytes} MiB: expected a file of at most that"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(length: usize) -> tempfile::NamedTempFile {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), vec![b'a'; length]).unwrap();
        file
    }

    fn read(path: &Path, most: u64) -> io::Result<usize> {
        let mut bytes = Vec::new();
        LimitedFile::open(path, most)?.read_to_end(&mut bytes)
    }

    #[test]
    fn a_file_of_the_limit_is_read_and_one_byte_more_is_refused() {
        assert_eq!(read(file(100).path(), 100).unwrap(), 100);
        assert_eq!(read(file(101).path(), 100).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        assert_eq!(read(file(0).path(), 0).unwrap(), 0);
    }

    #[test]
    fn a_limit_is_lowered_once_the_kind_of_a_file_is_known() {
        let path = file(100);
        let begun = || {
            let mut from = LimitedFile::open(path.path(), 1000).unwrap();
            from.read_exact(&mut [0; 10]).unwrap();
            from
        };
        let mut rest = Vec::new();
        begun().limited_to(100).unwrap().read_to_end(&mut rest).unwrap();
        assert_eq!(rest.len(), 90);
        assert_eq!(begun().limited_to(99).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
    }

    #[test]
    fn what_is_no_text_is_refused_as_such() {
        let file = file(0);
        std::fs::write(file.path(), b"a\xff").unwrap();
        assert_eq!(read_text(file.path()).unwrap_err().to_string(), "it is no text: expected UTF-8");
        std::fs::write(file.path(), "ä").unwrap();
        assert_eq!(read_text(file.path()).unwrap(), "ä");
    }

    /// It has no length, and no end.
    #[test]
    #[cfg(unix)]
    fn a_device_is_read_up_to_the_limit() {
        let error = read(Path::new("/dev/zero"), 1 << 20).unwrap_err();
        assert_eq!(
            (error.kind(), error.to_string().as_str()),
            (io::ErrorKind::FileTooLarge, "it is longer than 1 MiB: expected a file of at most that")
        );
    }
}
