//! Random numbers with an address.
//!
//! A draw is a pure function of (seed, link, packet, copy, purpose): there is no generator whose state one impairment could advance under another. So
//! adding a link, a peer or an impairment, or changing one parameter, leaves every other draw as it was, and two runs that differ in one thing
//! share all their other randomness (common random numbers).
//!
//! The function is Philox-2×64 with 7 rounds (Salmon, Moraes, Dror & Shaw, *Parallel Random Numbers: As Easy as 1, 2, 3*, SC11, 2011): the key comes from
//! (seed, link), the counter from (packet, copy, purpose, block). The authors found 6 rounds enough for every test of BigCrush; golden vectors below.
//!
//! A block has two words. The first words of two purposes share a block, loss with jitter, duplication with corruption, since a link that needs one
//! often needs the other: with loss and jitter that took 4 % off a packet. What a purpose needs beyond its first word lies in blocks of its own.

use core::convert::Infallible;

use rand::TryRng;

/// What a random number is drawn for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Purpose {
    /// Whether a packet is lost.
    Loss,
    /// How far a packet's delay is from the mean.
    Jitter,
    /// Whether a packet is duplicated.
    Duplication,
    /// Whether a packet is corrupted, and which of its bits.
    Corruption,
    /// Whether a packet is reordered.
    Reordering,
    /// What an active queue does with a packet.
    Queue,
    /// The state in which a chain with memory begins: its draws are those of packet 0.
    InitialState,
    /// Whether a recorded path loses a packet.
    TraceLoss,
    /// How long a link is up and down in turn: the draws of "packet" n are those of the n-th span.
    Outage,
    /// When a modulator changes state, and to which: the draws of "packet" n are those of its n-th change.
    Modulation,
    /// When a slot opens: the draws of "packet" n are those of the n-th slot.
    Slot,
    /// The process of an impairment of [the list](crate::Impairments), by its code: the draws of "packet" n are those of its n-th event.
    Listed(u8),
}

impl Purpose {
    /// Part of the address, so these numbers must never change.
    const fn code(self) -> u64 {
        match self {
            Self::Loss => 0,
            Self::Jitter => 1,
            Self::Duplication => 2,
            Self::Corruption => 3,
            Self::Reordering => 4,
            Self::Queue => 5,
            Self::InitialState => 6,
            Self::TraceLoss => 7,
            Self::Outage => 8,
            Self::Modulation => 10,
            Self::Slot => 12,
            Self::Listed(code) => code as u64,
        }
    }
}

/// The random numbers of one link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Stream {
    key: u64,
}

impl Stream {
    /// The stream with that address. `label` names the link; equal labels have equal streams.
    #[must_use]
    pub fn new(seed: u64, label: &[u8]) -> Self {
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
        Self { key }
    }

    /// The draws of one packet.
    #[must_use]
    #[inline]
    pub const fn packet(self, number: u64) -> PacketDraws {
        self.copy(number, 0)
    }

    /// The draws of a copy of a packet; copy 0 is the packet itself.
    #[must_use]
    #[inline]
    pub const fn copy(self, number: u64, copy: u8) -> PacketDraws {
        PacketDraws { key: self.key, number, copy }
    }
}

/// The random numbers of one packet, or of one copy of it, for all purposes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PacketDraws {
    key: u64,
    number: u64,
    copy: u8,
}

impl PacketDraws {
    /// The first words for [`Purpose::Loss`] and [`Purpose::Jitter`].
    #[must_use]
    #[inline]
    pub const fn loss_and_jitter(self) -> [u64; 2] {
        self.block(0, 0)
    }

    /// The first word for a purpose: 64 uniform bits.
    #[must_use]
    #[inline]
    pub const fn first(self, purpose: Purpose) -> u64 {
        let code = purpose.code();
        self.block(0, code / 2)[(code % 2) as usize]
    }

    /// The words for a purpose from the first one on.
    #[must_use]
    #[inline]
    pub const fn draws(self, purpose: Purpose) -> Draws {
        Draws { packet: self, purpose, block: 0, spare: None }
    }

    /// The words for a purpose from the second one on.
    #[must_use]
    #[inline]
    pub const fn more(self, purpose: Purpose) -> Draws {
        Draws { packet: self, purpose, block: 1, spare: None }
    }

