//! The datagrams on their way: each is stored once, however many receivers it has.

use std::num::NonZeroU32;

use cohaptic_peer::wire::MAX_LEN;

/// A datagram in the store.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Handle(NonZeroU32);

/// Stores datagrams until their last copy has arrived or was dropped. Its memory is bounded by what is on the way at once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Datagrams {
    slots: Vec<Slot>,
    free: Vec<Handle>,
}

#[derive(Clone, Debug)]
struct Slot {
    bytes: [u8; MAX_LEN],
    len: usize,
    copies: usize,
}

impl Datagrams {
    /// Stores what `write` writes, of the length it gives, for that many receivers (at least one).
    #[inline]
    pub(crate) fn store(&mut self, copies: usize, write: impl FnOnce(&mut [u8; MAX_LEN]) -> usize) -> (Handle, usize) {
        let handle = self.free.pop().unwrap_or_else(|| self.grow());
        let slot = self.slot_mut(handle);
        slot.copies = copies;
        slot.len = write(&mut slot.bytes);
        (handle, slot.len)
    }

    /// The bytes of a datagram.
    #[inline]
    pub(crate) fn bytes(&self, handle: Handle) -> &[u8] {
        let slot = &self.slots[handle.0.get() as usize - 1];
        &slot.bytes[..slot.len]
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

    fn grow(&mut self) -> Handle {
        self.slots.push(Slot { bytes: [0; MAX_LEN], len: 0, copies: 0 });
        let number = u32::try_from(self.slots.len()).ok().and_then(NonZeroU32::new);
        Handle(number.expect("fewer than 2^32 datagrams, 400 GB of them, are on the way at once"))
    }

    #[inline]
    fn slot_mut(&mut self, handle: Handle) -> &mut Slot {
        &mut self.slots[handle.0.get() as usize - 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_used_again_when_its_last_copy_is_released() {
        let mut datagrams = Datagrams::default();
        let write = |byte: u8| {
            move |bytes: &mut [u8; MAX_LEN]| {
                bytes[0] = byte;
                1
            }
        };
        let (first, _) = datagrams.store(2, write(1));
        let (second, _) = datagrams.store(1, write(2));
        datagrams.release(first);
        assert_eq!((datagrams.bytes(first), datagrams.bytes(second)), (&[1][..], &[2][..]));
        datagrams.release(first);
        let (third, _) = datagrams.store(1, write(3));
        assert_eq!(third, first);
        assert_eq!(datagrams.slots.len(), 2);
    }
}
