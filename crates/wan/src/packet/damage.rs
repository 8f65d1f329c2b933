//! The damage to a packet.

use alloc::sync::Arc;
use alloc::vec::Vec;

/// The bits of a packet that were flipped.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Damage(Arc<[u64]>);

impl Damage {
    /// The bits, ascending: 0 is the lowest bit of the first byte. None if a log is replayed that says only that there was damage.
    #[must_use]
    pub fn bits(&self) -> &[u64] {
        &self.0
    }

    /// Flips them. Bits beyond the end are left out.
    pub fn apply(&self, bytes: &mut [u8]) {
        for bit in &*self.0 {
            if let Some(byte) = usize::try_from(bit / 8).ok().and_then(|place| bytes.get_mut(place)) {
                *byte ^= 1 << (bit % 8);
            }
        }
    }

    /// Damage of which nobody knows where it is.
    pub(crate) fn unknown() -> Self {
        Self(Arc::from([]))
    }

    /// These bits, if there are any.
    pub(crate) fn of(mut bits: Vec<u64>) -> Option<Self> {
        bits.sort_unstable();
        (!bits.is_empty()).then(|| Self(bits.into()))
    }

    /// Both: a bit that is flipped twice is whole again. Where nobody knows which bits they were, there is damage still.
    pub(crate) fn and(self, other: &Self) -> Option<Self> {
        if self.0.is_empty() || other.0.is_empty() {
            return Some(Self::unknown());
        }
        let mut bits: Vec<u64> = self.0.iter().filter(|bit| !other.0.contains(bit)).copied().collect();
        bits.extend(other.0.iter().filter(|bit| !self.0.contains(bit)));
        Self::of(bits)
    }
}
