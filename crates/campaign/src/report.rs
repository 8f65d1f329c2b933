//! What a campaign comes to.

use std::path::PathBuf;

use crate::table::Gist;

/// What a campaign comes to, taken from its table.
#[derive(Clone, PartialEq, Debug)]
pub struct Report {
    /// The table.
    pub file: PathBuf,
    /// How many runs it has.
    pub runs: u64,
    /// How many of them were done this time; the others were there already.
    pub computed: u64,
    /// The combinations, in order.
    pub combinations: Vec<CombinationReport>,
}

/// What the runs of one combination come to.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct CombinationReport {
    /// How many runs there are.
    pub runs: u64,
    /// How many of them diverged.
    pub diverged: u64,
    /// The mean over those that did not of the largest distance along an axis between two copies \[m\]; `None` if all diverged.
    pub mean_discrepancy: Option<f64>,
    /// The largest of these distances \[m\]; `None` if all diverged.
    pub largest_discrepancy: Option<f64>,
    /// The run that it is from: the first of those that have it.
    pub worst_run: Option<u64>,
}

impl Report {
    /// How many runs diverged.
    #[must_use]
    pub fn diverged(&self) -> u64 {
        self.combinations.iter().map(|combination| combination.diverged).sum()
    }

    /// The combination with the largest discrepancy among runs that did not diverge; `None` if all did.
    #[must_use]
    pub fn worst(&self) -> Option<&CombinationReport> {
        let discrepancy = |combination: &CombinationReport| combination.largest_discrepancy.unwrap_or(f64::NEG_INFINITY);
        let worst = self.combinations.iter().rev().max_by(|one, other| discrepancy(one).total_cmp(&discrepancy(other)));
        worst.filter(|worst| worst.largest_discrepancy.is_some())
    }
}

/// Takes the runs one by one, in order.
#[derive(Debug)]
pub(crate) struct Tally {
    of_each: u64,
    runs: u64,
    combinations: Vec<CombinationReport>,
}

impl Tally {
    pub(crate) const fn new(of_each: u64) -> Self {
        Self { of_each, runs: 0, combinations: Vec::new() }
    }

    pub(crate) fn add(&mut self, gist: Gist) {
        if self.runs.is_multiple_of(self.of_each) {
            self.combinations.push(CombinationReport::default());
        }
        let run = self.runs;
        self.runs += 1;
        let Some(combination) = self.combinations.last_mut() else { return };
        combination.runs += 1;
        if gist.diverged {
            combination.diverged += 1;
            return;
        }
        // The sum for now.
        combination.mean_discrepancy = Some(combination.mean_discrepancy.unwrap_or(0.0) + gist.max_discrepancy);
        if combination.largest_discrepancy.is_none_or(|largest| gist.max_discrepancy > largest) {
            combination.largest_discrepancy = Some(gist.max_discrepancy);
            combination.worst_run = Some(run);
        }
    }

    /// How many runs were taken.
    pub(crate) const fn runs(&self) -> u64 {
        self.runs
    }

    pub(crate) fn combinations(mut self) -> Vec<CombinationReport> {
        for combination in &mut self.combinations {
            #[expect(clippy::cast_precision_loss, reason = "fewer runs than 2^52")]
            let counted = (combination.runs - combination.diverged) as f64;
            combination.mean_discrepancy = combination.mean_discrepancy.map(|sum| sum / counted);
        }
        self.combinations
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_summed_up_by_combination_without_those_that_diverged() {
        let mut tally = Tally::new(3);
        for (diverged, max_discrepancy) in
            [(false, 1.0), (true, f64::INFINITY), (false, 4.0), (true, 5.0), (true, 6.0), (true, f64::NAN), (false, 4.0)]
        {
            tally.add(Gist { diverged, max_discrepancy });
        }
        assert_eq!(tally.runs(), 7);
        let combinations = tally.combinations();
        let [first, second, third] = combinations.as_slice() else { panic!("three of three, three and one") };
        let expected = CombinationReport { runs: 3, diverged: 1, mean_discrepancy: Some(2.5), largest_discrepancy: Some(4.0), worst_run: Some(2) };
        assert_eq!(*first, expected);
        assert_eq!(*second, CombinationReport { runs: 3, diverged: 3, ..CombinationReport::default() });
        assert_eq!((third.worst_run, third.mean_discrepancy), (Some(6), Some(4.0)));
        let report = Report { file: PathBuf::new(), runs: 7, computed: 7, combinations };
        assert_eq!((report.diverged(), report.worst().and_then(|worst| worst.worst_run)), (4, Some(2)), "of equal ones the first");
    }
}
