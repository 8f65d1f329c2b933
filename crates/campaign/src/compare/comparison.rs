//! The figures of a comparison, from runs paired by seed.
//!
//! A strategy is compared with the baseline, the first strategy, at equal values of all other keys. Runs of one seed have equal random numbers, so the
//! difference of two runs is due to the strategies, and the interval of the differences is narrower than the intervals of the two means. A pair counts if both
//! runs came to their end and both have the measure.
//!
//! A run which [diverged](cohaptic_harness::Summary::has_diverged) counts in no mean: a mean with a value of 10³⁰ m would be useless.

use super::interval::{Estimate, Share};
use super::measured::{MeasuredColumn, measured};
use cohaptic_scene::Measure;

use crate::error::CampaignError;
use crate::plan::{Accepted, CampaignPlan, Refused};
use crate::table::{Column, RunColumns};

/// Greatest number of numbers in a comparison, runs times measures: 800 MB of memory.
pub const MOST_NUMBERS_COMPARED: u64 = 100_000_000;

/// A comparison of strategies.
#[derive(Clone, PartialEq, Debug)]
pub struct Comparison {
    /// The strategies as written by the user; the first is the baseline.
    pub strategies: Vec<String>,
    /// Measures with a value in at least one run, in the order of the table.
    pub measures: Vec<MeasuredColumn>,
    /// Cells, indexed by combination: the combinations of the baseline come first.
    pub cells: Vec<Cell>,
}

/// The figures of the runs of one combination.
#[derive(Clone, PartialEq, Debug)]
pub struct Cell {
    /// Why the strategy refuses the scene with these values; `None` if the strategy runs.
    pub refused: Option<String>,
    /// Share of diverged runs; `None` if the combination has no runs.
    pub diverged: Option<Share>,
    /// Share of runs whose task was done; `None` if the combination has no runs or the scene no task.
    pub done: Option<Share>,
    /// Figures, indexed like [`Comparison::measures`].
    pub figures: Vec<Figures>,
}

/// Mean of a measure over the runs of one combination, and mean difference to the baseline.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Figures {
    /// Mean over the runs which came to their end and have the measure; `None` if there are no such runs.
    pub mean: Option<Estimate>,
    /// Mean difference to the baseline, over the seeds with a counted run in both strategies; `None` if there are no such seeds, and for the baseline itself.
    pub difference: Option<Estimate>,
}

/// Returns the compared columns, in the order of the table. `runs`: number of rows of the table.
///
/// # Errors
///
/// [`CampaignError::Size`] if the columns have more than [`MOST_NUMBERS_COMPARED`] numbers.
pub(crate) fn compared(columns: &[Column], runs: u64) -> Result<Vec<MeasuredColumn>, CampaignError> {
    let measures = measured(columns);
    let numbers = runs.saturating_mul(measures.len() as u64);
    if numbers > MOST_NUMBERS_COMPARED {
        return Err(CampaignError::Size(format!("{numbers} numbers to compare: expected at most {MOST_NUMBERS_COMPARED}, runs times measures")));
    }
    Ok(measures)
}

impl Comparison {
    /// Compares the values of the first key of a plan. `columns` holds the values of `measures`, in the same order, indexed by run.
    pub(crate) fn of(plan: &CampaignPlan, accepted: &Accepted, refused: &Refused, measures: Vec<MeasuredColumn>, columns: &RunColumns) -> Self {
        // `complete` and every column have one entry per run: `Campaign::compare` and `SpreadCampaign::compare` check the numbers of rows.
        let is_whole = |run: usize| columns.complete[run];
        let strategies: Vec<String> = plan.variations().first().map_or_else(Vec::new, |vary| vary.texts().map(str::to_owned).collect());
        let each = usize::try_from(plan.runs_of_each()).unwrap_or(usize::MAX);
        let starts = starts(plan.combinations(), accepted, each);
        // The first key varies slowest, so each strategy has one block of `others` combinations, and `combination % others` is the baseline at the same other
        // values.
        let others = starts.len() / strategies.len().max(1);
        // A measure without any value is left out, such as a measure of a peer absent from every run.
        let has = |column: &Vec<f64>| column.iter().enumerate().any(|(run, value)| value.is_finite() && is_whole(run));
        let known: Vec<bool> = columns.columns.iter().map(has).collect();
        let times = measures.iter().position(|measure| measure.name == Measure::TaskTime.name()).map(|place| &columns.columns[place]);
        let cell = |(combination, start): (usize, &Option<usize>)| {
            let baseline = starts[combination % others].filter(|_| combination >= others);
            let figures = columns.columns.iter().zip(&known).filter(|(_, known)| **known).map(|(column, _)| {
                let values = |start: &usize| (*start..start + each).map(|run| Some(column[run]).filter(|value| is_whole(run) && value.is_finite()));
                Figures::of(start.iter().flat_map(values), baseline.iter().flat_map(values))
            });
            let diverged = start.and_then(|start| {
                let diverged = (start..start + each).filter(|run| !is_whole(*run)).count();
                Share::of(diverged as u64, each as u64)
            });
            // Only a done task has a time, also in a run that diverged later.
            let done = start.zip(times.as_ref()).and_then(|(start, times)| {
                let done = times[start..start + each].iter().filter(|time| time.is_finite()).count();
                Share::of(done as u64, each as u64)
            });
            Cell { refused: refused.get(&(combination as u64)).cloned(), diverged, done, figures: figures.collect() }
        };
        let cells = starts.iter().enumerate().map(cell).collect();
        let measures = measures.into_iter().zip(known).filter_map(|(measure, known)| known.then_some(measure)).collect();
        Self { strategies, measures, cells }
    }

