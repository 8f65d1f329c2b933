//! The summary of a campaign, and the quantiles of the runs of a combination.

use std::sync::Arc;

use crate::judgement::Judgement;
use crate::plan::{Accepted, Refused};
use crate::table::Gist;

/// Summary of a campaign, computed from its table.
#[derive(Clone, PartialEq, Debug)]
pub struct Report {
    /// Number of runs.
    pub runs: u64,
    /// Number of runs done by this call; the other runs were stored before.
    pub computed: u64,
    /// Summaries, indexed by combination. Left out combinations have 0 runs.
    pub combinations: Vec<CombinationReport>,
    /// Quantiles, indexed by combination; `None` if no run of the combination came to its end. Empty beyond [`MOST_RUNS_OF_QUANTILES`] or
    /// [`MOST_COMBINATIONS_OF_QUANTILES`], where the memory would not suffice.
    pub quantiles: Vec<Option<Quantiles>>,
    /// Judgements, indexed by combination; empty without verdicts.
    pub judgements: Arc<[Judgement]>,
    /// Left out combinations, each with its reason.
    pub refused: Refused,
}

/// Summary of the runs of one combination.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct CombinationReport {
    /// Number of runs.
    pub runs: u64,
    /// Number of diverged runs.
    pub diverged: u64,
    /// Mean, over the runs without divergence, of the largest distance along an axis between two copies \[m\]; `None` if all runs diverged.
    pub mean_discrepancy: Option<f64>,
    /// Largest of these distances \[m\]; `None` if all runs diverged.
    pub largest_discrepancy: Option<f64>,
    /// Number of the run with the largest distance, the first of equals; `None` if all runs diverged.
    pub worst_run: Option<u64>,
}

impl Report {
    /// Returns the number of diverged runs.
    #[must_use]
    pub fn diverged(&self) -> u64 {
        self.combinations.iter().map(|combination| combination.diverged).sum()
    }

    /// Returns the combination with the largest discrepancy among runs without divergence, the first of equals; `None` if all runs diverged.
    #[must_use]
    pub fn worst(&self) -> Option<&CombinationReport> {
        let discrepancy = |combination: &CombinationReport| combination.largest_discrepancy.unwrap_or(f64::NEG_INFINITY);
        // `max_by` returns the last of equals, so the reversed order gives the first.
        let worst = self.combinations.iter().rev().max_by(|one, other| discrepancy(one).total_cmp(&discrepancy(other)));
        worst.filter(|worst| worst.largest_discrepancy.is_some())
    }
}

/// Sums up the runs of a table, in the order of the rows.
#[derive(Debug)]
pub(crate) struct Tally<'a> {
    accepted: &'a Accepted,
    /// Number of all combinations, including left out combinations.
    all: u64,
    runs: u64,
    /// Number of runs still to come for the current combination.
    left: u64,
    combinations: Vec<CombinationReport>,
    /// Largest discrepancies \[m\] of the runs of the current combination without divergence; `None` if the quantiles would take too much memory.
    discrepancies: Option<Vec<f64>>,
    quantiles: Vec<Option<Quantiles>>,
}

impl<'a> Tally<'a> {
    pub(crate) fn new(of_each: u64, combinations: u64, accepted: &'a Accepted) -> Self {
        let kept = of_each <= MOST_RUNS_OF_QUANTILES && combinations <= MOST_COMBINATIONS_OF_QUANTILES;
        Self { accepted, all: combinations, runs: 0, left: 0, combinations: Vec::new(), discrepancies: kept.then(Vec::new), quantiles: Vec::new() }
    }

    pub(crate) fn add(&mut self, gist: Gist) {
        // Only the first run of a combination looks the combination up, so most runs need neither a division nor a search.
        if self.left == 0 {
            self.begin(self.accepted.run(self.runs).0 + 1);
            self.left = self.accepted.of_each();
        }
        let place = self.runs;
        self.left -= 1;
        self.runs += 1;
        // `begin` has added the combination of this run before.
        let Some(combination) = self.combinations.last_mut() else { return };
        combination.runs += 1;
        // A diverged run may have an infinite distance or NaN, which would spoil mean and quantiles.
        if gist.diverged {
            combination.diverged += 1;
            return;
        }
        if let Some(discrepancies) = &mut self.discrepancies {
            discrepancies.push(gist.max_discrepancy);
        }
        // The field holds the sum until `finish` divides it.
        combination.mean_discrepancy = Some(combination.mean_discrepancy.unwrap_or(0.0) + gist.max_discrepancy);
        // Strictly larger, so that the first of equal runs is reported.
        if combination.largest_discrepancy.is_none_or(|largest| gist.max_discrepancy > largest) {
            combination.largest_discrepancy = Some(gist.max_discrepancy);
            combination.worst_run = Some(self.accepted.number(place));
        }
    }

    /// Returns the number of runs added so far.
    pub(crate) const fn runs(&self) -> u64 {
        self.runs
    }

    /// Ends the current combination, and begins combinations until there are `count`. The combinations in between are left out, and stay empty.
    fn begin(&mut self, count: u64) {
        while (self.combinations.len() as u64) < count {
            self.end_combination();
            self.combinations.push(CombinationReport::default());
        }
    }

    /// Computes the quantiles of the current combination, if there is one.
    fn end_combination(&mut self) {
        if let Some(discrepancies) = self.discrepancies.as_mut().filter(|_| !self.combinations.is_empty()) {
            self.quantiles.push(Quantiles::of(discrepancies));
            discrepancies.clear();
        }
    }

