//! Corruption: bits of a packet flipped on the way.

use alloc::collections::BTreeSet;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use cohaptic_units::print::Counted;
use core::ops::Range;

use cohaptic_units::Probability;

use crate::fates::damage::Damage;
use crate::laws::chance::CHANCES;
use crate::laws::chance::{Chance, ChanceStage};
use crate::packet::PacketInfo;
use crate::parameters::{Choices, Form, Key, MOST_OF_32_BITS, Table, optional, usual, words};
use crate::random::{PacketDraws, Purpose, unit};

/// Model of flipped bits, and of the receiver's check.
#[derive(Clone, PartialEq, Debug)]
pub struct Corruption {
    /// Way of choosing bits.
    pub bits: Flips,
    /// Bytes whose bits may be flipped, counted from the packet's begin. `None` means the whole packet. Bytes after the packet's end are ignored, and so are
    /// bytes from 65,536 on, because no datagram is longer.
    pub within: Option<Range<u64>>,
    /// Treatment of a damaged packet by the receiver.
    pub checksum: Checksum,
}

/// Way of choosing bits.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Flips {
    /// Some packets are damaged, each in `count` different bits; every set of bits is equally likely. A packet with fewer bits is damaged in all bits.
    Bits {
        /// Chance that a packet is damaged.
        packets: Chance,
        /// Number of flipped bits of each damaged packet.
        count: u32,
    },
    /// Every bit is flipped independently with this probability.
    Rate(Probability),
}

/// Treatment of a damaged packet by the receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Checksum {
    /// The receiver discards the packet on arrival, like a network stack with a failed checksum. Damage missed by a checksum is not modelled.
    #[default]
    Discards,
    /// The receiver takes the packet, because the checksum was computed after the damage or does not exist.
    Passes,
}

/// Number of bytes at the begin of a packet within reach of damage. A bound is needed because the size of a packet is a number without memory, but the damage
/// to a packet is a list of bits.
const LONGEST: u64 = 1 << 16;

/// Stage with the configuration and the state of the chance of damage.
#[derive(Clone, Debug)]
pub(crate) struct CorruptionStage {
    config: Corruption,
    packets: Option<ChanceStage>,
}

impl CorruptionStage {
    /// Returns the stage with the configuration `config`, or `None` without a configuration. Correlated damage continues from the previous packet.
    pub(crate) fn reconfigured(before: Option<Self>, config: Option<Corruption>) -> Option<Self> {
        let config = config?;
        // Only a chance has state. A change between the two ways of choosing bits therefore begins without state.
        let before = before.and_then(|stage| stage.packets);
        let packets = match config.bits {
            Flips::Bits { packets, .. } => ChanceStage::reconfigured(before, packets),
            Flips::Rate(_) => None,
        };
        Some(Self { config, packets })
    }

    pub(crate) const fn checksum(&self) -> Checksum {
        self.config.checksum
    }

    /// Returns the damage to a packet, or `None` if no bit is flipped.
    pub(crate) fn damage(&mut self, info: PacketInfo, packet: PacketDraws) -> Option<Damage> {
        // Bits are counted from `first`. A range outside the packet becomes empty, and no bit is flipped.
        let (start, end) = self.config.within.as_ref().map_or((0, LONGEST), |within| (within.start, within.end));
        let end = end.min(info.size.get()).min(LONGEST);
        let first = 8 * start.min(end);
        let count = 8 * end - first;
        let bits = match self.config.bits {
            Flips::Bits { count: wanted, .. } => {
                if !self.packets.as_mut()?.happens(packet.first(Purpose::Corruption)) {
                    return None;
                }
                some_of(count, wanted, packet)
            }
            Flips::Rate(rate) => each_with(count, rate, packet),
        };
        // Drawn numbers count from the first allowed bit.
        Damage::of(bits.into_iter().map(|bit| first + bit).collect())
    }
}

