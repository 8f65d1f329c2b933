//! Ring buffer with values constructed in their place.

use alloc::vec::Vec;

/// First-in, first-out queue in a ring buffer. The buffer grows by doubling and never shrinks.
///
/// Unlike [`VecDeque`](alloc::collections::VecDeque), the ring constructs a value in its place, and can drop a value or take it apart in its place. A large
/// value is then not written to the stack first and moved as a whole afterwards.
///
/// ```
/// use cohaptic_wan::Ring;
///
/// let mut ring = Ring::new();
/// ring.push(|| "first");
/// ring.push(|| "second");
/// assert_eq!((ring.len(), ring.front()), (2, Some(&"first")));
/// assert_eq!((ring.pop(), ring.pop(), ring.pop()), (Some("first"), Some("second"), None));
/// ```
#[derive(Clone, Debug)]
pub struct Ring<T> {
    /// Slots of the ring: none, or a power of two, so a mask wraps an index. Exactly the `len` slots from `first` on, wrapped, are `Some`.
    places: Vec<Option<T>>,
    /// Index of the slot of the first value.
    first: usize,
    /// Index of the slot of the last value: one before `first`, wrapped, in an empty ring. Kept because each value of the event queue is compared with the
    /// last value before it is pushed.
    last: usize,
    /// Number of values.
    len: usize,
}

impl<T> Default for Ring<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> Ring<T> {
    /// Returns an empty ring without allocated memory.
    #[must_use]
    pub const fn new() -> Self {
        Self { places: Vec::new(), first: 0, last: usize::MAX, len: 0 }
    }

    /// Returns the number of values.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Returns whether the ring has no values.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the first value.
    #[must_use]
    #[inline(always)]
    pub fn front(&self) -> Option<&T> {
        self.places.get(self.first)?.as_ref()
    }

    /// Returns the first value, for a change.
    #[inline(always)]
    pub(crate) fn front_mut(&mut self) -> Option<&mut T> {
        self.places.get_mut(self.first)?.as_mut()
    }

    /// Returns the last value.
    #[must_use]
    #[inline(always)]
    pub(crate) fn back(&self) -> Option<&T> {
        // The slot before the first value is free in an empty ring, and beyond all slots if there are none.
        self.places.get(self.last)?.as_ref()
    }

    /// Adds a value after the last value. `make` constructs the value.
    #[inline(always)]
    pub fn push(&mut self, make: impl FnOnce() -> T) {
        if self.len == self.places.len() {
            self.grow();
        }
        let last = self.last.wrapping_add(1) & (self.places.len() - 1);
        let place = &mut self.places[last];
        // Always true: after `grow` the slot after the last value is free. With the test the compiler knows of no old value to drop, so the value can be
        // constructed in the slot.
        if place.is_none() {
            *place = Some(make());
            self.last = last;
            self.len += 1;
        }
    }

    /// Removes and returns the first value.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<T> {
        // The length is at hand, while the slot of an empty ring may have to be fetched from memory.
        if self.len == 0 {
            return None;
        }
        let value = self.places.get_mut(self.first)?.take();
        if value.is_some() {
            self.pass();
        }
        value
    }

    /// Adds a value before the first value.
    pub(crate) fn push_front(&mut self, value: T) {
        if self.len == self.places.len() {
            self.grow();
        }
        self.first = self.first.wrapping_sub(1) & (self.places.len() - 1);
        // The only value is also the last value.
        self.last = if self.len == 0 { self.first } else { self.last };
        self.places[self.first] = Some(value);
        self.len += 1;
    }

    /// Drops the first value in its place. Does nothing on an empty ring.
    #[inline(always)]
    pub(crate) fn drop_front(&mut self) {
        if self.len > 0 {
            drop(self.places[self.first].take());
            self.pass();
        }
    }

    /// Drops all values and keeps the memory.
    pub fn clear(&mut self) {
        while self.len > 0 {
            self.drop_front();
        }
    }

    /// Moves the beginning of the ring past the first slot. Its value was or will be taken. The ring must not be empty.
    #[inline(always)]
    fn pass(&mut self) {
        self.first = (self.first + 1) & (self.places.len() - 1);
        self.len -= 1;
    }

    /// Doubles the number of slots, at least to four. Every slot must hold a value.
    #[cold]
    #[inline(never)]
    fn grow(&mut self) {
        // The values are rotated to begin at slot 0, so the new slots lie after the last value.
        self.places.rotate_left(self.first);
        self.first = 0;
        self.last = self.places.len().wrapping_sub(1);
        let places = (2 * self.places.len()).max(4);
        self.places.resize_with(places, || None);
    }
}

#[cfg(test)]
mod tests {
    use alloc::collections::VecDeque;

    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    properties! {
        /// A number below 6 is a value to push; each of the other numbers stands for another operation.
        #[test]
        fn it_does_what_a_deque_does(acts in prop::collection::vec(0_u8..11, 0..200)) {
            let (mut ring, mut deque) = (Ring::new(), VecDeque::new());
            for act in acts {
                match act {
                    0..6 => {
                        ring.push(|| act);
                        deque.push_back(act);
                    }
                    6 | 7 => prop_assert_eq!(ring.pop(), deque.pop_front()),
                    8 => {
                        ring.drop_front();
                        deque.pop_front();
                    }
                    9 => {
                        ring.push_front(act);
                        deque.push_front(act);
                    }
                    _ if deque.len() > 20 => {
                        ring.clear();
                        deque.clear();
                    }
                    _ => {}
                }
                prop_assert_eq!((ring.len(), ring.is_empty()), (deque.len(), deque.is_empty()));
                prop_assert_eq!((ring.front(), ring.back()), (deque.front(), deque.back()));
            }
        }
    }
}
