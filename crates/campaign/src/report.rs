//! What a campaign comes to, and the quantiles of the runs of a combination.

use std::sync::Arc;

use crate::plan::{Accepted, Refused};
use crate::table::Gist;
use crate::verdicts::Judgement;

/// What a campaign comes to, taken from its table.
#[derive(Clone, PartialEq, Debug)]
pub struct Report {
    /// How many runs it has.
    pub runs: u64,
    /// How many of them were done this time; the others were there already.
    pub computed: u64,
    /// The combinations, in order; those that are left out have no runs.
    pub combinations: Vec<CombinationReport>,
    /// The quantiles of each combination, `None` where all of its runs diverged. Empty if they would take too much memory: beyond
    /// [`MOST_RUNS_OF_QUANTILES`] or [`MOST_COMBINATIONS_OF_QUANTILES`].
    pub quantiles: Vec<Option<Quantiles>>,
    /// The judgement of each combination; empty without verdicts.
    pub judgements: Arc<[Judgement]>,
    /// The combinations that are left out, each with its reason.
    pub refused: Refused,
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
pub(crate) struct Tally<'a> {
    accepted: &'a Accepted,
    /// How many combinations there are, those that are left out among them.
    all: u64,
    runs: u64,
    /// How many runs of the combination at hand are still to come.
    left: u64,
    combinations: Vec<CombinationReport>,
    /// Of the runs of the combination at hand that did not diverge; `None` if no quantiles are kept.
    discrepancies: Option<Vec<f64>>,
    quantiles: Vec<Option<Quantiles>>,
}

impl<'a> Tally<'a> {
    pub(crate) fn new(of_each: u64, combinations: u64, accepted: &'a Accepted) -> Self {
        let kept = of_each <= MOST_RUNS_OF_QUANTILES && combinations <= MOST_COMBINATIONS_OF_QUANTILES;
        Self { accepted, all: combinations, runs: 0, left: 0, combinations: Vec::new(), discrepancies: kept.then(Vec::new), quantiles: Vec::new() }
    }

    pub(crate) fn add(&mut self, gist: Gist) {
        // Divisions for every run would take as long as all else.
        if self.left == 0 {
            self.begin(self.accepted.run(self.runs).0 + 1);
            self.left = self.accepted.of_each();
        }
        let place = self.runs;
        self.left -= 1;
        self.runs += 1;
        let Some(combination) = self.combinations.last_mut() else { return };
        combination.runs += 1;
        if gist.diverged {
            combination.diverged += 1;
            return;
        }
        if let Some(discrepancies) = &mut self.discrepancies {
            discrepancies.push(gist.max_discrepancy);
        }
        // The sum for now.
        combination.mean_discrepancy = Some(combination.mean_discrepancy.unwrap_or(0.0) + gist.max_discrepancy);
        if combination.largest_discrepancy.is_none_or(|largest| gist.max_discrepancy > largest) {
            combination.largest_discrepancy = Some(gist.max_discrepancy);
            combination.worst_run = Some(self.accepted.number(place));
        }
    }

    /// How many runs were taken.
    pub(crate) const fn runs(&self) -> u64 {
        self.runs
    }

    /// Ends combinations up to this number of them: those before the last are left out.
    fn begin(&mut self, count: u64) {
        while (self.combinations.len() as u64) < count {
            self.end_combination();
            self.combinations.push(CombinationReport::default());
        }
    }

    /// Puts away what the combination that is over has.
    fn end_combination(&mut self) {
        if let Some(discrepancies) = self.discrepancies.as_mut().filter(|_| !self.combinations.is_empty()) {
            self.quantiles.push(Quantiles::of(discrepancies));
            discrepancies.clear();
        }
    }

    /// What the combinations come to, and their quantiles.
    pub(crate) fn finish(mut self) -> (Vec<CombinationReport>, Vec<Option<Quantiles>>) {
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

/// The most runs of a combination of which quantiles are kept: all of them are held at once, 128 MB at most.
pub const MOST_RUNS_OF_QUANTILES: u64 = 16_000_000;
/// The most combinations of which quantiles are kept: 144 MB at most.
pub const MOST_COMBINATIONS_OF_QUANTILES: u64 = 3_000_000;

/// Quantiles of the largest discrepancy of those runs of a combination that did not diverge \[m\].
///
/// The quantile of p % of n runs is the smallest of their values that at least p % of them do not exceed: by rank, the ⌈p·n/100⌉-th smallest, counted from 1.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Quantiles {
    /// Of 5 %.
    pub p5: f64,
    /// Of 25 %.
    pub p25: f64,
    /// Of 50 %.
    pub median: f64,
    /// Of 75 %.
    pub p75: f64,
    /// Of 95 %.
    pub p95: f64,
}

impl Quantiles {
    /// Of these values, whose order changes; `None` of none.
    pub(crate) fn of(values: &mut [f64]) -> Option<Self> {
        let count = values.len();
        let mut rest = (0, values);
        // Each lies behind the one before: putting all in order would take four times as long.
        let mut of = |percent: usize| {
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

    /// The definition itself: the least value that at least p % do not exceed.
    #[test]
    fn a_quantile_is_the_least_value_that_its_share_does_not_exceed() {
        for count in 1..=203_u32 {
            // 7 is prime to every count but its multiples, which repeat values: ties are part of the definition.
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
