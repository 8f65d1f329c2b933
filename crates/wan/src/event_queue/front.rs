//! Events of a calendar in the order of taking.

use alloc::vec::Vec;

use super::Entry;

/// Sorted entries. The first entry is removed at a constant cost, and a new entry mostly belongs near the end.
///
/// Unlike a [`VecDeque`](alloc::collections::VecDeque), the entries are one slice, so neither a search nor an insertion has to look for the end of the memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Front {
    /// Removed entries, followed by the entries in order. Empty if there are no entries.
    places: Vec<Entry>,
    /// Number of removed entries in `places`.
    removed: usize,
}

/// Number of last entries, at most, that an insertion compares one by one before a binary search among the others.
const NEAR: usize = 8;

impl Front {
    /// Returns the first entry.
    #[inline(always)]
    pub(super) fn first(&self) -> Option<&Entry> {
        self.places.get(self.removed)
    }

    /// Removes and returns the first entry.
    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<Entry> {
        let first = *self.first()?;
        self.removed += 1;
        if self.removed == self.places.len() {
            self.places.clear();
            self.removed = 0;
        }
        Some(first)
    }

    /// Returns all entries, in order.
    #[inline(always)]
    pub(super) fn entries(&self) -> &[Entry] {
        &self.places[self.removed..]
    }

    /// Removes the first `count` entries, of at least as many.
    #[inline(always)]
    pub(super) fn drop_first(&mut self, count: usize) {
        self.removed += count;
        if self.removed >= self.places.len() {
            self.places.clear();
            self.removed = 0;
        }
    }

    /// Inserts an entry after the entries that precede the entry: a beginning of all entries.
    pub(super) fn insert(&mut self, entry: Entry, precedes: impl Fn(&Entry) -> bool) {
        // The memory of removed entries is used again once they are the larger part, so that an entry is moved once on average.
        if self.places.len() == self.places.capacity() && 2 * self.removed >= self.places.len() {
            self.places.drain(..self.removed);
            self.removed = 0;
        }
        let mut place = self.places.len();
        let near = place.saturating_sub(NEAR).max(self.removed);
        self.places.push(entry);
        // Events of a burst are pushed in order, or nearly so: the last entries move up one by one.
        while place > near && !precedes(&self.places[place - 1]) {
            self.places[place] = self.places[place - 1];
            place -= 1;
        }
        if place == near {
            place = self.removed + self.places[self.removed..near].partition_point(precedes);
            self.places.copy_within(place..near, place + 1);
        }
        self.places[place] = entry;
    }

    /// Fills an empty front. The caller puts the entries in order.
    pub(super) fn refill(&mut self, entries: impl Iterator<Item = Entry>) -> &mut [Entry] {
        self.places.extend(entries);
        &mut self.places
    }

    /// Returns all entries, in order.
    pub(super) fn into_entries(mut self) -> Vec<Entry> {
        self.places.drain(..self.removed);
        self.places
    }
}

#[cfg(test)]
mod tests {
    use alloc::collections::BTreeSet;

    use cohaptic_tests_common::properties;
    use cohaptic_units::Instant;
    use proptest::prelude::*;

    use super::*;

    properties! {
        /// A number below 200 is the instant of an entry to insert; each of the other numbers removes the first entry.
        #[test]
        fn entries_come_out_in_order(acts in prop::collection::vec(0_u64..300, 0..500)) {
            let (mut front, mut set) = (Front::default(), BTreeSet::new());
            let mut most = 1;
            for (number, act) in (0..).zip(acts) {
                if act < 200 {
                    let entry = (Instant::from_nanos(act), number);
                    front.insert(entry, |other| *other < entry);
                    set.insert(entry);
                } else {
                    prop_assert_eq!(front.pop(), set.pop_first());
                }
                prop_assert_eq!(front.first(), set.first());
                // Removed entries keep no more memory than the growth of a vector.
                most = most.max(set.len());
                prop_assert!(front.places.capacity() <= 4 * most);
            }
            prop_assert_eq!(front.into_entries(), set.into_iter().collect::<Vec<_>>());
        }
    }
}