    /// Returns the number of combinations of the other keys; 1 if only the strategy is varied.
    #[must_use]
    pub const fn others(&self) -> usize {
        self.cells.len() / self.strategies.len()
    }

    /// Returns whether the scene has a task.
    #[must_use]
    pub fn has_task(&self) -> bool {
        self.cells.iter().any(|cell| cell.done.is_some())
    }

    /// Returns the cell of a strategy at a combination of the other keys, both counted from 0.
    ///
    /// # Panics
    ///
    /// If the strategy or the combination does not exist.
    #[must_use]
    pub fn cell(&self, strategy: usize, other: usize) -> &Cell {
        &self.cells[strategy * self.others() + other]
    }
}

/// Returns the row of the table with the first run of each combination, indexed by combination; `None` for left out combinations.
fn starts(combinations: u64, accepted: &Accepted, each: usize) -> Vec<Option<usize>> {
    let mut starts = vec![None; usize::try_from(combinations).unwrap_or_default()];
    let runs = usize::try_from(accepted.runs()).unwrap_or_default();
    // Accepted combinations have `each` consecutive rows, so every step begins another combination.
    for place in (0..runs).step_by(each) {
        let (combination, _) = accepted.run(place as u64);
        starts[usize::try_from(combination).unwrap_or_default()] = Some(place);
    }
    starts
}

