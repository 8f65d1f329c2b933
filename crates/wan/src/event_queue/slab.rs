//! Storage with stable indices.

use alloc::vec::Vec;

use cohaptic_units::Instant;

use super::{Event, Place, Store};

/// Storage of values with stable indices. Indices of removed values are reused.
#[derive(Clone, Debug)]
pub(crate) struct Slab<T> {
    /// Values by index. `None` for a free index.
    places: Vec<Option<T>>,
    /// Free indices.
    free: Vec<u32>,
}

/// Greatest number of values. The 42 bits of a [`Place`] then have room for an index and the number of a node.
const MOST: u32 = 1 << 26;

impl<T> Slab<T> {
    pub(crate) const fn new() -> Self {
        Self { places: Vec::new(), free: Vec::new() }
    }

    /// Stores a value constructed by `make`, and returns its index.
    #[inline(always)]
    pub(crate) fn insert(&mut self, make: impl FnOnce() -> T) -> u32 {
        let index = self.free.pop().unwrap_or_else(|| self.grow());
        let stored = &mut self.places[index as usize];
        // Always true: only free indices are handed out. With the test the compiler knows of no old value to drop, so the value can be constructed in its
        // place.
        if stored.is_none() {
            *stored = Some(make());
        }
        index
    }

    /// Adds an index without a value, and returns the index.
    #[cold]
    #[inline(never)]
    fn grow(&mut self) -> u32 {
        let index = u32::try_from(self.places.len()).ok().filter(|index| *index < MOST);
        self.places.push(None);
        index.expect("fewer than 2^26 broadcasts and single events, 3 GB of them, are pending")
    }

    /// Removes and returns the value at an index.
    #[inline(always)]
    pub(crate) fn remove(&mut self, index: u32) -> Option<T> {
        self.free.push(index);
        self.places[index as usize].take()
    }

    /// Returns the value at an index, or `None` for a free index.
    #[inline(always)]
    pub(crate) fn get(&self, index: u32) -> Option<&T> {
        self.places[index as usize].as_ref()
    }

    /// Returns the value at an index for a change, or `None` for a free index.
    #[inline(always)]
    pub(crate) fn get_mut(&mut self, index: u32) -> Option<&mut T> {
        self.places[index as usize].as_mut()
    }
}

impl<E: Event> Store<E> for Slab<E> {
    #[inline(always)]
    fn store(&mut self, make: impl FnOnce() -> E) -> Place {
        self.insert(make).into()
    }

    #[inline(always)]
    fn take(&mut self, _at: Instant, place: Place) -> Option<E> {
        self.remove(index(place))
    }

    fn key(&self, _at: Instant, place: Place) -> Option<E::Key> {
        self.get(index(place)).map(Event::key)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "places of a slab are its indices")]
fn index(place: Place) -> u32 {
    place as u32
}
