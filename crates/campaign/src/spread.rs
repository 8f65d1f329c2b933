//! A campaign whose caller spreads the runs over processes. Each process computes the rows of some runs, and no file is written.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::compare::{Comparison, compared};
use crate::error::CampaignError;
use crate::judgement::Judgement;
use crate::plan::{Accepted, CHUNK, CampaignPlan, Parts, Refused};
use crate::report::{Report, Tally};
use crate::table::{Column, Roster, Row, TableError, columns, gists, run_columns};
use crate::vary::Variation;
use crate::verdicts::Judge;
use crate::watch::Watch;
use crate::work::{Chunk, Scenes, Work};

/// The rows of a plan, computed on demand in any process. They equal the rows of the table of [`Campaign::run`](crate::Campaign::run).
#[derive(Clone, Debug)]
pub struct SpreadCampaign {
    plan: CampaignPlan,
    found: Found,
    accepted: Accepted,
    columns: Vec<Column>,
}

/// Result of the check of a plan, passed to the other processes.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Found {
    roster: Roster,
    /// Left out combinations.
    #[serde(default, skip_serializing_if = "Refused::is_empty")]
    refused: Refused,
}

impl SpreadCampaign {
    /// Checks every combination of a plan, on all threads of the current thread pool.
    ///
    /// # Errors
    ///
    /// The error of the first refused combination; [`CampaignError::Stopped`] if the watch stopped the check; [`CampaignError::Size`] for a plan with verdicts.
    pub fn check(plan: CampaignPlan, watch: &dyn Watch) -> Result<Self, CampaignError> {
        let checked = plan.check(watch)?;
        Self::new(plan, Found { roster: checked.roster, refused: checked.refused })
    }

    /// Opens a plan checked by another process, without a second check. `roster`: text of [`SpreadCampaign::roster`] from that process.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Size`] if the text is no roster, and for a plan with verdicts.
    pub fn with_roster(plan: CampaignPlan, roster: &str) -> Result<Self, CampaignError> {
        let found = serde_json::from_str(roster).map_err(|error| CampaignError::Size(format!("no roster of a campaign: {error}")))?;
        Self::new(plan, found)
    }

    fn new(plan: CampaignPlan, found: Found) -> Result<Self, CampaignError> {
        if plan.has_verdicts() {
            return Err(CampaignError::Size("the rows of a campaign that is spread have no verdicts: expected a plan without them".to_owned()));
        }
        let columns = columns(plan.variations(), false, &found.roster);
        // The numbering of the rows follows from the plan and the refused combinations, so every process has the same.
        let accepted = Accepted::new(plan.combinations(), plan.runs_of_each(), found.refused.keys().copied());
        Ok(Self { plan, found, accepted, columns })
    }

    /// Returns the plan.
    #[must_use]
    pub const fn plan(&self) -> &CampaignPlan {
        &self.plan
    }

    /// Returns the peers of all runs and the left out combinations, as a text for [`SpreadCampaign::with_roster`].
    #[must_use]
    pub fn roster(&self) -> String {
        serde_json::to_string(&self.found).unwrap_or_default()
    }

    /// Returns the columns of the table.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Returns the varied keys with their values.
    #[must_use]
    pub fn variations(&self) -> &[Variation] {
        self.plan.variations()
    }

    /// Returns the number of rows of the table. Left out combinations have no rows.
    #[must_use]
    pub const fn runs(&self) -> u64 {
        self.accepted.runs()
    }

