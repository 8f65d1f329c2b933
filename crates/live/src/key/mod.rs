//! Session key: 32 secret bytes common to all participants of a session, and the key's file.

use core::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use zeroize::Zeroizing;

use crate::{Entropy, EntropyError};

/// Length of a session key \[byte\].
const KEY_LEN: usize = 32;

/// Secret of a session. A program with the key can take any seat of the session: the key does not tell peers apart.
///
/// The key is overwritten in memory when dropped, and never printed.
#[derive(Clone)]
pub struct SessionKey(Zeroizing<[u8; KEY_LEN]>);

impl SessionKey {
    /// Returns the key with the bytes `bytes`, which should be drawn at random: see [`SessionKey::generate`].
    #[must_use]
    pub fn from_bytes(bytes: [u8; KEY_LEN]) -> Self {
        Self(Zeroizing::new(bytes))
    }

    /// Returns a new key, drawn from `entropy`.
    ///
    /// # Errors
    ///
    /// [`EntropyError`] if the source has no random bytes.
    pub fn generate(entropy: &mut impl Entropy) -> Result<Self, EntropyError> {
        let mut bytes = Zeroizing::new([0; KEY_LEN]);
        entropy.fill(&mut bytes[..])?;
        Ok(Self(bytes))
    }

    pub(crate) fn as_bytes(&self) -> &[u8; KEY_LEN] {
        &self.0
    }
}

impl fmt::Debug for SessionKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SessionKey(secret)")
    }
}

/// Largest length of a key file \[byte\]. A key file is text: 64 hexadecimal digits, as from `openssl rand -hex 32`, followed by white space at most. Longer
/// files are refused, and at most one byte beyond this length is read, so that a wrong path cannot fill the memory.
const MAX_FILE_LEN: u16 = 1024;

/// Reason why a key file cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KeyFileError {
    /// The file cannot be opened or read.
    #[error("cannot read the key file {}: {source}", path.display())]
    Read {
        /// Path of the key file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// Other users than the owner may read or change the file.
    #[error("the key file {0} can be opened by others than its owner (mode {mode:03o}); close it with: chmod 600 {0}", path.display())]
    Open {
        /// Path of the key file.
        path: PathBuf,
        /// Permission bits of the file, such as 0o644.
        mode: u32,
    },
    /// The file does not hold a key.
    #[error("{} is not a key file: it must hold 64 hexadecimal digits and nothing else; make one with: cohaptic live --new-key FILE", path.display())]
    Content {
        /// Path of the key file.
        path: PathBuf,
    },
    /// The file exists already. A key is never replaced.
    #[error("the key file {} exists already and is never replaced: use this key, or name another file", path.display())]
    Exists {
        /// Path of the key file.
        path: PathBuf,
    },
    /// The file cannot be created or written.
    #[error("cannot make the key file {}: {source}", path.display())]
    Write {
        /// Path of the key file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// The system has no random bytes.
    #[error(transparent)]
    Entropy(#[from] EntropyError),
}

impl SessionKey {
    /// Reads a key file of at most 1024 bytes.
    ///
    /// # Errors
    ///
    /// [`KeyFileError`] if the file cannot be read, if other users than the owner may read or change the file (checked on Unix only), or if the content is not
    /// exactly 64 hexadecimal digits, followed by white space at most.
    pub fn read_from(path: impl AsRef<Path>) -> Result<Self, KeyFileError> {
        let path = path.as_ref();
        let read_error = |source| KeyFileError::Read { path: path.to_owned(), source };
        let file = File::open(path).map_err(read_error)?;
        if let Some(mode) = cohaptic_files::open_to_others(&file).map_err(read_error)? {
            return Err(KeyFileError::Open { path: path.to_owned(), mode });
        }
        // One allocation for the longest text: a growing buffer would leave copies of the key in memory.
        let mut text = Zeroizing::new(Vec::with_capacity(2 * usize::from(MAX_FILE_LEN)));
        // One byte more than allowed is read, so that `parse` can tell a too long file.
        file.take(u64::from(MAX_FILE_LEN) + 1).read_to_end(&mut text).map_err(read_error)?;
        parse(&text).ok_or_else(|| KeyFileError::Content { path: path.to_owned() })
    }

    /// Draws a new key and writes the key to a new file, readable by its owner only. The content is on the disk when this function returns.
    ///
    /// # Errors
    ///
    /// [`KeyFileError`] if there are no random bytes, if the file exists already, or if the file cannot be written.
    pub fn generate_to(path: impl AsRef<Path>, entropy: &mut impl Entropy) -> Result<Self, KeyFileError> {
        let path = path.as_ref();
        let key = Self::generate(entropy)?;
        let mut text = Zeroizing::new(String::with_capacity(2 * KEY_LEN + 1));
        for byte in key.as_bytes() {
            for nibble in [byte >> 4, byte & 0x0f] {
                // A nibble is below 16, the number of digits.
                text.push(char::from(b"0123456789abcdef"[usize::from(nibble)]));
            }
        }
        text.push('\n');
        let write = || {
            let mut file = new_file_options().open(path)?;
            file.write_all(text.as_bytes())?;
            file.sync_all()
        };
        write().map_err(|source| {
            let path = path.to_owned();
            if source.kind() == io::ErrorKind::AlreadyExists { KeyFileError::Exists { path } } else { KeyFileError::Write { path, source } }
        })?;
        Ok(key)
    }
}

/// Returns the options for creating a file for its owner only, with an error if the file exists. The mode is given on creation, so that the file is at no time
/// open to other users.
fn new_file_options() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options
}

/// Returns the key in the text of a key file, or `None` if the text is not a key.
fn parse(text: &[u8]) -> Option<SessionKey> {
    let (digits, rest) = text.split_at_checked(2 * KEY_LEN)?;
    if text.len() > usize::from(MAX_FILE_LEN) || !rest.iter().all(u8::is_ascii_whitespace) {
        return None;
    }
    let mut key = Zeroizing::new([0; KEY_LEN]);
    for (byte, pair) in key.iter_mut().zip(digits.chunks_exact(2)) {
        // `chunks_exact(2)` yields slices of two bytes.
        *byte = nibble(pair[0])? << 4 | nibble(pair[1])?;
    }
    Some(SessionKey(key))
}

/// Returns the value of a hexadecimal digit of either case.
const fn nibble(digit: u8) -> Option<u8> {
    match digit {
        b'0'..=b'9' => Some(digit - b'0'),
        b'a'..=b'f' => Some(digit - b'a' + 10),
        b'A'..=b'F' => Some(digit - b'A' + 10),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DIGITS: &str = "000102030405060708090a0b0c0d0e0f101112131415161718191A1B1C1D1E1F";

    #[test]
    fn a_key_is_64_digits_of_either_case_and_white_space_after_them() {
        let expected: [u8; KEY_LEN] = std::array::from_fn(|i| u8::try_from(i).unwrap());
        for tail in ["", "\n", "\r\n", "  \n\n"] {
            assert_eq!(parse(format!("{DIGITS}{tail}").as_bytes()).unwrap().as_bytes(), &expected);
        }
    }

    #[test]
    fn anything_else_is_no_key() {
        for text in ["", &DIGITS[1..], &format!("{DIGITS}0"), &format!(" {DIGITS}"), &DIGITS.replace('A', "G"), &format!("{DIGITS}\n{DIGITS}")] {
            assert!(parse(text.as_bytes()).is_none(), "{text:?}");
        }
        assert!(parse(&[0xff; 64]).is_none());
        assert!(parse(format!("{DIGITS}{}", " ".repeat(1000)).as_bytes()).is_none());
    }
}
