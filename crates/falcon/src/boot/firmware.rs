//! Firmware image from a file of the user.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// A firmware image. The firmware is Novint's and no part of this program, so the user gives the path of a file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Firmware {
    bytes: Vec<u8>,
}

impl Firmware {
    /// Least length of an image \[bytes\]. Known images have 7,324 to 8,492 bytes.
    pub(crate) const SHORTEST: usize = 1024;
    /// Greatest length of an image \[bytes\].
    pub(crate) const LONGEST: usize = 65_536;

    /// Returns an image of these bytes.
    ///
    /// # Errors
    ///
    /// [`FirmwareError::Length`] for a length out of range.
    pub fn new(bytes: Vec<u8>) -> Result<Self, FirmwareError> {
        if !(Self::SHORTEST..=Self::LONGEST).contains(&bytes.len()) {
            return Err(FirmwareError::Length { least: bytes.len() });
        }
        Ok(Self { bytes })
    }

    /// Reads a file, at most one byte more than the greatest length of an image.
    ///
    /// # Errors
    ///
    /// [`FirmwareError`] if the file cannot be read, or has a length out of range.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FirmwareError> {
        let path = path.as_ref();
        let failed = |error| FirmwareError::Read { path: path.to_owned(), error };
        let mut bytes = Vec::new();
        // One byte beyond the greatest length tells a file that is too long, without reading all of it.
        File::open(path).map_err(failed)?.take(Self::LONGEST as u64 + 1).read_to_end(&mut bytes).map_err(failed)?;
        Self::new(bytes)
    }

    /// Returns the bytes of the image.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Error of a file that is no firmware.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
#[non_exhaustive]
pub enum FirmwareError {
    #[error("the firmware {} cannot be read: {error}", path.display())]
    Read { path: PathBuf, error: io::Error },
    #[error("a firmware has 1024 to 65536 bytes, and this has {least}{}", if *least > Firmware::LONGEST { " or more" } else { "" })]
    Length {
        /// Length of the file, or the number of bytes read of a longer file.
        least: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_checked_without_reading_it_all() {
        for (length, good) in [(0, false), (1023, false), (1024, true), (8492, true), (65_536, true), (65_537, false)] {
            assert_eq!(Firmware::new(vec![7; length]).is_ok(), good, "{length}");
        }
        let file = tempfile::NamedTempFile::new().unwrap();
        // A sparse file of a tebibyte: the read must stop after the greatest length of an image.
        file.as_file().set_len(1 << 40).unwrap();
        let error = Firmware::read(file.path()).unwrap_err().to_string();
        assert!(error.contains("65537 or more"), "{error}");
        assert!(Firmware::read("/nowhere/at/all").unwrap_err().to_string().contains("/nowhere/at/all"));
    }
}