    /// Computes the rows of some runs on the current thread. `runs`: places of the runs, counted from 0 without the runs of left out combinations.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Scene`] if a scene is refused here, [`CampaignError::Stopped`] if the watch stopped the work, [`CampaignError::Size`] for places beyond
    /// [`SpreadCampaign::runs`].
    pub fn rows(&self, runs: Range<u64>, watch: &dyn Watch) -> Result<Vec<Row>, CampaignError> {
        if runs.end > self.runs() {
            return Err(CampaignError::Size(format!("run {} of {}: expected one of the campaign", runs.end, self.runs())));
        }
        // `Work` needs parts, though nothing is stored here: one part holds all runs.
        let parts = Parts { runs: self.runs(), size: self.runs() };
        let (plan, roster, accepted) = (&self.plan, &self.found.roster, &self.accepted);
        let work = Work { plan, roster, judgements: &[], accepted, parts, watch, keep: &|_, _| Ok(()) };
        let scenes = Scenes::default();
        let mut rows = Vec::new();
        let mut start = runs.start;
        // Chunks of the same size as in `Campaign::run`, so that runs go side by side in the same way. The results do not depend on it.
        while start < runs.end {
            if !watch.keep_going() {
                return Err(CampaignError::Stopped);
            }
            let end = (start + CHUNK).min(runs.end);
            rows.extend(work.rows(Chunk { part: 0, place: 0, start, end }, &scenes)?);
            start = end;
        }
        Ok(rows)
    }

    /// Judges every combination, on all threads of the current thread pool. The judgements equal the judgements of
    /// [`Campaign::judge_apart`](crate::Campaign::judge_apart), and are indexed by combination.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Scene`] if a scene is refused here, [`CampaignError::Stopped`] if the watch or the judge stopped the work.
    pub fn judge(&self, by: &dyn Judge, watch: &dyn Watch) -> Result<Vec<Judgement>, CampaignError> {
        let judge = |combination: u64| {
            if let Some(reason) = self.found.refused.get(&combination) {
                return Ok(Judgement::Refused(reason.as_str().into()).in_one_line());
            }
            if !watch.keep_going() {
                return Err(CampaignError::Stopped);
            }
            let judgement = by.judge(&self.plan.scene(combination)?).ok_or(CampaignError::Stopped)?;
            watch.judged(1);
            // In one line, as a journal would keep it: the judgements must equal those of a campaign in a folder.
            Ok(judgement.in_one_line())
        };
        // All results are collected in order before the first error is chosen, so the error does not depend on the number of threads.
        (0..self.plan.combinations()).into_par_iter().map(judge).collect::<Vec<_>>().into_iter().collect()
    }

    /// Sums up the rows of all runs, in the order of the runs, as [`Campaign::run`](crate::Campaign::run) sums up the table. `judgements`: one per combination,
    /// or empty.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Size`] if the number of rows differs from the number of runs.
    pub fn report(&self, rows: &[Row], judgements: Vec<Judgement>) -> Result<Report, CampaignError> {
        self.has_all(rows)?;
        let mut tally = Tally::new(self.plan.runs_of_each(), self.plan.combinations(), &self.accepted);
        gists(&self.columns, rows).map_err(|error| not_of_this(&error))?.for_each(|gist| tally.add(gist));
        let (combinations, quantiles) = tally.finish();
        let (runs, refused) = (self.runs(), self.found.refused.clone());
        Ok(Report { runs, computed: runs, combinations, quantiles, judgements: Arc::from(judgements), refused })
    }

    /// Compares the values of the first key, which must be [`Strategies`](crate::Strategies), from the rows of all runs in order, as
    /// [`Campaign::compare`](crate::Campaign::compare) does from the table.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Size`] if the number of rows differs from the number of runs, or if the comparison needs more than
    /// [`MOST_NUMBERS_COMPARED`](crate::MOST_NUMBERS_COMPARED) numbers.
    pub fn compare(&self, rows: &[Row]) -> Result<Comparison, CampaignError> {
        self.has_all(rows)?;
        let measures = compared(&self.columns, self.runs())?;
        let names: Vec<&str> = measures.iter().map(|measure| measure.name.as_str()).collect();
        let columns = run_columns(&self.columns, rows, &names).map_err(|error| not_of_this(&error))?;
        Ok(Comparison::of(&self.plan, &self.accepted, &self.found.refused, measures, &columns))
    }

    fn has_all(&self, rows: &[Row]) -> Result<(), CampaignError> {
        let (found, runs) = (rows.len() as u64, self.runs());
        if found == runs { Ok(()) } else { Err(CampaignError::Size(format!("{found} rows of a campaign of {runs} runs: expected all of them"))) }
    }
}

/// Returns the error about rows without the columns of every campaign.
fn not_of_this(error: &TableError) -> CampaignError {
    CampaignError::Size(format!("no table of a campaign: {error}"))
}
