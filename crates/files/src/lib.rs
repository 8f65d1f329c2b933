//! Reads files up to a limit, writes files as a whole, and shares folders with processes on other machines.
//!
//! Use this crate if your program reads files of unknown length, must never leave half a file under its final name, or shares a folder with processes on
//! other machines ([`Lease`]).
//!
//! Reading: a regular file longer than the limit is refused before its first byte is read. A pipe or a device has no length; reading fails at the first
//! byte beyond the limit.
//!
//! Writing needs the feature `write`. A file gets its final name only when all bytes are on the disk ([`WholeFile`]). For several files with one author,
//! [`OwnFolder`] keeps other processes out of a folder.
//!
//! The crate does not know what the files contain: callers choose the limit and parse the bytes.
//!
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

/// Upper limit of the length of a TOML file \[byte\], 16 MiB: a scene, or a file of links, of a relay or of a router. Lower than [`MOST_BYTES`], because
/// the tree of a parsed text takes about fifty times the length of the text.
pub const MOST_TOML_BYTES: u64 = 16 << 20;

/// Upper limit of the length of any other file read into memory as a whole \[byte\], 256 MiB: a trace, a replay of a scene, recorded motion, a table of a
/// distribution, inputs, measurements, weights.
pub const MOST_BYTES: u64 = 256 << 20;

/// Upper limit of the length of a file that is read piece by piece \[byte\], 4 GiB: a capture, a log of fates, a part of a campaign.
pub const MOST_CAPTURE_BYTES: u64 = 4 << 30;

/// Opens a file for readers that seek, if the file is at most `most` bytes long. Only this call checks the length: reads from the returned file are not
/// limited.
///
/// # Errors
///
/// The errors of [`LimitedFile::open`].
pub fn open(path: &Path, most: u64) -> io::Result<File> {
    LimitedFile::open(path, most).map(|limited| limited.file)
}

/// Returns all bytes of a file.
///
/// # Errors
///
/// The system's error, or [`io::ErrorKind::FileTooLarge`] for a file longer than [`MOST_BYTES`].
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    read_bytes_up_to(path, MOST_BYTES)
}

/// Returns all bytes of a file of at most `most` bytes.
///
/// # Errors
///
/// The system's error, or [`io::ErrorKind::FileTooLarge`] for a file longer than `most` bytes.
pub fn read_bytes_up_to(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut from = LimitedFile::open(path, most)?;
    let mut bytes = Vec::new();
    from.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Returns the text of a file.
///
/// # Errors
///
/// The errors of [`read_bytes`], and [`io::ErrorKind::InvalidData`] for bytes that are not UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    read_text_up_to(path, MOST_BYTES)
}

/// Returns the text of a file of at most `most` bytes.
///
/// # Errors
///
/// The errors of [`read_bytes_up_to`], and [`io::ErrorKind::InvalidData`] for bytes that are not UTF-8.
pub fn read_text_up_to(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(read_bytes_up_to(path, most)?).map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not a text: expected UTF-8"))
}

/// An open file whose reads fail with [`io::ErrorKind::FileTooLarge`] once more than a given number of bytes was read.
#[derive(Debug)]
pub struct LimitedFile {
    /// File to read from.
    file: File,
    /// Limit \[byte\], counted from the first read.
    most: u64,
    /// Bytes that may still be read before the limit.
    left: u64,
}

impl LimitedFile {
    /// Opens a file of at most `most` bytes.
    ///
    /// # Errors
    ///
    /// The system's error, or [`io::ErrorKind::FileTooLarge`] for a regular file longer than `most` bytes.
    pub fn open(path: &Path, most: u64) -> io::Result<Self> {
        Self::of(File::open(path)?, most)
    }

    /// Limits reads of an open file to `most` bytes, counted from its present position.
    ///
    /// # Errors
    ///
    /// The errors of [`LimitedFile::open`], without the errors of opening.
    pub fn of(file: File, most: u64) -> io::Result<Self> {
        Self { file, most, left: most }.limited_to(most)
    }

    /// Replaces the limit by a lower one, `most` bytes. Bytes already read count towards the new limit. A caller does so after the first bytes have shown
    /// the kind of the file.
    ///
    /// # Errors
    ///
    /// The system's error, or [`io::ErrorKind::FileTooLarge`] if the file is a regular file longer than `most` bytes, or if more than `most` bytes were read.
    pub fn limited_to(self, most: u64) -> io::Result<Self> {
        let about = self.file.metadata()?;
        let read = self.most - self.left;
        // Pipes and devices report a length of zero, whatever they will deliver. `read` limits them.
        let left = most.checked_sub(read).filter(|_| !about.is_file() || about.len() <= most);
        left.map(|left| Self { most, left, ..self }).ok_or_else(|| too_large(most))
    }
}

impl Read for LimitedFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // Asks for a byte beyond the limit, to distinguish a file of exactly `most` bytes from a longer file.
        let room = usize::try_from(self.left.saturating_add(1)).unwrap_or(usize::MAX).min(buffer.len());
        let count = self.file.read(&mut buffer[..room])?;
        // Fails only if the byte beyond the limit was really there.
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
    // All limits in use are whole mebibytes, so the shift loses nothing.
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
        assert_eq!(read_text(file.path()).unwrap_err().to_string(), "it is not a text: expected UTF-8");
        std::fs::write(file.path(), "ä").unwrap();
        assert_eq!(read_text(file.path()).unwrap(), "ä");
    }

    /// `/dev/zero` has no length and no end.
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
