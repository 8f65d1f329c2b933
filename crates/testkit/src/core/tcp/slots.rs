//! Array of values with stable indices. An index is used again after the removal of its value.

/// Values with indices. The index of a value stays the same until the value is removed.
#[derive(Debug)]
pub(super) struct Slots<T> {
    places: Vec<Option<T>>,
    free: Vec<usize>,
}

impl<T> Default for Slots<T> {
    fn default() -> Self {
        Self { places: Vec::new(), free: Vec::new() }
    }
}

impl<T> Slots<T> {
    pub(super) fn insert(&mut self, value: T) -> usize {
        if let Some(place) = self.free.pop() {
            self.places[place] = Some(value);
            return place;
        }
        self.places.push(Some(value));
        self.places.len() - 1
    }

    pub(super) fn get(&self, place: usize) -> &T {
        self.places[place].as_ref().expect("a value is there as long as its number is held")
    }

    pub(super) fn get_mut(&mut self, place: usize) -> &mut T {
        self.places[place].as_mut().expect("a value is there as long as its number is held")
    }

    /// Returns the value at `place`, or `None` if the value was removed.
    pub(super) fn find(&self, place: usize) -> Option<&T> {
        self.places.get(place)?.as_ref()
    }

    /// Like [`Slots::find`], to change the value.
    pub(super) fn find_mut(&mut self, place: usize) -> Option<&mut T> {
        self.places.get_mut(place)?.as_mut()
    }

    pub(super) fn remove(&mut self, place: usize) -> Option<T> {
        let value = self.places[place].take();
        if value.is_some() {
            self.free.push(place);
        }
        value
    }

    /// Returns index and value of each entry, in ascending order of indices.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, &T)> {
        self.places.iter().enumerate().filter_map(|(place, value)| Some((place, value.as_ref()?)))
    }
}
