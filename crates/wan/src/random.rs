//! Random numbers by address: counter-based draws without generator state.
//!
//! A draw is a pure function of (seed, link, packet, copy, purpose). No impairment can advance the generator of another impairment, because no generator state
//! exists. An additional link, peer or impairment, or a changed parameter, leaves all further draws the same. Two runs with a difference in one parameter share
//! all further randomness (common random numbers).
//!
//! The function is Philox-2×64 with 7 rounds (Salmon, Moraes, Dror & Shaw, *Parallel Random Numbers: As Easy as 1, 2, 3*, SC11, 2011): the key comes from
//! (seed, link), the counter from (packet, copy, purpose, block). The authors found 6 rounds enough for every test of BigCrush. The tests of this module
//! compare with the published vectors.
//!
//! A block has two words. The first words of two purposes share a block (loss with jitter, duplication with corruption), because a link that needs one of the
//! two words often needs the second word too, and then computes one block only. Further words of a purpose lie in blocks of this purpose alone.

use core::convert::Infallible;

use rand::TryRng;

/// Purpose of a random number: part of the address of a draw.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Purpose {
    /// Loss of a packet.
    Loss,
    /// Deviation of a packet's delay from the mean.
    Jitter,
    /// Duplication of a packet.
    Duplication,
    /// Corruption of a packet, and the choice of its bits.
    Corruption,
    /// Reordering of a packet.
    Reordering,
    /// Decision of an active queue about a packet.
    Queue,
    /// Initial state of a chain with memory. The draws have the address of packet 0.
    InitialState,
    /// Loss of a packet on a recorded path.
    TraceLoss,
    /// Durations of up and down in turn. The n-th span has the draws of packet n.
    Outage,
    /// Packets of cross-traffic: distances, spans of sources, and decisions of an active queue. The draws have addresses counted by the cross-traffic.
    CrossTraffic,
    /// Instants and next states of a modulator. The n-th change has the draws of packet n.
    Modulation,
    /// Instants of opening slots. The n-th slot has the draws of packet n.
    Slot,
    /// Order of the targets of a task, in a stream of its own. The n-th exchange of two targets has the draws of packet n.
    TargetOrder,
    /// Noise of a movement of an operator, in a stream of its own. The n-th movement has the draws of packet n; its axes are copies.
    Movement,
    /// Orders, seeds and persons of a study, and flipped signs of its statistics, each in a stream of its own.
    Study,
    /// Process of an impairment of [the list](crate::Impairments), by its code. The n-th event has the draws of packet n.
    Listed(u8),
}

impl Purpose {
    /// Returns the number of the purpose in addresses. These numbers must never change, because a change would change the draws of all recorded results.
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
            Self::CrossTraffic => 9,
            Self::Modulation => 10,
            Self::Slot => 12,
            Self::TargetOrder => 18,
            Self::Movement => 20,
            Self::Study => 22,
            Self::Listed(code) => code as u64,
        }
    }
}

/// Random numbers of one link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Stream {
    /// Key of Philox, derived from seed and label.
    key: u64,
}

impl Stream {
    /// Returns the stream of a link. `label` names the link. Equal seeds and labels give equal streams.
    #[must_use]
    pub fn new(seed: u64, label: &[u8]) -> Self {
        // Seed, length and words of the label are absorbed one by one, each with its position, by the function of the draws. The length distinguishes labels
        // with a difference only in zeros at the end of the last word.
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

    /// Returns the draws of a packet, by the number of the packet on the link.
    #[must_use]
    #[inline]
    pub const fn packet(self, number: u64) -> PacketDraws {
        self.copy(number, 0)
    }

    /// Returns the draws of a copy of a packet. Copy 0 is the packet itself.
    #[must_use]
    pub const fn copy(self, number: u64, copy: u8) -> PacketDraws {
        PacketDraws { key: self.key, number, copy }
    }
}

/// Random numbers of one packet, or of one copy of a packet, for all purposes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PacketDraws {
    /// Key of the stream.
    key: u64,
    /// Number of the packet on its link.
    number: u64,
    /// Copy of the packet. 0 is the packet itself.
    copy: u8,
}

impl PacketDraws {
    /// Returns the first words for [`Purpose::Loss`] and [`Purpose::Jitter`]. Both share a block.
    #[must_use]
    #[inline]
    pub const fn loss_and_jitter(self) -> [u64; 2] {
        self.block(0, 0)
    }