/// Returns `wanted` different numbers below `count` in ascending order, every set equally likely (Floyd; Bentley & Floyd, CACM 30(9), 1987). Returns all
/// numbers if `count` is at most `wanted`.
fn some_of(count: u64, wanted: u32, packet: PacketDraws) -> Vec<u64> {
    let mut more = packet.more(Purpose::Corruption);
    let mut chosen = BTreeSet::new();
    for last in count.saturating_sub(wanted.into())..count {
        // One word per chosen bit, whatever was chosen before.
        let candidate = below(last + 1, more.next_word());
        // `last` is above all numbers chosen in earlier rounds, so `last` is new.
        if !chosen.insert(candidate) {
            chosen.insert(last);
        }
    }
    chosen.into_iter().collect()
}

/// Returns a number below `bound`, scaled from the word. The bias is at most bound·2⁻⁶⁴.
fn below(bound: u64, word: u64) -> u64 {
    ((u128::from(bound) * u128::from(word)) >> 64) as u64
}

/// Returns the numbers below `count` of a choice of each number with probability `rate`. Gaps between chosen numbers are geometric, and are drawn by
/// inversion.
fn each_with(count: u64, rate: Probability, packet: PacketDraws) -> Vec<u64> {
    // At the rates 0 and 1 the logarithm below would be zero or infinite.
    if rate == Probability::ZERO {
        return Vec::new();
    }
    if rate == Probability::ONE {
        return (0..count).collect();
    }
    let mut draws = packet.draws(Purpose::Corruption);
    let log_of_whole = libm::log1p(-rate.get());
    let mut chosen = Vec::new();
    let mut next = 0_u64;
    loop {
        // 1 − u lies in (0, 1], so its logarithm is finite.
        // Inversion of P(gap ≥ k) = (1 − rate)^k.
        let gap = libm::floor(libm::log(1.0 - unit(draws.next_word())) / log_of_whole);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and saturates far beyond any packet")]
        let gap = gap as u64;
        next = next.saturating_add(gap);
        if next >= count {
            return chosen;
        }
        chosen.push(next);
        next += 1;
    }
}

/// Parameter of flipped bits.
pub(crate) const KEYS: [Key; 1] =
    [usual("corrupt", CORRUPT, "0", "Probability that a bit of a packet is flipped, or a table that says which bits and what the receiver does")];
const CORRUPT: Form = Form::AnyOf(&[Form::Probability, Form::Table(&CORRUPT_TABLE)]);
static CORRUPT_TABLE: Table = Table::of(&[
    &CHANCES,
    &[
        usual("bits", Form::Integer(1, MOST_OF_32_BITS), "1", "Number of different bits that are flipped in such a packet")
            .expecting("a number of bits of at least 1"),
        optional(
            "bit-error-rate",
            Form::Probability,
            "Probability that a bit is flipped, for each bit independently, in place of probability and bits",
        ),
        optional("bytes", Form::Like(&["8-15"]), "First and last byte that may be hit, counted from 0"),
        usual("checksum", Form::Words(&CHECKSUMS), "\"discards\"", "Treatment of a damaged packet by the receiver"),
    ],
]);
const CHECKSUMS: [(&str, &str); 2] = words(&Checksum::CHOICES);

impl Checksum {
    /// Names of the treatments in files, each with its value and its description.
    pub const CHOICES: Choices<Self, 2> =
        [("discards", Self::Discards, "it is dropped when it arrives"), ("passes", Self::Passes, "it is taken, and the peer's own checks decide")];
}

