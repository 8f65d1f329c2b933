//! Storage of the events of a calendar.

use alloc::vec::Vec;

use super::Event;

/// Storage of events with stable indices. Indices of removed events are reused.
#[derive(Clone, Debug)]
pub(super) struct Slab<E> {
    /// Events by index. `None` for a free index.
    places: Vec<Option<E>>,
    /// Free indices.
    free: Vec<u32>,
}

impl<E: Event> Slab<E> {
    pub(super) const fn new() -> Self {
        Self { places: Vec::new(), free: Vec::new() }
    }

    /// Stores an event constructed by `make`, and returns its index.
    #[inline(always)]
    pub(super) fn store(&mut self, make: impl FnOnce() -> E) -> u32 {
        let place = self.free.pop().unwrap_or_else(|| self.grow());
        let stored = &mut self.places[place as usize];
        // Always true: only free indices are handed out. With the test the compiler knows of no old event to drop, so the event can be constructed in its
        // place.
        if stored.is_none() {
            *stored = Some(make());
        }
        place
    }

    /// Adds an index without an event, and returns the index.
    #[cold]
    #[inline(never)]
    fn grow(&mut self) -> u32 {
        let place = u32::try_from(self.places.len()).expect("fewer than 2^32 events, 200 GB of them, are pending");
        self.places.push(None);
        place
    }

    /// Frees an index, and returns its place. The caller must take the event out of the place before the next call of `store`.
    #[inline(always)]
    pub(super) fn pass(&mut self, place: u32) -> &mut Option<E> {
        self.free.push(place);
        &mut self.places[place as usize]
    }

    /// Removes and returns the event at an index.
    #[inline]
    pub(super) fn take(&mut self, place: u32) -> Option<E> {
        self.free.push(place);
        self.places[place as usize].take()
    }

    /// Returns whether the key of the event at index `first` is at most the key of the event at index `second`. Not inlined, because the comparison of two keys
    /// is longer than everything around it, and rare.
    #[inline(never)]
    pub(super) fn are_in_order(&self, first: u32, second: u32) -> bool {
        self.key(first) <= self.key(second)
    }

    /// Returns the key of a stored event, or `None` for a free index.
    pub(super) fn key(&self, place: u32) -> Option<E::Key> {
        self.places[place as usize].as_ref().map(Event::key)
    }
}
