//! Sequence numbers of 32 bits, extended to 64 bits, so that the rest of the crate compares positions without wrapping.

/// Sequence number extended to 64 bits. The low 32 bits are the number on the wire.
///
/// Positions begin at 2³² plus the initial sequence number, so that numbers up to 2³² below the initial sequence number have a position as well.
pub(crate) type Position = u64;

/// Returns the position of the SYN whose sequence number is `initial_sequence`.
pub(crate) const fn first(initial_sequence: u32) -> Position {
    (1 << 32) | initial_sequence as Position
}

/// Returns the position nearest to `near` whose number on the wire is `wire` (RFC 9293, section 3.4).
#[expect(clippy::cast_possible_wrap, reason = "the difference modulo 2^32 is read as a signed number on purpose")]
pub(crate) const fn extend(wire: u32, near: Position) -> Position {
    let difference = wire.wrapping_sub(on_wire(near)) as i32;
    near.wrapping_add_signed(difference as i64)
}

/// Returns the sequence number on the wire of `position`.
#[expect(clippy::cast_possible_truncation, reason = "the wire carries the low 32 bits")]
pub(crate) const fn on_wire(position: Position) -> u32 {
    position as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_wrap_and_positions_do_not() {
        let near = first(u32::MAX - 999);
        assert_eq!(extend(500, near), near + 1500);
        assert_eq!(extend(u32::MAX - 1999, near), near - 1000);
        assert_eq!(on_wire(near + 1500), 500);
    }

    #[test]
    fn a_number_behind_the_first_one_is_a_position() {
        let near = first(0);
        assert_eq!(extend(u32::MAX, near), near - 1);
    }
}