impl Corruption {
    /// Returns the flipped bits in words.
    pub(crate) fn words(&self) -> String {
        let bits = match self.bits {
            Flips::Bits { packets, count } => format!("{} flipped in {}", Counted(count, "bit"), packets.words()),
            Flips::Rate(rate) => format!("each bit flipped with {:e}", rate.get()),
        };
        let within = self.within.as_ref().map_or_else(String::new, |range| format!(", bytes {} to {}", range.start, range.end - 1));
        let checksum = match self.checksum {
            Checksum::Discards => "discarded on arrival",
            Checksum::Passes => "handed over",
        };
        format!("{bits}{within} ({checksum})")
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_units::Bytes;

    use super::*;
    use crate::random::Stream;

    fn stage(bits: Flips, within: Option<Range<u64>>) -> CorruptionStage {
        CorruptionStage::reconfigured(None, Some(Corruption { bits, within, checksum: Checksum::Passes })).unwrap()
    }

    fn damages(mut stage: CorruptionStage, size: u64, count: u64) -> Vec<Option<Damage>> {
        let stream = Stream::new(2, b"corruption");
        (0..count).map(|number| stage.damage(Bytes::new(size).into(), stream.packet(number))).collect()
    }

    fn always(count: u32) -> Flips {
        Flips::Bits { packets: Chance::independent(Probability::ONE), count }
    }

    /// Each of 64 bits is equally likely to be flipped: χ² with 63 degrees of freedom exceeds 119 once in 10⁵.
    #[test]
    fn every_bit_is_as_likely_as_another() {
        let mut hits = [0_u32; 64];
        for damage in damages(stage(always(3), None), 8, 20_000).into_iter().flatten() {
            assert_eq!(damage.bits().len(), 3);
            assert!(damage.bits().windows(2).all(|pair| pair[0] < pair[1]));
            damage.bits().iter().for_each(|bit| hits[usize::try_from(*bit).unwrap()] += 1);
        }
        let expected = 60_000.0 / 64.0;
        let chi_square: f64 = hits.iter().map(|hits| (f64::from(*hits) - expected).powi(2) / expected).sum();
        assert!(chi_square < 119.0, "{chi_square}");
    }

    /// The number of flipped bits of 512 at a rate of 0.01 has the mean 5.12 and the variance 5.07. The mean of 20 000 packets has a standard error of 0.016.
    #[test]
    fn a_bit_error_rate_flips_that_fraction_of_the_bits() {
        let damages = damages(stage(Flips::Rate(Probability::new(0.01).unwrap()), None), 64, 20_000);
        let flipped: usize = damages.iter().flatten().map(|damage| damage.bits().len()).sum();
        assert!((flipped as f64 / 20_000.0 - 5.12).abs() < 4.5 * 0.016);
        // A packet is undamaged with probability 0.99^512 = 0.005832: 116.6 of 20 000 packets, Poisson.
        let whole = damages.iter().filter(|damage| damage.is_none()).count();
        assert!((68..=166).contains(&whole), "{whole}");
    }

    #[test]
    fn only_the_bytes_that_may_be_hit_are_hit_and_twice_is_whole_again() {
        for damage in damages(stage(always(5), Some(4..6)), 64, 100).into_iter().flatten() {
            assert!(damage.bits().iter().all(|bit| (32..48).contains(bit)));
            let mut bytes = [7; 64];
            damage.apply(&mut bytes);
            assert_ne!(bytes, [7; 64]);
            damage.apply(&mut bytes);
            assert_eq!(bytes, [7; 64]);
            assert_eq!(damage.clone().and(&damage), None);
            assert_eq!(damage.clone().and(&Damage::unknown()), Some(Damage::unknown()));
        }
        assert!(damages(stage(always(5), Some(u64::MAX - 1..u64::MAX)), u64::MAX, 10).iter().all(Option::is_none));
        assert_eq!(damages(stage(Flips::Rate(Probability::ONE), None), u64::MAX, 1)[0].as_ref().unwrap().bits().len(), 8 << 16);
        assert_eq!(damages(stage(always(u32::MAX), None), u64::MAX, 1)[0].as_ref().unwrap().bits().len(), 8 << 16);
        assert!(damages(stage(always(5), Some(70..80)), 64, 10).iter().all(Option::is_none));
        assert_eq!(damages(stage(always(99), Some(0..2)), 1, 1)[0].as_ref().unwrap().bits(), [0, 1, 2, 3, 4, 5, 6, 7]);
    }
}