impl Figures {
    /// Returns the figures of one combination from the values per seed. `baseline` holds the values of the baseline, and is empty if the baseline is refused or
    /// is this combination.
    fn of(values: impl Iterator<Item = Option<f64>> + Clone, baseline: impl Iterator<Item = Option<f64>>) -> Self {
        let own: Vec<f64> = values.clone().flatten().collect();
        // `zip` pairs equal seeds, because both iterators start at the first seed.
        let differences: Vec<f64> = values.zip(baseline).filter_map(|(value, baseline)| Some(value? - baseline?)).collect();
        Self { mean: Estimate::of(&own), difference: Estimate::of(&differences) }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{Format, PlanSpec, Variation};

    const NONE: f64 = f64::NAN;

    fn plan(runs: u64) -> CampaignPlan {
        let variations = ["coordination.strategy=average-position,extrapolated,local-damping", "link.loss=0,0.5"];
        let variations = variations.iter().map(|text| Variation::parse(text).unwrap()).collect();
        CampaignPlan::new(PlanSpec { text: "", file: Path::new(""), set: &[], variations, runs, format: Format::Csv, part: None, program: "" })
            .unwrap()
    }

    fn measure(name: &str) -> MeasuredColumn {
        MeasuredColumn { name: name.to_owned(), unit: String::new(), about: String::new() }
    }

    fn compared(refused: &Refused, complete: Vec<bool>, columns: Vec<Vec<f64>>) -> Comparison {
        let (plan, measures) = (plan(3), (0..columns.len()).map(|place| measure(&place.to_string())).collect());
        let accepted = Accepted::new(plan.combinations(), plan.runs_of_each(), refused.keys().copied());
        Comparison::of(&plan, &accepted, refused, measures, &RunColumns { complete, columns })
    }

    #[test]
    fn pairs_are_of_one_seed_and_of_equal_values_of_the_other_keys() {
        // The baseline at both losses, then the two other strategies, three runs each. One run diverged in the first cell and one in the third.
        let values: Vec<f64> = vec![1.0, 2.0, 3.0, 10.0, 20.0, 30.0, 2.0, 9.0, 5.0, 11.0, 20.0, 33.0, 0.0, 0.0, 0.0, 7.0, 7.0, 7.0];
        let mut complete = vec![true; 18];
        (complete[0], complete[7]) = (false, false);
        let comparison = compared(&Refused::new(), complete, vec![values]);
        assert_eq!((comparison.others(), comparison.strategies.join(" ")), (2, "average-position extrapolated local-damping".to_owned()));
        let figures = |strategy, other| comparison.cell(strategy, other).figures[0];
        let mean = |estimate: Option<Estimate>| estimate.map(|estimate| (estimate.count, estimate.mean));
        assert_eq!((mean(figures(0, 0).mean), figures(0, 0).difference), (Some((2, 2.5)), None));
        // The seed of the diverged run and the seed of the diverged run of the baseline do not count: 5 − 3 remains.
        assert_eq!((mean(figures(1, 0).mean), mean(figures(1, 0).difference)), (Some((2, 3.5)), Some((1, 2.0))));
        // The differences 1, 0 and 3 have the deviation √(7/3). The interval of the differences is far narrower than the intervals of the means.
        let paired = figures(1, 1).difference.unwrap();
        let half = 4.302_652_729_911_275 * (7.0_f64 / 3.0 / 3.0).sqrt();
        assert_eq!((paired.count, paired.mean), (3, 4.0 / 3.0));
        assert!((paired.half_width.unwrap() - half).abs() < 1e-8 && figures(1, 1).mean.unwrap().half_width.unwrap() > 20.0);
        let share = comparison.cell(1, 0).diverged.unwrap();
        assert_eq!((share.count, share.of, comparison.cell(2, 1).diverged.unwrap().count), (1, 3, 0));
    }

    #[test]
    fn what_is_refused_has_no_figures_and_a_baseline_that_is_refused_no_differences() {
        let refused: Refused = [(1, "chance".to_owned()), (4, "chance".to_owned())].into();
        let comparison = compared(&refused, vec![true; 12], vec![(0..12).map(f64::from).collect()]);
        assert_eq!(comparison.cell(2, 0), &Cell { refused: Some("chance".into()), diverged: None, done: None, figures: vec![Figures::default()] });
        let at = |strategy, other| comparison.cell(strategy, other).figures[0];
        assert_eq!(at(1, 0).difference.map(|difference| (difference.mean, difference.half_width)), Some((3.0, Some(0.0))));
        assert_eq!((at(1, 1).mean.map(|mean| mean.mean), at(1, 1).difference), (Some(7.0), None));
        assert_eq!((at(2, 1).mean.map(|mean| mean.mean), at(2, 1).difference), (Some(10.0), None));
    }

    /// A run whose task was done and which diverged later counts as done, but its time counts in no mean.
    #[test]
    fn the_share_of_done_tasks_is_that_of_runs_with_a_time() {
        let mut times = vec![NONE; 18];
        (times[0], times[1], times[6]) = (1.0, 2.0, 4.0);
        let mut complete = vec![true; 18];
        complete[1] = false;
        let (plan, measures) = (plan(3), vec![measure("task_time_s")]);
        let accepted = Accepted::new(plan.combinations(), plan.runs_of_each(), [].into_iter());
        let comparison = Comparison::of(&plan, &accepted, &Refused::new(), measures, &RunColumns { complete, columns: vec![times] });
        let done = |strategy, other| comparison.cell(strategy, other).done.map(|share| (share.count, share.of));
        assert_eq!((done(0, 0), done(1, 0), done(2, 1)), (Some((2, 3)), Some((1, 3)), Some((0, 3))));
        assert_eq!(comparison.cell(0, 0).figures[0].mean.map(|mean| (mean.count, mean.mean)), Some((1, 1.0)));
    }

    #[test]
    fn a_measure_that_some_runs_lack_counts_where_it_is_and_one_that_all_lack_is_left_out() {
        let mut some = vec![NONE; 18];
        (some[0], some[1], some[6], some[8]) = (1.0, 2.0, 4.0, 9.0);
        let comparison = compared(&Refused::new(), vec![true; 18], vec![vec![NONE; 18], some]);
        assert_eq!(comparison.measures, [measure("1")]);
        let figures = comparison.cell(1, 0).figures[0];
        assert_eq!(
            (figures.mean.map(|mean| (mean.count, mean.mean)), figures.difference.map(|difference| (difference.count, difference.mean))),
            (Some((2, 6.5)), Some((1, 3.0)))
        );
        assert_eq!(comparison.cell(2, 1).figures[0], Figures::default());
    }
}
