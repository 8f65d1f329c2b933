//! Words of a bucket: their bits, and their order.

use cohaptic_units::Instant;

use super::Entry;

/// Event in a bucket. The lower [`PLACE_BITS`] bits are the place in the store, the upper bits the lower bits of the instant \[ns\]. Within a bucket, words are
/// in the order of their instants, because a bucket ends where these bits begin anew, or before.
pub(super) type Packed = u64;

/// Number of bits of a place.
pub(super) const PLACE_BITS: u32 = 42;

/// Packs an entry into the word of its bucket.
pub(super) const fn pack((at, place): Entry) -> Packed {
    // The shift leaves the lower bits of the instant.
    at.as_nanos() << PLACE_BITS | place
}

/// Returns the entry of a word in the bucket that begins at `begin` \[ns\].
pub(super) const fn unpack(begin: u64, packed: Packed) -> Entry {
    let above = begin >> (u64::BITS - PLACE_BITS) << (u64::BITS - PLACE_BITS);
    (Instant::from_nanos(above | packed >> PLACE_BITS), packed & ((1 << PLACE_BITS) - 1))
}

/// Returns whether two successive entries have equal instants.
pub(super) fn has_ties(entries: &[Entry]) -> bool {
    entries.windows(2).any(|pair| pair[0].0 == pair[1].0)
}

/// Sorts at most [`FEW`] words of a bucket into `few`: in the order of instants, and words with equal instants in the order of the slice. The number of smaller
/// words is the index of a word, so no branch depends on the order of the words. A processor cannot predict this order.
pub(super) fn sort_few<'a>(words: &[Packed], few: &'a mut [Packed; FEW]) -> &'a [Packed] {
    // Instant and index in 32 bits with a sign, which processors compare by the vector. The keys are distinct, so no two ranks are equal.
    let mut keys = [i32::MAX; FEW];
    for ((key, word), index) in keys.iter_mut().zip(words).zip(0..) {
        *key = ((word >> PLACE_BITS) as i32) << FEW.ilog2() | index;
    }
    for (others, words_of_others) in keys.as_chunks::<LANES>().0.iter().zip(words.chunks(LANES)) {
        let mut ranks = [0_u32; LANES];
        for key in keys.iter().take(words.len()) {
            for (rank, other) in ranks.iter_mut().zip(others) {
                *rank += u32::from(other > key);
            }
        }
        for (word, rank) in words_of_others.iter().zip(ranks) {
            few[rank as usize % FEW] = *word;
        }
    }
    &few[..words.len()]
}

/// Largest number of words sorted by counting, a power of two.
pub(super) const FEW: usize = 32;
/// Number of words ranked at once: with more words at once, the ranks need more registers than there are.
const LANES: usize = 8;

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    properties! {
        /// Words come in the order of their instants in a bucket of the largest width, and words with equal instants in the order of the slice.
        #[test]
        fn few_words_are_sorted_by_instant(
            words in prop::collection::vec((prop_oneof![0..8_u64, Just((1_u64 << 22) - 1), 0..1_u64 << 22], 0..1_u64 << PLACE_BITS), 0..=FEW),
            bucket in 0..1_u64 << 42,
        ) {
            let begin = bucket << 22;
            let mut expected: Vec<Entry> = words.iter().map(|(nanos, place)| (Instant::from_nanos(begin + nanos), *place)).collect();
            let packed: Vec<Packed> = expected.iter().map(|entry| pack(*entry)).collect();
            expected.sort_by_key(|entry| entry.0);
            let sorted: Vec<Entry> = sort_few(&packed, &mut [0; FEW]).iter().map(|word| unpack(begin, *word)).collect();
            prop_assert_eq!(sorted, expected);
        }
    }
}
