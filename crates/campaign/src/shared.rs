//! A campaign in a folder shared by several workers. Each worker does a shard.

use std::collections::BTreeSet;
use std::path::Path;

use crate::campaign::Campaign;
use crate::error::CampaignError;
use crate::folder::Folder;
use crate::judgement::Judgement;
use crate::plan::CampaignPlan;
use crate::shard::Shard;
use crate::table::Row;
use crate::verdicts::Judge;
use crate::watch::Watch;

/// A campaign in a folder in which other workers may work at the same time, on this machine and on others.
///
/// No two workers write the same file, and a file gets its final name only when whole. All workers make the same bytes for a part, so a part made twice does no
/// harm. A lock per shard only saves work, and is taken by the caller ([`Shard::lease`]).
#[derive(Debug)]
pub struct SharedCampaign {
    campaign: Campaign,
    worker: String,
    /// Judgements, indexed by combination. Entries of combinations outside of `judged` are placeholders, never read.
    judgements: Vec<Judgement>,
    /// Parts with judged combinations: the parts missing at the time of the judging.
    judged: BTreeSet<u64>,
}

/// Result of the work on a shard.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ShardReport {
    /// Number of parts of the shard.
    pub parts: u64,
    /// Number of runs of these parts.
    pub runs: u64,
    /// Number of runs done by this call.
    pub computed: u64,
    /// Number of runs not done, because the watch stopped the work.
    pub left: u64,
}

/// State of a part of a campaign.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PartState {
    /// Number of runs of the part.
    pub runs: u64,
    /// `true` if the runs are done.
    pub is_done: bool,
}

/// State of the campaign in a folder.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FolderState {
    /// States of the parts, indexed by part.
    pub parts: Vec<PartState>,
    /// `true` if the parts are merged: the folder has the table.
    pub is_merged: bool,
}

impl SharedCampaign {
    /// Begins a campaign in a folder, or continues the campaign found in the folder if the plans are equal. `worker`: a name different from the names of all
    /// other workers, used in names of files.
    ///
    /// # Errors
    ///
    /// The errors of [`Campaign::open`], except for the errors about other workers.
    pub fn open(plan: CampaignPlan, folder: &Path, worker: &str, watch: &dyn Watch) -> Result<Self, CampaignError> {
        let campaign = Campaign::open_in(plan, folder, Some(worker), watch)?;
        Ok(Self { campaign, worker: worker.to_owned(), judgements: Vec::new(), judged: BTreeSet::new() })
    }

    /// Returns the state of the campaign in a folder. Nothing is written.
    ///
    /// # Errors
    ///
    /// [`CampaignError::NoCampaign`] if the folder has no campaign; [`CampaignError::Other`] if the folder has another campaign.
    pub fn state_in(plan: CampaignPlan, folder: &Path) -> Result<FolderState, CampaignError> {
        if !Folder::has_campaign(folder)? {
            return Err(CampaignError::NoCampaign { path: folder.to_path_buf() });
        }
        let folder = Folder::share(folder)?;
        let manifest = Campaign::same_manifest(&plan, &folder)?;
        let campaign = Campaign::of(plan, manifest, folder);
        let is_merged = campaign.is_finished();
        // A merge removes the files of the parts, whose runs are then in the table.
        let missing = if is_merged { Vec::new() } else { campaign.absent()? };
        let state = |part| PartState { runs: campaign.parts.len(part), is_done: missing.binary_search(&part).is_err() };
        Ok(FolderState { parts: (0..campaign.parts.count()).map(state).collect(), is_merged })
    }

