//! A campaign whose runs its caller spreads over processes: each asks for the rows of some runs, and nothing is written.

use std::ops::Range;

use crate::campaign::Watch;
use crate::error::CampaignError;
use crate::plan::{Accepted, CHUNK, CampaignPlan, Parts};
use crate::table::{Column, Roster, Row, columns};
use crate::vary::Variation;
use crate::work::{Chunk, Scenes, Work};

/// The table of a plan, any rows of which can be had in any process: they are those of [`Campaign::run`](crate::Campaign::run).
#[derive(Clone, Debug)]
pub struct SpreadCampaign {
    plan: CampaignPlan,
    roster: Roster,
    columns: Vec<Column>,
}

impl SpreadCampaign {
    /// Checks every combination of a plan, on all threads of the pool that it is called in.
    ///
    /// # Errors
    ///
    /// Of the first combination that is refused; [`CampaignError::Stopped`] if the watch ended it; [`CampaignError::Size`] of a plan that has verdicts or leaves
    /// combinations out.
    pub fn check(plan: CampaignPlan, watch: &dyn Watch) -> Result<Self, CampaignError> {
        let roster = plan.check(watch)?.roster;
        Self::new(plan, roster)
    }

    /// The same in another process, which does not check the plan again. `roster`: [`SpreadCampaign::roster`] of the one that was checked.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Size`] if the roster is none.
    pub fn with_roster(plan: CampaignPlan, roster: &str) -> Result<Self, CampaignError> {
        let roster = serde_json::from_str(roster).map_err(|error| CampaignError::Size(format!("no roster of a campaign: {error}")))?;
        Self::new(plan, roster)
    }

    fn new(plan: CampaignPlan, roster: Roster) -> Result<Self, CampaignError> {
        if plan.has_verdicts() || plan.may_leave_out() {
            return Err(CampaignError::Size("a campaign that is spread has no verdicts and leaves nothing out".to_owned()));
        }
        let columns = columns(plan.variations(), false, &roster);
        Ok(Self { plan, roster, columns })
    }

    /// The peers of all runs, as a text for [`SpreadCampaign::with_roster`].
    #[must_use]
    pub fn roster(&self) -> String {
        serde_json::to_string(&self.roster).unwrap_or_default()
    }

    /// The columns of the table.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The keys that are varied, with their values.
    #[must_use]
    pub fn variations(&self) -> &[Variation] {
        self.plan.variations()
    }

    /// How many rows the table has.
    #[must_use]
    pub const fn runs(&self) -> u64 {
        self.plan.runs()
    }

    /// The rows of some runs, counted from 0, on one thread.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Scene`] if a scene is refused here, [`CampaignError::Stopped`] if the watch ended it, [`CampaignError::Size`] for runs that there are not.
    pub fn rows(&self, runs: Range<u64>, watch: &dyn Watch) -> Result<Vec<Row>, CampaignError> {
        if runs.end > self.runs() {
            return Err(CampaignError::Size(format!("run {} of {}: expected one of the campaign", runs.end, self.runs())));
        }
        let accepted = Accepted::new(self.plan.combinations(), self.plan.runs_of_each(), std::iter::empty());
        let parts = Parts { runs: self.runs(), size: self.runs() };
        let work = Work { plan: &self.plan, roster: &self.roster, judgements: &[], accepted: &accepted, parts, watch, keep: &|_, _| Ok(()) };
        let scenes = Scenes::default();
        let mut rows = Vec::new();
        let mut start = runs.start;
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
}
