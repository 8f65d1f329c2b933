//! Which combinations are run, where a campaign leaves out those that are refused.

use std::collections::BTreeMap;

/// Combinations that are left out, with the reason of each.
pub type Refused = BTreeMap<u64, String>;

/// The combinations that are run. Runs are counted from 0 without gaps here; the number of a run in the table counts those of refused combinations too, so
/// that it says which combination and which seed it is.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Accepted {
    of_each: u64,
    count: u64,
    /// In order.
    refused: Vec<u64>,
}

impl Accepted {
    pub(crate) fn new(combinations: u64, of_each: u64, refused: impl Iterator<Item = u64>) -> Self {
        let refused: Vec<u64> = refused.collect();
        Self { of_each, count: combinations - refused.len() as u64, refused }
    }

    /// How many runs a combination has.
    pub(crate) const fn of_each(&self) -> u64 {
        self.of_each
    }

    /// How many runs there are.
    pub(crate) const fn runs(&self) -> u64 {
        self.count * self.of_each
    }

    /// The combination of the run in that place, and which of its runs it is.
    pub(crate) fn run(&self, place: u64) -> (u64, u64) {
        let number = place / self.of_each;
        // Before the i-th refused combination c there are c − i that are run.
        let (mut low, mut high) = (0, self.refused.len());
        while low < high {
            let middle = usize::midpoint(low, high);
            if self.refused[middle] - middle as u64 <= number { low = middle + 1 } else { high = middle }
        }
        (number + low as u64, place % self.of_each)
    }

    /// The number in the table of the run in that place.
    pub(crate) fn number(&self, place: u64) -> u64 {
        let (combination, of_it) = self.run(place);
        combination * self.of_each + of_it
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_those_of_the_combinations_that_are_left() {
        for refused in [vec![], vec![0], vec![6], vec![0, 1, 2], vec![1, 3, 5], vec![0, 2, 3, 6], vec![1, 2, 3, 4, 5]] {
            let accepted = Accepted::new(7, 3, refused.iter().copied());
            let expected: Vec<(u64, u64)> = (0..7).filter(|c| !refused.contains(c)).flat_map(|c| (0..3).map(move |run| (c, run))).collect();
            assert_eq!((0..accepted.runs()).map(|place| accepted.run(place)).collect::<Vec<_>>(), expected, "{refused:?}");
        }
    }
}
