//! The datagrams on their way: what all receivers get is stored once, however many there are.

use std::num::NonZeroU32;

use cohaptic_peer::rotation::Attitude;
use cohaptic_peer::wire::{DecodeError, MAX_LEN, Sample, SampleKind};

/// A datagram in the store.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Handle(NonZeroU32);

/// Stores datagrams until their last copy has arrived or was dropped. Its memory is bounded by the datagrams on the way at once.
///
/// All receivers get the same bytes, so those are decoded once: with 10 peers that took a tenth off a packet.
#[derive(Clone, Debug, Default)]
pub(crate) struct Datagrams<const A: usize> {
    slots: Vec<Slot<A>>,
    free: Vec<Handle>,
    /// For each slot the extra numbers of its sample, by the place of the receiver; a single entry where they are the same for all. Empty where samples have
    /// none.
    extras: Vec<Vec<[f64; A]>>,
    /// For each slot the attitude of its sample. Empty where the object does not turn.
    attitudes: Vec<Attitude>,
}

#[derive(Clone, Debug)]
struct Slot<const A: usize> {
    /// What its bytes say.
    sample: Sample<A>,
    copies: usize,
}

impl<const A: usize> Datagrams<A> {
    /// Stores a datagram of `axes` axes which `write` writes, for `receivers` receivers (at least one). Gives its length too.
    ///
    /// # Errors
    ///
    /// [`DecodeError`] if nobody can read it.
    #[inline]
    pub(crate) fn store(
        &mut self,
        copies: usize,
        axes: usize,
        write: impl FnOnce(&mut [u8; MAX_LEN]) -> usize,
    ) -> Result<(Handle, usize), DecodeError> {
        let mut bytes = [0; MAX_LEN];
        let len = write(&mut bytes);
        let sample = Sample::decode(&bytes[..len], axes)?;
        let slot = Slot { sample, copies };
        let handle = match self.free.pop() {
            Some(handle) => {
                *self.slot_mut(handle) = slot;
                handle
            }
            None => self.grow(slot),
        };
        Ok((handle, len))
    }

    /// Stores a sample of that kind as [`Datagrams::store`] does: `write` appends the extra numbers by the place of the receiver, or one entry for all.
    ///
    /// # Errors
    ///
    /// [`DecodeError`] if nobody can read it.
    pub(crate) fn store_extended(
        &mut self,
        copies: usize,
        axes: usize,
        kind: SampleKind,
        sample: &Sample<A>,
        write: impl FnOnce(&mut Vec<[f64; A]>),
    ) -> Result<(Handle, usize), DecodeError> {
        let (handle, _) = self.store(copies, axes, |datagram| sample.encode(axes, datagram))?;
        let slot = handle.0.get() as usize - 1;
        if self.extras.len() <= slot {
            self.extras.resize(slot + 1, Vec::new());
        }
        let numbers = &mut self.extras[slot];
        numbers.clear();
        write(numbers);
        // Encoded and read again, numbers keep their bits: all that can be refused is one that is not finite.
        let refused = (0..axes).find(|axis| numbers.iter().any(|numbers| !numbers[*axis].is_finite()));
        if let Some(axis) = refused {
            self.slot_mut(handle).copies = 1;
            self.release(handle);
            return Err(DecodeError::NotFinite { axis, quantity: "extra number" });
        }
        Ok((handle, kind.datagram_len(axes)))
    }

    /// Gives a datagram an attitude.
    pub(crate) fn set_attitude(&mut self, handle: Handle, attitude: Attitude) {
        let slot = handle.0.get() as usize - 1;
        if self.attitudes.len() <= slot {
            self.attitudes.resize(slot + 1, Attitude::REST);
        }
        self.attitudes[slot] = attitude;
    }

    /// The attitude of a datagram; at rest where the object does not turn.
    pub(crate) fn attitude(&self, handle: Handle) -> Attitude {
        self.attitudes.get(handle.0.get() as usize - 1).copied().unwrap_or(Attitude::REST)
    }

    /// The extra numbers of a datagram for a receiver; zeros if it has none.
    pub(crate) fn extra(&self, handle: Handle, receiver: usize) -> [f64; A] {
        match self.extras.get(handle.0.get() as usize - 1).map(Vec::as_slice) {
            Some([one]) => *one,
            Some(each) => each.get(receiver).copied().unwrap_or([0.0; A]),
            None => [0.0; A],
        }
    }

    /// What a datagram says.
    #[inline]
    pub(crate) fn sample(&self, handle: Handle) -> &Sample<A> {
        &self.slots[handle.0.get() as usize - 1].sample
    }

    /// One copy more is on the way.
    pub(crate) fn retain(&mut self, handle: Handle) {
        self.slot_mut(handle).copies += 1;
    }

    /// One copy less is on the way.
    #[inline]
    pub(crate) fn release(&mut self, handle: Handle) {
        let slot = self.slot_mut(handle);
        slot.copies -= 1;
        if slot.copies == 0 {
            self.free.push(handle);
        }
    }

    fn grow(&mut self, slot: Slot<A>) -> Handle {
        self.slots.push(slot);
        let number = u32::try_from(self.slots.len()).ok().and_then(NonZeroU32::new);
        Handle(number.expect("fewer than 2^32 datagrams, 400 GB of them, are on the way at once"))
    }

    #[inline]
    fn slot_mut(&mut self, handle: Handle) -> &mut Slot<A> {
        &mut self.slots[handle.0.get() as usize - 1]
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_peer::State;
    use cohaptic_units::Instant;

    use super::*;

    #[test]
    fn a_slot_is_used_again_when_its_last_copy_is_released() {
        let mut datagrams = Datagrams::<1>::default();
        let store = |datagrams: &mut Datagrams<1>, copies, sequence| {
            let sample = Sample { session: 1, sender: 0, sequence, sent: Instant::ZERO, state: State::<1>::REST };
            datagrams.store(copies, 1, |bytes| sample.encode(1, bytes)).unwrap().0
        };
        let first = store(&mut datagrams, 2, 1);
        let second = store(&mut datagrams, 1, 2);
        datagrams.release(first);
        assert_eq!((datagrams.sample(first).sequence, datagrams.sample(second).sequence), (1, 2));
        datagrams.release(first);
        let third = store(&mut datagrams, 1, 3);
        assert_eq!(third, first);
        assert_eq!(datagrams.slots.len(), 2);
    }
}
