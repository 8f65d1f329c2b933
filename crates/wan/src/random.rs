//! Random numbers with an address.
//!
//! A draw is a pure function of (seed, link, purpose, packet): there is no generator whose state one impairment could advance under another. So
//! adding a link, a peer or an impairment, or changing one parameter, leaves every other draw as it was, and two runs that differ in one thing
//! share all their other randomness (common random numbers).
//!
//! The function is Philox-2×64 with 7 rounds (Salmon, Moraes, Dror & Shaw, *Parallel Random Numbers: As Easy as 1, 2, 3*, SC11, 2011): the counter is
//! (packet, block), the key comes from (seed, link, purpose). The authors found 6 rounds enough for every test of BigCrush; golden vectors below.

use core::convert::Infallible;

use rand_core::TryRng;

/// What a random number is drawn for. Each purpose of each link has a stream of its own.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Purpose {
    /// Whether a packet is lost.
    Loss,
    /// The state in which a loss model begins.
    LossState,
    /// How far a packet's delay is from the mean.
    Jitter,
}

impl Purpose {
    /// Part of the address, so these numbers must never change.
    const fn code(self) -> u64 {
        match self {
            Self::Loss => 1,
            Self::LossState => 2,
            Self::Jitter => 3,
        }
    }
}

/// The random numbers of one purpose on one link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Stream {
    key: u64,
}

impl Stream {
    /// The stream with that address. `label` names the link; equal labels have equal streams.
    #[must_use]
    pub fn new(seed: u64, label: &[u8], purpose: Purpose) -> Self {
        // The address is absorbed word by word, each with its position, by the same function that makes the draws.
        let mut key = philox(seed, 0, 0)[0];
        let mut position = 1;
        let mut absorb = |word: u64| {
            key = philox(word, position, key)[0];
            position += 1;
        };
        absorb(label.len() as u64);
        for chunk in label.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            absorb(u64::from_le_bytes(word));
        }
        absorb(purpose.code());
        Self { key }
    }

    /// The draws of packet number `packet`.
    #[must_use]
    pub const fn at(self, packet: u64) -> Draws {
        Draws { key: self.key, packet, block: 0, spare: None }
    }
}

impl Stream {
    /// The first word of a packet's draws, without the state that further ones need.
    #[must_use]
    #[inline]
    pub const fn first_word(self, packet: u64) -> u64 {
        philox(packet, 0, self.key)[0]
    }
}

/// The random numbers of one packet for one purpose: as many as are wanted, 128 bits a block.
///
/// It is a generator for `rand_distr`.
#[derive(Clone, Copy, Debug)]
pub struct Draws {
    key: u64,
    packet: u64,
    block: u64,
    spare: Option<u64>,
}

impl Draws {
    /// 64 uniform bits.
    #[inline]
    pub fn next_word(&mut self) -> u64 {
        if let Some(word) = self.spare.take() {
            return word;
        }
        let [word, spare] = philox(self.packet, self.block, self.key);
        self.block += 1;
        self.spare = Some(spare);
        word
    }

    /// A uniform number in [0, 1), a multiple of 2⁻⁵³.
    #[inline]
    #[expect(clippy::cast_precision_loss, reason = "53 bits are exact in an f64")]
    pub fn next_unit(&mut self) -> f64 {
        const TWO_POW_MINUS_53: f64 = 1.0 / 9_007_199_254_740_992.0;
        (self.next_word() >> 11) as f64 * TWO_POW_MINUS_53
    }
}

impl TryRng for Draws {
    type Error = Infallible;