    /// Returns the summaries and the quantiles, both indexed by combination.
    pub(crate) fn finish(mut self) -> (Vec<CombinationReport>, Vec<Option<Quantiles>>) {
        // Left out combinations after the last run still need an empty report.
        self.begin(self.all);
        self.end_combination();
        for combination in &mut self.combinations {
            #[expect(clippy::cast_precision_loss, reason = "fewer runs than 2^52")]
            let counted = (combination.runs - combination.diverged) as f64;
            combination.mean_discrepancy = combination.mean_discrepancy.map(|sum| sum / counted);
        }
        (self.combinations, self.quantiles)
    }
}

/// Greatest number of runs per combination with quantiles: all discrepancies of a combination are in memory at once, at most 128 MB.
pub const MOST_RUNS_OF_QUANTILES: u64 = 16_000_000;
/// Greatest number of combinations with quantiles: at most 144 MB.
pub const MOST_COMBINATIONS_OF_QUANTILES: u64 = 3_000_000;

/// Quantiles of the largest discrepancy \[m\], over the runs of a combination without divergence.
///
/// The quantile of p % of n runs is the smallest value not exceeded by at least p % of the values: by rank, the ⌈p·n/100⌉-th smallest, counted from 1.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Quantiles {
    /// Quantile of 5 % \[m\].
    pub p5: f64,
    /// Quantile of 25 % \[m\].
    pub p25: f64,
    /// Quantile of 50 % \[m\].
    pub median: f64,
    /// Quantile of 75 % \[m\].
    pub p75: f64,
    /// Quantile of 95 % \[m\].
    pub p95: f64,
}

impl Quantiles {
    /// Returns the quantiles of these values; `None` for an empty slice. The order of the values changes.
    pub(crate) fn of(values: &mut [f64]) -> Option<Self> {
        let count = values.len();
        let mut rest = (0, values);
        // Each selection leaves the larger values to the right, so the next quantile is searched there only. `rest` holds the index of its first value and
        // these values.
        let mut of = |percent: usize| {
            // The rank ⌈p·n/100⌉ as an index from 0. The count is bounded, so the product cannot overflow.
            let place = (percent * count).div_ceil(100).checked_sub(1)?;
            let (from, values) = (rest.0, std::mem::take(&mut rest.1));
            let (_, value, _) = values.select_nth_unstable_by(place - from, f64::total_cmp);
            let value = *value;
            rest = (place, values.get_mut(place - from..)?);
            Some(value)
        };
        Some(Self { p5: of(5)?, p25: of(25)?, median: of(50)?, p75: of(75)?, p95: of(95)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_summed_up_by_combination_without_those_that_diverged() {
        let accepted = Accepted::new(3, 3, std::iter::empty());
        let mut tally = Tally::new(3, 3, &accepted);
        for (diverged, max_discrepancy) in
            [(false, 1.0), (true, f64::INFINITY), (false, 4.0), (true, 5.0), (true, 6.0), (true, f64::NAN), (false, 4.0)]
        {
            tally.add(Gist { diverged, max_discrepancy });
        }
        assert_eq!(tally.runs(), 7);
        let (combinations, quantiles) = tally.finish();
        let median = |place: usize| quantiles[place].map(|quantiles| (quantiles.p5, quantiles.median, quantiles.p95));
        assert_eq!((median(0), median(1), median(2)), (Some((1.0, 1.0, 4.0)), None, Some((4.0, 4.0, 4.0))));
        let [first, second, third] = combinations.as_slice() else { panic!("three of three, three and one") };
        let expected = CombinationReport { runs: 3, diverged: 1, mean_discrepancy: Some(2.5), largest_discrepancy: Some(4.0), worst_run: Some(2) };
        assert_eq!(*first, expected);
        assert_eq!(*second, CombinationReport { runs: 3, diverged: 3, ..CombinationReport::default() });
        assert_eq!((third.worst_run, third.mean_discrepancy), (Some(6), Some(4.0)));
        let report = Report { runs: 7, computed: 7, combinations, quantiles, judgements: Arc::from([]), refused: Refused::new() };
        assert_eq!((report.diverged(), report.worst().and_then(|worst| worst.worst_run)), (4, Some(2)), "of equal ones the first");
    }

    #[test]
    fn combinations_that_are_left_out_have_no_runs() {
        let accepted = Accepted::new(4, 2, [0, 2, 3].into_iter());
        let mut tally = Tally::new(2, 4, &accepted);
        tally.add(Gist { diverged: false, max_discrepancy: 1.0 });
        tally.add(Gist { diverged: false, max_discrepancy: 3.0 });
        let (combinations, quantiles) = tally.finish();
        assert_eq!(
            combinations.iter().map(|combination| (combination.runs, combination.mean_discrepancy)).collect::<Vec<_>>(),
            [(0, None), (2, Some(2.0)), (0, None), (0, None)]
        );
        assert_eq!(quantiles.iter().map(Option::is_some).collect::<Vec<_>>(), [false, true, false, false]);
    }

    /// Compares with the definition: the least value not exceeded by at least p % of the values.
    #[test]
    fn a_quantile_is_the_least_value_that_its_share_does_not_exceed() {
        for count in 1..=203_u32 {
            // For a count without the factor 7, the multiples are a permutation. For a multiple of 7, values repeat: ties are part of the definition.
            let mut values: Vec<f64> = (0..count).map(|n| f64::from(n * 7 % count)).collect();
            let defined = |percent: u32| {
                let enough = |value: &f64| values.iter().filter(|other| *other <= value).count() * 100 >= (percent * count) as usize;
                values.iter().copied().filter(enough).fold(f64::INFINITY, f64::min)
            };
            let expected = Quantiles { p5: defined(5), p25: defined(25), median: defined(50), p75: defined(75), p95: defined(95) };
            assert_eq!(Quantiles::of(&mut values), Some(expected), "{count}");
        }
        assert_eq!(Quantiles::of(&mut []), None);
    }
}
