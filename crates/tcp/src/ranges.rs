//! A set of positions in the sequence space, kept as ranges.

use alloc::collections::BTreeMap;

use crate::sequence::Position;

/// Ranges of positions, as a map from the start of a range to its end (exclusive). Two ranges neither overlap nor touch.
#[derive(Clone, Default, Debug)]
pub(crate) struct Ranges(BTreeMap<Position, Position>);

impl Ranges {
    /// Adds the positions from `start` to `end` (exclusive). Calls `on_new`, in ascending order, with the start and the end of each part that was missing.
    pub(crate) fn insert(&mut self, start: Position, end: Position, mut on_new: impl FnMut(Position, Position)) {
        if start >= end {
            return;
        }
        // `from` and `to` bound the merged range. All positions of the new range below `covered` are known or were handed to `on_new`.
        let (mut from, mut to, mut covered) = (start, end, start);
        if let Some((&before, &before_end)) = self.0.range(..start).next_back()
            && before_end >= start
        {
            from = before;
            to = to.max(before_end);
            covered = before_end;
        }
        // `end` is included, because a range that begins there touches the new range and must be merged.
        while let Some((&next, &next_end)) = self.0.range(start..=end).next() {
            if next > covered {
                on_new(covered, next);
            }
            covered = covered.max(next_end);
            to = to.max(next_end);
            self.0.remove(&next);
        }
        if covered < end {
            on_new(covered, end);
        }
        // If a range before the new range was merged, its key is `from`, so that this entry replaces it.
        self.0.insert(from, to);
    }

    /// Removes all positions below `position`.
    pub(crate) fn remove_below(&mut self, position: Position) {
        while let Some(first) = self.0.first_entry().filter(|first| *first.key() < position) {
            let end = first.remove();
            if end > position {
                self.0.insert(position, end);
            }
        }
    }

    /// Returns the range that contains `position`.
    pub(crate) fn around(&self, position: Position) -> Option<(Position, Position)> {
        let (&start, &end) = self.0.range(..=position).next_back()?;
        (position < end).then_some((start, end))
    }

    /// Returns the first range that has positions from `start` to `end` (exclusive).
    pub(crate) fn first_within(&self, start: Position, end: Position) -> Option<(Position, Position)> {
        self.around(start).or_else(|| self.0.range(start..end.max(start)).next().map(|(&low, &high)| (low, high))).filter(|_| start < end)
    }

    /// Returns the end (exclusive) of the highest range.
    pub(crate) fn end(&self) -> Option<Position> {
        self.0.last_key_value().map(|(_, &end)| end)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    properties! {
        #[test]
        fn a_set_of_ranges_is_a_set(inserts in prop::collection::vec((0u64..60, 0u64..12), 0..20), cut in 0u64..70) {
            let mut ranges = Ranges::default();
            let mut model = [false; 80];
            for (start, length) in inserts {
                let mut heard = Vec::new();
                ranges.insert(start, start + length, |from, to| heard.extend(from..to));
                let new: Vec<u64> = (start..start + length).filter(|at| !model[usize::try_from(*at).unwrap()]).collect();
                prop_assert_eq!(heard, new);
                for at in start..start + length {
                    model[usize::try_from(at).unwrap()] = true;
                }
            }
            ranges.remove_below(cut);
            for (at, is_in) in (0u64..).zip(model) {
                prop_assert_eq!(ranges.around(at).is_some(), is_in && at >= cut);
            }
            for (start, end) in (0u64..70).flat_map(|start| (start..start + 8).map(move |end| (start, end))) {
                let first = (start..end).find_map(|at| ranges.around(at));
                prop_assert_eq!(ranges.first_within(start, end), first);
            }
            let edges: Vec<_> = ranges.0.iter().collect();
            prop_assert!(edges.windows(2).all(|pair| pair[0].1 < pair[1].0), "ranges touch: {:?}", edges);
        }
    }
}