    #[inline]
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok((self.next_word() >> 32) as u32)
    }

    #[inline]
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(self.next_word())
    }

    fn try_fill_bytes(&mut self, dst: &mut [u8]) -> Result<(), Infallible> {
        for chunk in dst.chunks_mut(8) {
            chunk.copy_from_slice(&self.next_word().to_le_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

/// Philox-2×64-7: two words of counter and one of key to two words.
#[inline]
const fn philox(counter: u64, high: u64, key: u64) -> [u64; 2] {
    philox_rounds(counter, high, key, 7)
}

#[inline]
#[expect(clippy::cast_possible_truncation, reason = "the two halves of a 128-bit product")]
const fn philox_rounds(counter: u64, high: u64, key: u64, rounds: u32) -> [u64; 2] {
    const MULTIPLIER: u64 = 0xD2B7_4407_B1CE_6E93;
    const WEYL: u64 = 0x9E37_79B9_7F4A_7C15;
    let (mut left, mut right, mut key) = (counter, high, key);
    let mut round = 0;
    while round < rounds {
        let product = left as u128 * MULTIPLIER as u128;
        left = (product >> 64) as u64 ^ key ^ right;
        right = product as u64;
        key = key.wrapping_add(WEYL);
        round += 1;
    }
    [left, right]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known answers published with Random123 (`kat_vectors`, philox2x64).
    #[test]
    fn gives_the_published_answers() {
        const PI: [u64; 3] = [0x243f_6a88_85a3_08d3, 0x1319_8a2e_0370_7344, 0xa409_3822_299f_31d0];
        assert_eq!(philox_rounds(0, 0, 0, 10), [0xca00_a045_9843_d731, 0x66c2_4222_c9a8_45b5]);
        assert_eq!(philox_rounds(u64::MAX, u64::MAX, u64::MAX, 10), [0x65b0_21d6_0cd8_310f, 0x4d02_f322_2f86_df20]);
        assert_eq!(philox_rounds(PI[0], PI[1], PI[2], 10), [0x0a5e_742c_2997_341c, 0xb0f8_83d3_8000_de5d]);
        assert_eq!(philox(0, 0, 0), [0xb41d_a69f_bfef_c666, 0x511e_9ce1_a553_4056]);
        assert_eq!(philox(u64::MAX, u64::MAX, u64::MAX), [0xa469_6cc0_4462_015d, 0x7247_82da_e171_69e9]);
        assert_eq!(philox(PI[0], PI[1], PI[2]), [0x98ed_1534_392b_f372, 0x6752_8b15_6888_2fd5]);
    }

    /// The addresses are a promise: a scene gives the same bytes with every version. If this test fails, the change breaks recorded results.
    #[test]
    fn addresses_never_change() {
        let draw = |seed, label: &str, purpose| Stream::new(seed, label.as_bytes(), purpose).at(0).next_word();
        let drawn = [
            draw(0, "", Purpose::Loss),
            draw(1, "left->right", Purpose::Loss),
            draw(1, "left->right", Purpose::Jitter),
            draw(u64::MAX, "a peer with a long name->another one", Purpose::LossState),
        ];
        assert_eq!(drawn, [13_054_728_836_745_160_658, 16_532_924_348_238_823_526, 548_372_529_604_639_721, 15_233_301_043_234_685_537]);
    }

    #[test]
    fn streams_differ_in_every_part_of_their_address() {
        let keys = [
            Stream::new(1, b"a->b", Purpose::Loss),
            Stream::new(2, b"a->b", Purpose::Loss),
            Stream::new(1, b"b->a", Purpose::Loss),
            Stream::new(1, b"a->b", Purpose::Jitter),
            Stream::new(1, b"a->b\0", Purpose::Loss),
        ];
        for (i, a) in keys.iter().enumerate() {
            assert!(keys[..i].iter().all(|b| a != b));
        }
    }

    #[test]
    fn a_packet_has_the_same_draws_whenever_they_are_asked_for() {
        let stream = Stream::new(7, b"x", Purpose::Jitter);
        let mut once = stream.at(41);
        let first: [u64; 5] = core::array::from_fn(|_| once.next_word());
        let mut again = stream.at(41);
        assert_eq!(first, core::array::from_fn(|_| again.next_word()));
        assert_ne!(stream.at(42).next_word(), first[0]);
    }
}
