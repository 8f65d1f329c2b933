//! Faults of a simulated device, and their random numbers.

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

/// Random number generator `SplitMix64` (Steele, Lea & Flood 2014).
#[derive(Clone, Copy, Debug)]
pub(super) struct Dice(u64);

impl Dice {
    pub(super) const fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(super) const fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut word = self.0;
        word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        word ^ (word >> 31)
    }

    pub(super) const fn byte(&mut self) -> u8 {
        self.word().to_le_bytes()[7]
    }

    /// Returns whether an event of that probability happens. An impossible event draws no number, so that unused faults do not change a run.
    pub(super) fn happens(&mut self, probability: f64) -> bool {
        #[expect(clippy::cast_precision_loss, reason = "53 bits, exactly")]
        let uniform = |word: u64| (word >> 11) as f64 / (1_u64 << 53) as f64;
        probability > 0.0 && uniform(self.word()) < probability
    }

    /// Returns a byte after its transmission; `None` for a lost byte.
    pub(super) fn pass(&mut self, byte: u8, drop: f64, garble: f64) -> Option<u8> {
        if self.happens(drop) {
            return None;
        }
        // One flipped bit: the framer can detect some, but not all, of the results.
        Some(if self.happens(garble) { byte ^ (1 << (self.byte() % 8)) } else { byte })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_sequence() {
        // The first numbers of the reference implementation with seed 1234567.
        let mut dice = Dice::new(1_234_567);
        assert_eq!([dice.word(), dice.word()], [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]);
    }

    #[test]
    fn what_cannot_happen_does_not_and_what_must_does() {
        let mut dice = Dice::new(7);
        assert!((0..1000).all(|_| !dice.happens(0.0) && dice.happens(1.0)));
        assert_eq!(Dice::new(3).pass(0x41, 1.0, 0.0), None);
        assert_eq!(Dice::new(3).pass(0x41, 0.0, 1.0).map(|byte| (byte ^ 0x41).count_ones()), Some(1));
    }
}
