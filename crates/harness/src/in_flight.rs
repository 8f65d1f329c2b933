//! Samples in flight. A sample for several receivers is stored once.

use std::num::NonZeroU32;

use cohaptic_peer::rotation::Attitude;
use cohaptic_peer::wire::{Extra, Sample, SampleKind};

/// Index + 1 of a sample in the store. Valid until the last copy of the sample is released.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Handle(NonZeroU32);

/// Store of samples, each until its last copy has arrived or was dropped. The memory is bounded by the largest number of samples in flight at once.
///
/// A sample is stored as numbers. Bytes are made only for the receiver of a damaged packet, or for a socket.
#[derive(Clone, Debug)]
pub(crate) struct SamplesInFlight<const A: usize> {
    kind: SampleKind,
    /// Samples, indexed by handle − 1.
    slots: Vec<Slot<A>>,
    /// Handles of slots without a sample, the latest last.
    free: Vec<Handle>,
    /// Numbers beyond position and velocity, indexed like `slots`. Empty if the kind of sample has none.
    extended: Vec<Extended<A>>,
}

#[derive(Clone, Debug)]
struct Slot<const A: usize> {
    sample: Sample<A>,
    /// Copies in flight, at least 1 in a used slot.
    copies: usize,
}

/// Content of a sample beyond position and velocity.
#[derive(Clone, Debug)]
struct Extended<const A: usize> {
    /// Extra numbers, indexed by receiver, or a single entry for all receivers.
    numbers: Vec<[f64; A]>,
    attitude: Attitude,
}

impl<const A: usize> SamplesInFlight<A> {
    /// Returns an empty store for samples of the given kind.
    pub(crate) const fn new(kind: SampleKind) -> Self {
        Self { kind, slots: Vec::new(), free: Vec::new(), extended: Vec::new() }
    }

    /// Returns the kind of the samples.
    pub(crate) const fn kind(&self) -> SampleKind {
        self.kind
    }

    /// Stores a sample of `copies` packets (at least one).
    #[inline]
    pub(crate) fn store(&mut self, copies: usize, sample: Sample<A>) -> Handle {
        let slot = Slot { sample, copies };
        // The slot freed last is used first, because its memory is most likely in the cache.
        match self.free.pop() {
            Some(handle) => {
                *self.slot_mut(handle) = slot;
                handle
            }
            None => self.grow(slot),
        }
    }

    /// Stores a sample with an attitude and with the extra numbers appended by `write`: one entry for each receiver, by index, or one entry for all.
    ///
    /// Returns `None` if an extra number of the first `axes` axes is not finite: no receiver would accept the sample.
    pub(crate) fn store_extended(
        &mut self,
        (copies, axes): (usize, usize),
        sample: Sample<A>,
        attitude: Attitude,
        write: impl FnOnce(&mut Vec<[f64; A]>),
    ) -> Option<Handle> {
        let handle = self.store(copies, sample);
        let slot = handle.place();
        // `extended` grows on demand: samples of the kind `State` never need an entry.
        if self.extended.len() <= slot {
            self.extended.resize(slot + 1, Extended { numbers: Vec::new(), attitude: Attitude::REST });
        }
        let extended = &mut self.extended[slot];
        extended.attitude = attitude;
        // The vector keeps its allocation from sample to sample.
        extended.numbers.clear();
        write(&mut extended.numbers);
        if extended.numbers.iter().flat_map(|numbers| &numbers[..axes]).all(|number| number.is_finite()) {
            return Some(handle);
        }
        // The slot becomes free again: no packet refers to this sample.
        self.free.push(handle);
        None
    }

    /// Returns the content of a sample beyond position and velocity, for the receiver at the given index of the session.
    #[inline(always)]
    pub(crate) fn extra(&self, handle: Handle, receiver: usize) -> Extra<A> {
        if self.kind == SampleKind::State { Extra::NONE } else { self.stored_extra(handle, receiver) }
    }

    fn stored_extra(&self, handle: Handle, receiver: usize) -> Extra<A> {
        let Extended { numbers, attitude } = &self.extended[handle.place()];
        // A single entry is meant for all receivers.
        let numbers = if let [one] = numbers[..] { one } else { numbers[receiver] };
        let receiver = if self.kind.is_personal() { u32::try_from(receiver).unwrap_or(u32::MAX) } else { 0 };
        Extra { receiver, numbers, attitude: *attitude }
    }

    /// Returns position and velocity of a sample, with its session, sender, sequence number and instant.
    #[inline]
    pub(crate) fn sample(&self, handle: Handle) -> &Sample<A> {
        &self.slots[handle.place()].sample
    }

    /// Adds a copy in flight.
    pub(crate) fn retain(&mut self, handle: Handle) {
        self.slot_mut(handle).copies += 1;
    }

    /// Removes a copy in flight. The last copy frees the slot.
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
        Handle(number.expect("fewer than 2^32 samples, 400 GB of them, are on the way at once"))
    }

    #[inline]
    fn slot_mut(&mut self, handle: Handle) -> &mut Slot<A> {
        &mut self.slots[handle.place()]
    }
}

impl Handle {
    #[inline(always)]
    const fn place(self) -> usize {
        self.0.get() as usize - 1
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_peer::State;
    use cohaptic_units::Instant;

    use super::*;

    fn sample(sequence: u64) -> Sample<1> {
        Sample { session: 1, sender: 0, sequence, sent: Instant::ZERO, state: State::<1>::REST }
    }

    #[test]
    fn a_slot_is_used_again_when_its_last_copy_is_released() {
        let mut samples = SamplesInFlight::<1>::new(SampleKind::State);
        let first = samples.store(2, sample(1));
        let second = samples.store(1, sample(2));
        samples.release(first);
        assert_eq!((samples.sample(first).sequence, samples.sample(second).sequence), (1, 2));
        samples.release(first);
        let third = samples.store(1, sample(3));
        assert_eq!(third, first);
        assert_eq!(samples.slots.len(), 2);
    }

    /// A number beyond the axes of the scene is not sent, so its value does not matter.
    #[test]
    fn a_number_that_is_not_finite_takes_no_slot() {
        let mut samples = SamplesInFlight::<3>::new(SampleKind::Wave);
        let wide = Sample::<3> { session: 1, sender: 0, sequence: 0, sent: Instant::ZERO, state: State::REST };
        let mut store = |numbers: [f64; 3]| {
            samples.store_extended((2, 2), wide, Attitude::REST, |all| all.extend([[0.0; 3], numbers])).map(|handle| samples.extra(handle, 1))
        };
        assert_eq!(store([0.0, f64::INFINITY, 0.0]), None);
        let extra = store([1.0, 2.0, f64::INFINITY]).map(|extra| (extra.receiver, extra.numbers));
        assert_eq!(extra, Some((1, [1.0, 2.0, f64::INFINITY])));
        assert_eq!(samples.slots.len(), 1);
    }
}
