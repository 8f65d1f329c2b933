//! The accepted combinations of a campaign which leaves out refused combinations.

use std::collections::BTreeMap;

/// Left out combinations, each with the reason of its refusal.
pub type Refused = BTreeMap<u64, String>;

/// The accepted combinations. A *place* counts the accepted runs from 0 without gaps. A *number*, the identity of a run in the table, also counts the runs of
/// refused combinations, and so gives combination and seed.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Accepted {
    of_each: u64,
    count: u64,
    /// Refused combinations in rising order.
    refused: Vec<u64>,
}

impl Accepted {
    pub(crate) fn new(combinations: u64, of_each: u64, refused: impl Iterator<Item = u64>) -> Self {
        let refused: Vec<u64> = refused.collect();
        Self { of_each, count: combinations - refused.len() as u64, refused }
    }

    /// Returns the number of runs per combination.
    pub(crate) const fn of_each(&self) -> u64 {
        self.of_each
    }

    /// Returns the number of runs of all accepted combinations.
    pub(crate) const fn runs(&self) -> u64 {
        self.count * self.of_each
    }

    /// Returns the combination of the run at a place, and the index of the run within the combination.
    pub(crate) fn run(&self, place: u64) -> (u64, u64) {
        let number = place / self.of_each;
        // Before the i-th refused combination c there are c − i accepted combinations, a number which never falls with i. The search finds the count of refused
        // combinations before the wanted accepted combination.
        let (mut low, mut high) = (0, self.refused.len());
        while low < high {
            let middle = usize::midpoint(low, high);
            if self.refused[middle] - middle as u64 <= number { low = middle + 1 } else { high = middle }
        }
        (number + low as u64, place % self.of_each)
    }

    /// Returns the number, in the table, of the run at a place.
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
