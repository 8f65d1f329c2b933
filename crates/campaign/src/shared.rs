//! A campaign in a folder that several workers share, each of which does a shard of it.

use std::collections::BTreeSet;
use std::path::Path;

use crate::campaign::{Campaign, Watch};
use crate::error::CampaignError;
use crate::folder::Folder;
use crate::plan::CampaignPlan;
use crate::shard::Shard;
use crate::table::Row;
use crate::verdicts::{Judge, Judgement};

/// A campaign in its folder, in which other workers may work at the same time, on this machine and on others.
///
/// No two workers write the same file, and a file gets its name when it is whole. All workers make the same part of the same number, so it does no harm if two workers make
/// it: locks between them only save work, and are their callers' to take ([`Shard::lease`]).
#[derive(Debug)]
pub struct SharedCampaign {
    campaign: Campaign,
    worker: String,
    /// One for each combination; of those that are not this worker's to judge, nothing that is ever looked at.
    judgements: Vec<Judgement>,
    /// The parts whose combinations are judged: those that were missing when the worker judged.
    judged: BTreeSet<u64>,
}

/// What became of a shard.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ShardReport {
    /// How many parts the shard has.
    pub parts: u64,
    /// How many runs these have.
    pub runs: u64,
    /// How many of the runs were done this time.
    pub computed: u64,
    /// How many are not done, because the watch ended it.
    pub left: u64,
}

/// A part of a campaign.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PartState {
    /// How many runs it has.
    pub runs: u64,
    /// Whether they are done.
    pub is_done: bool,
}

impl SharedCampaign {
    /// Begins a campaign in a folder, or goes on with the one there if that has an equal plan. `worker` is a name that no other worker has; it becomes part of names of
    /// files.
    ///
    /// # Errors
    ///
    /// Those of [`Campaign::open`], but for other workers.
    pub fn open(plan: CampaignPlan, folder: &Path, worker: &str, watch: &dyn Watch) -> Result<Self, CampaignError> {
        let campaign = Campaign::open_in(plan, folder, Some(worker), watch)?;
        Ok(Self { campaign, worker: worker.to_owned(), judgements: Vec::new(), judged: BTreeSet::new() })
    }

    /// The parts of the campaign in a folder. Nothing is written.
    ///
    /// # Errors
    ///
    /// [`CampaignError::NoCampaign`] if the folder has none; [`CampaignError::Other`] if it has another one.
    pub fn parts_in(plan: CampaignPlan, folder: &Path) -> Result<Vec<PartState>, CampaignError> {
        if !Folder::has_campaign(folder)? {
            return Err(CampaignError::NoCampaign { path: folder.to_path_buf() });
        }
        let folder = Folder::share(folder)?;
        let manifest = Campaign::same_manifest(&plan, &folder)?;
        let campaign = Campaign::of(plan, manifest, folder);
        let is_finished = campaign.is_finished();
        let missing = if is_finished { Vec::new() } else { campaign.absent()? };
        let state = |part| PartState { runs: campaign.parts.len(part), is_done: missing.binary_search(&part).is_err() };
        Ok((0..campaign.parts.count()).map(state).collect())
    }

    /// Judges those combinations of the shard that have no verdict yet, if the plan asks for verdicts. Gives how many have none: above 0 if the watch or the
    /// judge ended it.
    ///
    /// # Errors
    ///
    /// Those of [`Campaign::judge`].
    pub fn judge(&mut self, shard: Shard, by: &dyn Judge, watch: &dyn Watch) -> Result<u64, CampaignError> {
        if !self.campaign.plan.has_verdicts() || self.campaign.is_finished() {
            return Ok(0);
        }
        let mut is_wanted = vec![false; usize::try_from(self.campaign.plan.combinations()).unwrap_or_default()];
        let parts = self.campaign.missing(&|part| shard.has(part), watch)?;
        for part in &parts {
            let runs = self.campaign.parts.range(*part);
            let [first, last] = [runs.start, runs.end - 1].map(|run| usize::try_from(self.campaign.accepted.run(run).0).unwrap_or_default());
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

    /// Judges a share of the combinations for [`Campaign::judge_apart`]. Gives how many of them have no verdict: above 0 if the watch or the judge ended it.
    ///
    /// # Errors
    ///
    /// Those of [`Campaign::judge`].
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
        self.campaign.folder.is_shared()?;
        self.campaign.judge_some(path, Some(&self.worker), is_wanted, by, watch)
    }

    /// Does those runs of the shard that are missing, on all threads of the pool that it is called in.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Busy`] if a process works on the folder alone; [`CampaignError::File`] if a file cannot be written, as in [`Campaign::run`];
    /// [`CampaignError::NotJudged`] if verdicts are asked for and not known.
    pub fn run(&self, shard: Shard, watch: &dyn Watch) -> Result<ShardReport, CampaignError> {
        let campaign = &self.campaign;
        let parts = || (0..campaign.parts.count()).filter(|part| shard.has(*part));
        let runs = |parts: &mut dyn Iterator<Item = u64>| parts.map(|part| campaign.parts.len(part)).sum::<u64>();
        let all = ShardReport { parts: parts().count() as u64, runs: runs(&mut parts()), computed: 0, left: 0 };
        campaign.folder.is_shared()?;
        let mut missing = campaign.missing(&|part| shard.has(part), watch)?;
        // Asked after the parts: they go when the table is there.
        if campaign.is_finished() {
            return Ok(all);
        }
        if campaign.plan.has_verdicts() && self.judgements.is_empty() {
            return Err(CampaignError::NotJudged);
        }
        if campaign.plan.has_verdicts() {
            // A part that was damaged since then has combinations without judgements. The next command for the shard finds it.
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

    /// The campaign.
    #[must_use]
    pub const fn campaign(&self) -> &Campaign {
        &self.campaign
    }
}
