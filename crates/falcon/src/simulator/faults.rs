//! Faults of a simulated device.

use cohaptic_device::Dice;

/// Faults, each with its probability. Random numbers come from the seed, so a run can be repeated.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Faults {
    /// Loss of a byte to the host.
    pub drop_to_host: f64,
    /// A flipped bit in a byte to the host.
    pub garble_to_host: f64,
    /// An additional random byte before a byte to the host.
    pub insert_to_host: f64,
    /// Loss of a byte to the device.
    pub drop_to_device: f64,
    /// A flipped bit in a byte to the device.
    pub garble_to_device: f64,
    /// A packet to the host that contains only 0 to 15 of the due bytes. The further bytes come with the next packet.
    pub fragment: f64,
    /// `true` if the device receives packets and sends no answers.
    pub mute: bool,
    /// Index of the firmware byte, from 0, that the boot loader returns wrong in the first attempt.
    pub wrong_echo: Option<usize>,
}

impl Faults {
    /// No faults.
    pub const NONE: Self = Self {
        drop_to_host: 0.0,
        garble_to_host: 0.0,
        insert_to_host: 0.0,
        drop_to_device: 0.0,
        garble_to_device: 0.0,
        fragment: 0.0,
        mute: false,
        wrong_echo: None,
    };
}

/// Returns a byte after its transmission; `None` for a lost byte.
pub(super) fn pass(dice: &mut Dice, byte: u8, drop: f64, garble: f64) -> Option<u8> {
    if dice.happens(drop) {
        return None;
    }
    // One flipped bit: the framer can detect some, but not all, of the results.
    Some(if dice.happens(garble) { byte ^ (1 << (dice.byte() % 8)) } else { byte })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_is_lost_or_has_one_flipped_bit() {
        assert_eq!(pass(&mut Dice::new(3), 0x41, 1.0, 0.0), None);
        assert_eq!(pass(&mut Dice::new(3), 0x41, 0.0, 1.0).map(|byte| (byte ^ 0x41).count_ones()), Some(1));
    }
}
