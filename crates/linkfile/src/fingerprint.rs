//! Fingerprint of 64 bits, which tells whether two texts or files are the same.

use core::fmt::{self, Write as _};
use core::str::FromStr;

/// Hash of a text or of bytes: FNV-1a of 64 bits (Fowler, Noll & Vo 1991). Different texts almost never have the same fingerprint by accident, but a person
/// can construct two such texts.
///
/// The display form is 16 hexadecimal digits, which [`FromStr`] reads back.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Fingerprint(u64);

impl Fingerprint {
    /// Hash of the empty text: the offset basis of FNV.
    const NONE: Self = Self(0xcbf2_9ce4_8422_2325);

    /// Returns the fingerprint of a text.
    #[must_use]
    pub fn of(text: impl fmt::Display) -> Self {
        let mut fingerprint = Self::NONE;
        // `write_str` below never fails. An implementation of `Display` that fails gives the fingerprint of the text up to the failure.
        let _ = write!(fingerprint, "{text}");
        fingerprint
    }

    /// Returns the fingerprint of bytes.
    #[must_use]
    pub(crate) fn of_bytes(bytes: &[u8]) -> Self {
        Self::NONE.and(bytes)
    }

    /// Returns the fingerprint as a number.
    #[must_use]
    pub const fn get(self) -> u64 {
        self.0
    }

    /// Continues the hash with more bytes.
    fn and(self, bytes: &[u8]) -> Self {
        // FNV-1a mixes the byte in before the multiplication, FNV-1 after the multiplication.
        Self(bytes.iter().fold(self.0, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)))
    }
}

impl fmt::Write for Fingerprint {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        *self = self.and(text.as_bytes());
        Ok(())
    }
}

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

/// Error: a text is no fingerprint.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("expected 16 hexadecimal digits")]
pub struct FingerprintError;

impl FromStr for Fingerprint {
    type Err = FingerprintError;

    fn from_str(text: &str) -> Result<Self, FingerprintError> {
        // `from_str_radix` also takes a sign, so the digits are checked here.
        let digits = text.len() == 16 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        u64::from_str_radix(text, 16).ok().filter(|_| digits).map(Self).ok_or(FingerprintError)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published values of FNV-1a of 64 bits (Fowler, Noll & Vo; `draft-eastlake-fnv`, appendix C).
    #[test]
    fn fingerprints_are_fnv_1a() {
        for (text, number) in [("", 0xcbf2_9ce4_8422_2325), ("a", 0xaf63_dc4c_8601_ec8c), ("foobar", 0x8594_4171_f739_67e8)] {
            assert_eq!(Fingerprint::of(text).get(), number);
            assert_eq!(Fingerprint::of_bytes(text.as_bytes()).get(), number);
        }
        assert_eq!("85944171f73967e8".parse(), Ok(Fingerprint::of("foobar")));
        for text in ["", "85944171f73967e", "85944171f73967e80", "+5944171f73967e8", "85944171f73967eg"] {
            assert_eq!(text.parse::<Fingerprint>(), Err(FingerprintError), "{text}");
        }
    }
}
