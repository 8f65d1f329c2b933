//! The firmware, as bytes of a file that the user has.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// A firmware image. It is Novint's and no part of this program: the user gives the path of a file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Firmware {
    bytes: Vec<u8>,
}

impl Firmware {
    /// No image is shorter \[bytes\]. Those that are known have 7,324 to 8,492.
    pub const SHORTEST: usize = 1024;
    /// No image is longer \[bytes\].
    pub const LONGEST: usize = 65_536;

    /// An image.
    ///
    /// # Errors
    ///
    /// [`FirmwareError::Length`] if it cannot be one.
    pub fn new(bytes: Vec<u8>) -> Result<Self, FirmwareError> {
        if !(Self::SHORTEST..=Self::LONGEST).contains(&bytes.len()) {
            return Err(FirmwareError::Length { least: bytes.len() });
        }
        Ok(Self { bytes })
    }

    /// Reads a file. No more of it is read than an image can have.
    ///
    /// # Errors
    ///
    /// [`FirmwareError`] if it cannot be read or cannot be an image.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FirmwareError> {
        let path = path.as_ref();
        let failed = |error| FirmwareError::Read { path: path.to_owned(), error };
        let mut bytes = Vec::new();
        File::open(path).map_err(failed)?.take(Self::LONGEST as u64 + 1).read_to_end(&mut bytes).map_err(failed)?;
        Self::new(bytes)
    }

    /// Its bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// A file that is no firmware.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
pub enum FirmwareError {
    #[error("the firmware {} cannot be read: {error}", path.display())]
    Read { path: PathBuf, error: io::Error },
    #[error("a firmware has 1024 to 65536 bytes, and this has {least}{}", if *least > Firmware::LONGEST { " or more" } else { "" })]
    Length {
        /// How many bytes it has, or at least has.
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
        file.as_file().set_len(1 << 40).unwrap();
        let error = Firmware::read(file.path()).unwrap_err().to_string();
        assert!(error.contains("65537 or more"), "{error}");
        assert!(Firmware::read("/nowhere/at/all").unwrap_err().to_string().contains("/nowhere/at/all"));
    }
}
