//! Damage to a packet: flipped bits.

use alloc::sync::Arc;
use alloc::vec::Vec;

/// Flipped bits of a packet.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Damage(Arc<[u64]>);

impl Damage {
    /// Returns the indices of the flipped bits in ascending order. Bit 0 is the lowest bit of the first byte. Empty if the bits are unknown, as in the replay
    /// of a log, because a log records only the fact of damage.
    #[must_use]
    pub fn bits(&self) -> &[u64] {
        &self.0
    }

    /// Flips the bits in `bytes`. Bits beyond the end are left out.
    pub fn apply(&self, bytes: &mut [u8]) {
        for bit in &*self.0 {
            if let Some(byte) = usize::try_from(bit / 8).ok().and_then(|place| bytes.get_mut(place)) {
                *byte ^= 1 << (bit % 8);
            }
        }
    }

    /// Returns damage with unknown bits, stored as an empty list.
    pub(crate) fn unknown() -> Self {
        Self(Arc::from([]))
    }

    /// Returns the damage of flipped bits in any order, or `None` for an empty list.
    pub(crate) fn of(mut bits: Vec<u64>) -> Option<Self> {
        bits.sort_unstable();
        (!bits.is_empty()).then(|| Self(bits.into()))
    }

    /// Returns the damage of two flips in turn, or `None` if all bits are whole again: a bit flipped twice is whole. If the bits of one damage are unknown,
    /// the bits of the result are unknown too.
    pub(crate) fn and(self, other: &Self) -> Option<Self> {
        // Unknown bits may cancel or not, so nothing about the result is known.
        if self.0.is_empty() || other.0.is_empty() {
            return Some(Self::unknown());
        }
        let mut bits: Vec<u64> = self.0.iter().filter(|bit| !other.0.contains(bit)).copied().collect();
        bits.extend(other.0.iter().filter(|bit| !self.0.contains(bit)));
        Self::of(bits)
    }
}
