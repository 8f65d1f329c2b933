//! The key of a session: 32 bytes that all its participants have.

use core::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use zeroize::Zeroizing;

use crate::{Entropy, EntropyError};

/// The length of a session key \[byte\].
const KEY_LEN: usize = 32;

/// The secret of a session. A program that has it may take any seat of the session; it does not tell peers from each other.
///
/// It is overwritten when it is dropped, and never printed.
#[derive(Clone)]
pub struct SessionKey(Zeroizing<[u8; KEY_LEN]>);

impl SessionKey {
    /// That key. It should be drawn at random: see [`SessionKey::generate`].
    #[must_use]
    pub fn from_bytes(bytes: [u8; KEY_LEN]) -> Self {
        Self(Zeroizing::new(bytes))
    }

    /// A new key.
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

/// No key file, of 64 hexadecimal digits and then at most white space (text, as `openssl rand -hex 32` makes it), is longer \[byte\]: what follows is not looked at, so that a wrong path cannot fill the memory.
const MAX_FILE_LEN: u16 = 1024;

/// Why a key file was not read or written.
#[derive(Debug, thiserror::Error)]
pub enum KeyFileError {
    /// It cannot be opened or read.
    #[error("cannot read the key file {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Others than its owner may read or change it.
    #[error("the key file {0} is open to others than its owner (mode {mode:03o}); close it with: chmod 600 {0}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// Its permissions.
        mode: u32,
    },
    /// It is no key.
    #[error("{} is no key file: it must hold 64 hexadecimal digits and nothing else; make one with: cohaptic live --new-key FILE", path.display())]
    Content {
        /// The file.
        path: PathBuf,
    },
    /// It cannot be made. A file that is there already is never replaced.
    #[error("cannot make the key file {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// There are no random bytes.
    #[error(transparent)]
    Entropy(#[from] EntropyError),
}

impl SessionKey {
    /// Reads a key file.
    ///
    /// # Errors
    ///
    /// [`KeyFileError`] if it cannot be read, if others than its owner may read or change it (on Unix; elsewhere nobody asks), or if it does not
    /// hold exactly 64 hexadecimal digits, with white space after them at most.
    pub fn read_from(path: impl AsRef<Path>) -> Result<Self, KeyFileError> {
        let path = path.as_ref();
        let read_error = |source| KeyFileError::Read { path: path.to_owned(), source };
        let file = File::open(path).map_err(read_error)?;
        if let Some(mode) = cohaptic_files::open_to_others(&file).map_err(read_error)? {
            return Err(KeyFileError::Open { path: path.to_owned(), mode });
        }
        // One allocation, so that no copy of the text is left behind by a growing buffer.
        let mut text = Zeroizing::new(Vec::with_capacity(2 * usize::from(MAX_FILE_LEN)));
        file.take(u64::from(MAX_FILE_LEN) + 1).read_to_end(&mut text).map_err(read_error)?;
        parse(&text).ok_or_else(|| KeyFileError::Content { path: path.to_owned() })
    }

    /// Draws a new key and writes it to a new file that only its owner may read. The content is on the disk when this returns.
    ///
    /// # Errors
    ///
    /// [`KeyFileError`] if there are no random bytes, if the file is there already, or if it cannot be written.
    pub fn generate_to(path: impl AsRef<Path>, entropy: &mut impl Entropy) -> Result<Self, KeyFileError> {
        let path = path.as_ref();
        let key = Self::generate(entropy)?;
        let mut text = Zeroizing::new(String::with_capacity(2 * KEY_LEN + 1));
        for byte in key.as_bytes() {
            for nibble in [byte >> 4, byte & 0x0f] {
                text.push(char::from(b"0123456789abcdef"[usize::from(nibble)]));
            }
        }
        text.push('\n');
        let write = || {
            let mut file = new_file_options().open(path)?;
            file.write_all(text.as_bytes())?;
            file.sync_all()
        };
        write().map_err(|source| KeyFileError::Write { path: path.to_owned(), source })?;
        Ok(key)
    }
}

fn new_file_options() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options
}

fn parse(text: &[u8]) -> Option<SessionKey> {
    let (digits, rest) = text.split_at_checked(2 * KEY_LEN)?;
    if text.len() > usize::from(MAX_FILE_LEN) || !rest.iter().all(u8::is_ascii_whitespace) {
        return None;
    }
    let mut key = Zeroizing::new([0; KEY_LEN]);
    for (byte, pair) in key.iter_mut().zip(digits.chunks_exact(2)) {
        *byte = nibble(pair[0])? << 4 | nibble(pair[1])?;
    }
    Some(SessionKey(key))
}

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