    /// Returns the first word for a purpose: 64 uniform bits.
    #[must_use]
    #[inline]
    pub const fn first(self, purpose: Purpose) -> u64 {
        let code = purpose.code();
        // Neighbouring codes share a block: an even code has its first word, an odd code its second.
        self.block(0, code / 2)[(code % 2) as usize]
    }

    /// Returns the words for a purpose, beginning with the first word.
    #[must_use]
    pub const fn draws(self, purpose: Purpose) -> Draws {
        Draws { packet: self, purpose, block: 0, spare: None }
    }

    /// Returns the words for a purpose, beginning with the second word.
    #[must_use]
    pub const fn more(self, purpose: Purpose) -> Draws {
        Draws { packet: self, purpose, block: 1, spare: None }
    }

    /// Computes a block. In block 0, `whose` is the number of a pair of purposes; in all later blocks, `whose` is the code of one purpose. Codes and copies
    /// are below 256, so the parts of the counter do not overlap.
    #[inline]
    const fn block(self, block: u64, whose: u64) -> [u64; 2] {
        philox(self.number, block << 16 | (self.copy as u64) << 8 | whose, self.key)
    }
}

/// Unlimited sequence of random numbers of one packet for one purpose.
///
/// Implements the generator trait of `rand_distr`.
#[derive(Clone, Copy, Debug)]
pub struct Draws {
    packet: PacketDraws,
    purpose: Purpose,
    /// Next block to compute.
    block: u64,
    /// Second word of the latest block, if not yet returned. Never a word of block 0: its second word belongs to another purpose.
    spare: Option<u64>,
}

impl Draws {
    /// Returns the next 64 uniform bits.
    #[inline]
    pub fn next_word(&mut self) -> u64 {
        if let Some(word) = self.spare.take() {
            return word;
        }
        if self.block == 0 {
            // In block 0 only the first word of this purpose counts, so nothing is spare.
            self.block = 1;
            return self.packet.first(self.purpose);
        }
        let [word, spare] = self.packet.block(self.block, self.purpose.code());
        self.block += 1;
        self.spare = Some(spare);
        word
    }

    /// Returns the next uniform number in [0, 1), a multiple of 2⁻⁵³.
    #[inline]
    pub fn next_unit(&mut self) -> f64 {
        unit(self.next_word())
    }
}

/// Converts the top 53 bits of a word to a number in [0, 1).
#[must_use]
#[inline]
#[expect(clippy::cast_precision_loss, reason = "53 bits are exact in an f64")]
pub fn unit(word: u64) -> f64 {
    const TWO_POW_MINUS_53: f64 = 1.0 / 9_007_199_254_740_992.0;
    // Multiplication by a power of two is exact, so the result is below 1 for every word.
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

/// Computes Philox-2×64-7: two words of output from two words of counter and one word of key.
#[inline]
const fn philox(counter: u64, high: u64, key: u64) -> [u64; 2] {
    philox_rounds(counter, high, key, 7)
}

/// Computes Philox-2×64 with a number of rounds. The tests also check the published vectors of 10 rounds.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "the two halves of a 128-bit product")]
const fn philox_rounds(counter: u64, high: u64, key: u64, rounds: u32) -> [u64; 2] {
    const MULTIPLIER: u64 = 0xD2B7_4407_B1CE_6E93;
    const WEYL: u64 = 0x9E37_79B9_7F4A_7C15;
    let (mut left, mut right, mut key) = (counter, high, key);
    let mut round = 0;
    while round < rounds {
        let product = left as u128 * MULTIPLIER as u128;
        // The upper half of the product is mixed with the key and the right word, and the lower half becomes the right word.
        left = (product >> 64) as u64 ^ key ^ right;
        right = product as u64;
        // A Weyl sequence gives each round another key.
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
        use Purpose::{
            Corruption, CrossTraffic, Duplication, InitialState, Jitter, Listed, Loss, Modulation, Movement, Outage, Queue, Reordering, Slot, Study,
            TargetOrder, TraceLoss,
        };
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
                    CrossTraffic,
                    Modulation,
                    Slot,
                    TargetOrder,
                    Movement,
                    Study,
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
