//! Chance in simulated devices.

/// Random number generator `SplitMix64` (Steele, Lea & Flood 2014), for the faults of simulated devices. The same seed gives the same faults.
#[derive(Clone, Copy, Debug)]
pub struct Dice(u64);

impl Dice {
    /// Returns the generator of a seed.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Returns the next 64 bits.
    pub const fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut word = self.0;
        word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        word ^ (word >> 31)
    }

    /// Returns the next random byte.
    pub const fn byte(&mut self) -> u8 {
        self.word().to_le_bytes()[7]
    }

    /// Returns whether an event of that probability happens. An impossible event draws no number, so that unused faults do not change a run.
    pub fn happens(&mut self, probability: f64) -> bool {
        #[expect(clippy::cast_precision_loss, reason = "53 bits, exactly")]
        let uniform = |word: u64| (word >> 11) as f64 / (1_u64 << 53) as f64;
        probability > 0.0 && uniform(self.word()) < probability
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
    }
}