    /// Block 0 belongs to a pair of purposes, later ones to one.
    #[inline]
    const fn block(self, block: u64, whose: u64) -> [u64; 2] {
        philox(self.number, block << 16 | (self.copy as u64) << 8 | whose, self.key)
    }
}

/// The random numbers of one packet for one purpose: as many as are wanted.
///
/// It is a generator for `rand_distr`.
#[derive(Clone, Copy, Debug)]
pub struct Draws {
    packet: PacketDraws,
    purpose: Purpose,
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
        if self.block == 0 {
            self.block = 1;
            return self.packet.first(self.purpose);
        }
        let [word, spare] = self.packet.block(self.block, self.purpose.code());
        self.block += 1;
        self.spare = Some(spare);
        word
    }

    /// A uniform number in [0, 1), a multiple of 2⁻⁵³.
    #[inline]
    pub fn next_unit(&mut self) -> f64 {
        unit(self.next_word())
    }
}

/// The top 53 bits of a word as a number in [0, 1).
#[must_use]
#[inline]
#[expect(clippy::cast_precision_loss, reason = "53 bits are exact in an f64")]
pub fn unit(word: u64) -> f64 {
    const TWO_POW_MINUS_53: f64 = 1.0 / 9_007_199_254_740_992.0;
    (word >> 11) as f64 * TWO_POW_MINUS_53
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
        let packet = |seed, label: &str, number, copy| Stream::new(seed, label.as_bytes()).copy(number, copy);
        let drawn = [
            packet(0, "", 0, 0).first(Purpose::Loss),
            packet(1, "left->right", 0, 0).first(Purpose::Loss),
            packet(1, "left->right", 0, 0).first(Purpose::Jitter),
            packet(1, "left->right", 7, 1).first(Purpose::Corruption),
            packet(1, "left->right", 7, 1).more(Purpose::Corruption).next_word(),
            packet(u64::MAX, "a peer with a long name->another one", 0, 0).first(Purpose::InitialState),
        ];

        let expected = [
            1_842_404_019_259_666_520,
            13_572_114_012_027_969_562,
            3_580_754_297_706_433_943,
            17_893_050_011_931_159_018,
            8_806_227_843_080_467_796,
            14_331_108_856_863_319_007,
        ];
        assert_eq!(drawn, expected);
    }

    #[test]
    fn no_two_draws_share_an_address() {
        use Purpose::{Corruption, Duplication, InitialState, Jitter, Listed, Loss, Modulation, Outage, Queue, Reordering, Slot, TraceLoss};
        let mut words = std::collections::BTreeSet::new();
        let mut count = 0;
        for (seed, label) in [(1, "a->b"), (2, "a->b"), (1, "b->a"), (1, "a->b\0")] {
            let stream = Stream::new(seed, label.as_bytes());
            for (number, copy) in [(0, 0), (1, 0), (0, 1), (256, 0), (1 << 16, 0), (0, 255)] {
                for purpose in [
                    Loss,
                    Jitter,
                    Duplication,
                    Corruption,
                    Reordering,
                    Queue,
                    InitialState,
                    TraceLoss,
                    Outage,
                    Modulation,
                    Slot,
                    Listed(14),
                    Listed(16),
                ] {
                    let mut draws = stream.copy(number, copy).draws(purpose);
                    words.extend(core::iter::repeat_with(|| draws.next_word()).take(6));
                    count += 6;
                }
            }
        }
        assert_eq!(words.len(), count);
    }

    #[test]
    fn a_packet_has_the_same_draws_whenever_they_are_asked_for() {
        let packet = Stream::new(7, b"x").packet(41);
        let mut once = packet.draws(Purpose::Jitter);
        let first: [u64; 5] = core::array::from_fn(|_| once.next_word());
        let mut more = packet.more(Purpose::Jitter);
        let again = [packet.first(Purpose::Jitter), more.next_word(), more.next_word(), more.next_word(), more.next_word()];
        assert_eq!(first, again);
        assert_eq!(packet.loss_and_jitter(), [packet.first(Purpose::Loss), packet.first(Purpose::Jitter)]);
    }
}
