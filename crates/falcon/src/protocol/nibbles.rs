//! Sixteen-bit numbers as four letters.

/// The offset of a nibble: 0 travels as `A`, 15 as `P`.
pub const BASE: u8 = b'A';

/// Four letters for a number, least significant nibble first.
#[must_use]
pub const fn encode(value: i16) -> [u8; 4] {
    let [low, high] = value.to_le_bytes();
    [BASE + (low & 0xF), BASE + (low >> 4), BASE + (high & 0xF), BASE + (high >> 4)]
}

/// The number of four letters; `None` if one of them is not within `A` to `P`.
#[must_use]
pub const fn decode(letters: [u8; 4]) -> Option<i16> {
    let [a, b, c, d] = letters;
    if !(is_letter(a) && is_letter(b) && is_letter(c) && is_letter(d)) {
        return None;
    }
    Some(i16::from_le_bytes([(a - BASE) | ((b - BASE) << 4), (c - BASE) | ((d - BASE) << 4)]))
}

/// Whether a byte stands for a nibble.
#[must_use]
pub const fn is_letter(byte: u8) -> bool {
    byte >= BASE && byte <= BASE + 0xF
}

/// Three numbers as twelve letters, into the places 1 to 12 of a packet.
pub(super) fn put(packet: &mut [u8; super::PACKET], values: [i16; 3]) {
    for (place, value) in packet[1..13].chunks_exact_mut(4).zip(values) {
        place.copy_from_slice(&encode(value));
    }
}

/// The three numbers at the places 1 to 12 of a packet, or the place of the first byte that is no letter.
pub(super) fn take(packet: &[u8; super::PACKET]) -> Result<[i16; 3], usize> {
    let mut values = [0; 3];
    for (place, value) in packet[1..13].chunks_exact(4).zip(&mut values) {
        match decode([place[0], place[1], place[2], place[3]]) {
            Some(number) => *value = number,
            None => return Err((1..13).find(|at| !is_letter(packet[*at])).unwrap_or(1)),
        }
    }
    Ok(values)
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
        // JFKP is 0xFA59.
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
