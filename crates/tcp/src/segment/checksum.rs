//! Internet checksum (RFC 1071).

/// Sum of 16-bit words in ones' complement, before the carries are folded.
#[derive(Clone, Copy, Default)]
pub(super) struct Sum(u64);

impl Sum {
    /// Adds octets as big-endian words of 16 bits. If the number of octets is odd, the last octet is padded with zero, so only the last call may add an odd
    /// number.
    pub(super) fn add(mut self, bytes: &[u8]) -> Self {
        // Words of 32 bits may be added in place of words of 16 bits, because 2^16 is 1 modulo 2^16 − 1. The carries are folded in `finish`. 64 bits hold
        // the sum of 2^32 words.
        let mut chunks = bytes.chunks_exact(8);
        for chunk in &mut chunks {
            if let [a, b, c, d, e, f, g, h] = *chunk {
                self.0 += u64::from(u32::from_be_bytes([a, b, c, d])) + u64::from(u32::from_be_bytes([e, f, g, h]));
            }
        }
        for pair in chunks.remainder().chunks(2) {
            self.0 += u64::from(u16::from_be_bytes([pair[0], pair.get(1).copied().unwrap_or(0)]));
        }
        self
    }

    /// Adds words of a pseudo header, given as their sum.
    pub(super) const fn add_word(self, word: u64) -> Self {
        Self(self.0 + word)
    }

    /// Returns the checksum. Returns zero if the added octets contain their own correct checksum.
    pub(super) fn finish(self) -> u16 {
        let mut sum = self.0;
        while sum > 0xffff {
            sum = (sum & 0xffff) + (sum >> 16);
        }
        !u16::try_from(sum).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_of_rfc_1071() {
        let sum = Sum::default().add(&[0x00, 0x01, 0xf2, 0x03, 0xf4, 0xf5, 0xf6, 0xf7]);
        assert_eq!(sum.finish(), !0xddf2);
    }

    #[test]
    fn octets_beyond_the_eighth_and_an_odd_one_count() {
        let mut bytes = *b"a text of 21 octets !";
        let sum = Sum::default().add(&bytes).finish();
        let words = bytes.chunks(2).map(|pair| u32::from(pair[0]) * 256 + pair.get(1).map_or(0, |low| u32::from(*low))).sum::<u32>();
        assert_eq!(u32::from(!sum), words % 0xffff);
        bytes[20] ^= 1;
        assert_ne!(Sum::default().add(&bytes).finish(), sum);
    }
}