    /// Judges the combinations of the shard without a judgement, if the plan has verdicts. Returns the number of combinations still without a judgement: above
    /// 0 if the watch or the judge stopped the work.
    ///
    /// # Errors
    ///
    /// The errors of [`Campaign::judge`].
    pub fn judge(&mut self, shard: Shard, by: &dyn Judge, watch: &dyn Watch) -> Result<u64, CampaignError> {
        if !self.campaign.plan.has_verdicts() || self.campaign.is_finished() {
            return Ok(0);
        }
        let mut is_wanted = vec![false; usize::try_from(self.campaign.plan.combinations()).unwrap_or_default()];
        // Only missing parts need judgements: the rows of stored parts have theirs already.
        let parts = self.campaign.missing(&|part| shard.has(part), watch)?;
        for part in &parts {
            let runs = self.campaign.parts.range(*part);
            // A part has at least one run, so `runs.end - 1` is a run of the part.
            let [first, last] = [runs.start, runs.end - 1].map(|run| usize::try_from(self.campaign.accepted.run(run).0).unwrap_or_default());
            // A part has consecutive runs, so its combinations lie between the combinations of its first and last run. Refused combinations in between have a
            // judgement already.
            is_wanted[first..=last].fill(true);
        }
        let is_wanted = |combination: u64| usize::try_from(combination).is_ok_and(|place| is_wanted[place]);
        let path = self.campaign.folder.verdicts();
        let judgements = self.judge_wanted(&path, &is_wanted, by, watch)?;
        let unjudged = (0..).zip(&judgements).filter(|(combination, judgement)| is_wanted(*combination) && judgement.is_none()).count();
        self.judged = parts.into_iter().collect();
        let nobodys = || Judgement::Refused("judged by another worker".into());
        self.judgements = judgements.into_iter().map(|judgement| judgement.unwrap_or_else(nobodys)).collect();
        Ok(unjudged as u64)
    }

    /// Judges a share of the combinations for [`Campaign::judge_apart`]. Returns the number of combinations of the share still without a judgement: above 0 if
    /// the watch or the judge stopped the work.
    ///
    /// # Errors
    ///
    /// The errors of [`Campaign::judge`].
    pub fn judge_apart(&self, shard: Shard, by: &dyn Judge, watch: &dyn Watch) -> Result<u64, CampaignError> {
        let judgements = self.judge_wanted(&self.campaign.folder.stability(), &|combination| shard.has(combination), by, watch)?;
        Ok((0..).zip(&judgements).filter(|(combination, judgement)| shard.has(*combination) && judgement.is_none()).count() as u64)
    }

    fn judge_wanted(
        &self,
        path: &Path,
        is_wanted: &dyn Fn(u64) -> bool,
        by: &dyn Judge,
        watch: &dyn Watch,
    ) -> Result<Vec<Option<Judgement>>, CampaignError> {
        // A process alone in the folder would not expect a second journal.
        self.campaign.folder.is_shared()?;
        self.campaign.judge_some(path, Some(&self.worker), is_wanted, by, watch)
    }

    /// Does the missing runs of the shard, on all threads of the current thread pool.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Busy`] if another process works on the folder alone; [`CampaignError::File`] if a file cannot be written, as in [`Campaign::run`];
    /// [`CampaignError::NotJudged`] if the plan has verdicts and [`SharedCampaign::judge`] was not called.
    pub fn run(&self, shard: Shard, watch: &dyn Watch) -> Result<ShardReport, CampaignError> {
        let campaign = &self.campaign;
        let parts = || (0..campaign.parts.count()).filter(|part| shard.has(*part));
        let runs = |parts: &mut dyn Iterator<Item = u64>| parts.map(|part| campaign.parts.len(part)).sum::<u64>();
        let all = ShardReport { parts: parts().count() as u64, runs: runs(&mut parts()), computed: 0, left: 0 };
        campaign.folder.is_shared()?;
        // Parts stored by earlier workers of the same shard are not computed again.
        let mut missing = campaign.missing(&|part| shard.has(part), watch)?;
        // Asked after the parts: the merge writes the table first and removes the parts afterwards, so missing parts of a finished campaign are no work.
        if campaign.is_finished() {
            return Ok(all);
        }
        if campaign.plan.has_verdicts() && self.judgements.is_empty() {
            return Err(CampaignError::NotJudged);
        }
        if campaign.plan.has_verdicts() {
            // A part damaged since the judging has no judgements here. The next command for the shard computes it.
            missing.retain(|part| self.judged.contains(part));
        }
        let keep = |part: u64, rows: &[Row]| {
            campaign.keep(Some(&self.worker), part, rows)?;
            watch.kept(part, rows.len() as u64);
            Ok(())
        };
        let computed = campaign.compute(&missing, &self.judgements, &keep, watch)?;
        Ok(ShardReport { computed, left: campaign.runs_of(&missing) - computed, ..all })
    }

    /// Returns the campaign.
    #[must_use]
    pub const fn campaign(&self) -> &Campaign {
        &self.campaign
    }
}
