//! The key of a session: 32 bytes that all its participants have.

mod file;

use core::fmt;

use zeroize::Zeroizing;

use crate::{Entropy, EntropyError};

pub use file::KeyFileError;

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
