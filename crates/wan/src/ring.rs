//! A queue whose values are written where they stay.

use alloc::vec::Vec;

/// Values in the order in which they came, in memory that is used again.
///
/// Other than with [`VecDeque`](alloc::collections::VecDeque), a value is made in its place, and can be taken apart there: one that is made elsewhere is written in parts
/// and moved as a whole, for which a processor waits. Where packets are small that was a tenth of their time.
///
/// ```
/// use cohaptic_wan::Ring;
///
/// let mut ring = Ring::new();
/// ring.push(|| "first");
/// ring.push(|| "second");
/// assert_eq!((ring.len(), ring.front(), ring.back()), (2, Some(&"first"), Some(&"second")));
/// assert_eq!((ring.pop(), ring.pop(), ring.pop()), (Some("first"), Some("second"), None));
/// ```
#[derive(Clone, Debug)]
pub struct Ring<T> {
    /// None, or a power of two. Those behind the last value are `None`.
    places: Vec<Option<T>>,
    first: usize,
    len: usize,
}

impl<T> Default for Ring<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> Ring<T> {
    /// An empty ring, which takes no memory.
    #[must_use]
    pub const fn new() -> Self {
        Self { places: Vec::new(), first: 0, len: 0 }
    }

    /// How many values there are.
    #[must_use]
    #[inline]
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    #[must_use]
    #[inline]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The first value.
    #[must_use]
    #[inline(always)]
    pub fn front(&self) -> Option<&T> {
        self.places.get(self.first)?.as_ref()
    }

    /// The first value, to be changed.
    #[must_use]
    #[inline(always)]
    pub fn front_mut(&mut self) -> Option<&mut T> {
        self.places.get_mut(self.first)?.as_mut()
    }

    /// The last value.
    #[must_use]
    #[inline(always)]
    pub fn back(&self) -> Option<&T> {
        let last = self.len.checked_sub(1)?;
        self.places[(self.first + last) & (self.places.len() - 1)].as_ref()
    }

    /// Makes a value behind the last.
    #[inline(always)]
    pub fn push(&mut self, make: impl FnOnce() -> T) {
        if self.len == self.places.len() {
            self.grow();
        }
        let place = (self.first + self.len) & (self.places.len() - 1);
        let place = &mut self.places[place];
        // It always is: where it is known, nothing is dropped there, and the value is not made elsewhere first.
        if place.is_none() {
            *place = Some(make());
            self.len += 1;
        }
    }

    /// Takes the first value out.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<T> {
        // An empty place need not be looked at.
        if self.len == 0 {
            return None;
        }
        let value = self.places.get_mut(self.first)?.take();
        if value.is_some() {
            self.pass();
        }
        value
    }

    /// Drops the first value where it lies, if there is one.
    #[inline(always)]
    pub fn drop_front(&mut self) {
        if self.len > 0 {
            drop(self.places[self.first].take());
            self.pass();
        }
    }

    /// Passes the first value, which is to be taken out of the place where it lies.
    #[inline(always)]
    pub(crate) fn pass_front(&mut self) -> Option<&mut Option<T>> {
        let first = self.first;
        if self.len == 0 {
            return None;
        }
        self.pass();
        self.places.get_mut(first)
    }

    /// Drops all values, and keeps the memory.
    pub fn clear(&mut self) {
        while self.len > 0 {
            self.drop_front();
        }
    }

    /// The first place is empty.
    #[inline(always)]
    fn pass(&mut self) {
        self.first = (self.first + 1) & (self.places.len() - 1);
        self.len -= 1;
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self) {
        // All places are taken: the first value comes to the first place.
        self.places.rotate_left(self.first);
        self.first = 0;
        let places = (2 * self.places.len()).max(4);
        self.places.resize_with(places, || None);
    }
}

#[cfg(test)]
mod tests {
    use alloc::collections::VecDeque;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Numbers below 6 are values, others what else can be done.
        #[test]
        fn it_does_what_a_deque_does(acts in prop::collection::vec(0_u8..10, 0..200)) {
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
                    _ if deque.len() > 20 => {
                        ring.clear();
                        deque.clear();
                    }
                    _ => {
                        if let Some(front) = ring.front_mut() {
                            *front ^= 128;
                            deque[0] ^= 128;
                        }
                    }
                }
                prop_assert_eq!((ring.len(), ring.is_empty()), (deque.len(), deque.is_empty()));
                prop_assert_eq!((ring.front(), ring.back()), (deque.front(), deque.back()));
            }
        }
    }
}
