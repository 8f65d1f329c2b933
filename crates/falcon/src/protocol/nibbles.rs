//! Sixteen-bit numbers as four letters.

use super::{END, PACKET, START};

/// Offset of a nibble: 0 is sent as `A`, 15 as `P`.
pub const BASE: u8 = b'A';

/// Returns the four letters of a number, the least significant nibble first.
#[must_use]
pub const fn encode(value: i16) -> [u8; 4] {
    let [low, high] = value.to_le_bytes();
    [BASE + (low & 0xF), BASE + (low >> 4), BASE + (high & 0xF), BASE + (high >> 4)]
}

/// Returns the number of four letters; `None` for a letter outside of `A` to `P`.
#[must_use]
pub const fn decode(letters: [u8; 4]) -> Option<i16> {
    let [a, b, c, d] = letters;
    if !(is_letter(a) && is_letter(b) && is_letter(c) && is_letter(d)) {
        return None;
    }
    Some(i16::from_le_bytes([(a - BASE) | ((b - BASE) << 4), (c - BASE) | ((d - BASE) << 4)]))
}

/// Returns whether a byte stands for a nibble.
#[must_use]
pub(crate) const fn is_letter(byte: u8) -> bool {
    byte >= BASE && byte <= BASE + 0xF
}

/// Returns a packet with three numbers at the indexes 1 to 12, and `thirteenth` plus the base at index 13.
pub(super) fn packet(values: [i16; 3], thirteenth: u8) -> [u8; PACKET] {
    let mut packet = [BASE; PACKET];
    packet[0] = START;
    for (place, value) in packet[1..13].chunks_exact_mut(4).zip(values) {
        place.copy_from_slice(&encode(value));
    }
    packet[13] = BASE + thirteenth;
    packet[15] = END;
    packet
}

/// Returns the three numbers of a packet and the value at index 13 without the base, or the index of the first byte that is not allowed at its place. The
/// byte at index 14 is ignored.
pub(super) fn contents(packet: &[u8; PACKET], is_thirteenth: impl Fn(u8) -> bool) -> Result<([i16; 3], u8), usize> {
    let is_wrong = |at: usize| match at {
        0 => packet[at] != START,
        13 => !is_thirteenth(packet[at]),
        14 => false,
        15 => packet[at] != END,
        _ => !is_letter(packet[at]),
    };
    if let Some(wrong) = (0..PACKET).find(|at| is_wrong(*at)) {
        return Err(wrong);
    }
    let mut values = [0; 3];
    for (place, value) in packet[1..13].chunks_exact(4).zip(&mut values) {
        // The letters are checked above, so the default is never used.
        *value = decode([place[0], place[1], place[2], place[3]]).unwrap_or_default();
    }
    Ok((values, packet[13] - BASE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_comes_back() {
        for value in i16::MIN..=i16::MAX {
            assert_eq!(decode(encode(value)), Some(value));
        }
    }

    #[test]
    fn the_published_example() {
        // The letters JFKP are 0xFA59.
        assert_eq!(decode(*b"JFKP"), Some(-1447));
        assert_eq!(encode(-1447), *b"JFKP");
        assert_eq!(encode(0), *b"AAAA");
    }

    #[test]
    fn what_is_no_letter_is_no_number() {
        for byte in (0..=u8::MAX).filter(|byte| !(b'A'..=b'P').contains(byte)) {
            for place in 0..4 {
                let mut letters = *b"AAAA";
                letters[place] = byte;
                assert_eq!(decode(letters), None, "{byte:#x} at {place}");
            }
        }
    }
}
