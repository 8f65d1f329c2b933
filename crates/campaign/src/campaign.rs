//! A campaign in its folder, and its watcher.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::compare::{Comparison, compared};
use crate::error::CampaignError;
use crate::folder::{Folder, Manifest, hash};
use crate::plan::{Accepted, CampaignPlan, Parts, Refused};
use crate::report::{Report, Tally};
use crate::shard::Missing;
use crate::table::{Column, Head, TableError, columns};
use crate::verdicts::{Journal, Judge, Judgement, Lines, judge, read_whole, write_all};
use crate::work::{Keep, Work};

/// How often parts are put together at most: each time but the last, a part that turns out to be damaged is computed again.
const MOST_MERGES: u32 = 3;

/// What helps where the table is not as it was written.
const TABLE_WAY_OUT: &str = "remove the folder, or choose another one";

/// A campaign in its folder, which no other process works on as long as this value lives.
#[derive(Debug)]
pub struct Campaign {
    pub(crate) plan: CampaignPlan,
    pub(crate) manifest: Manifest,
    pub(crate) accepted: Accepted,
    pub(crate) parts: Parts,
    columns: Vec<Column>,
    /// The hash of the manifest, which the digest of each part names.
    pub(crate) hash: String,
    pub(crate) folder: Folder,
    /// One for each combination; none while they are not known, or not asked for.
    judgements: Arc<[Judgement]>,
}

/// How [`Campaign::run`] ended.
#[derive(Clone, PartialEq, Debug)]
pub enum Outcome {
    /// All runs are done, and the table is there.
    Finished(Report),
    /// The watch ended it. The same plan in the same folder goes on.
    Interrupted {
        /// How many runs are kept, those of earlier times among them.
        kept: u64,
    },
}

impl Campaign {
    /// Begins a campaign in a folder, or goes on with the one there if it is the same. A new one is checked first, every combination, on all threads of the
    /// pool that it is called in; nothing is written before.
    ///
    /// # Errors
    ///
    /// [`CampaignError`] if a combination is refused, if the folder is no folder, has other files or another campaign in it, if another process works on it,
    /// or if it cannot be read or written.
    pub fn open(plan: CampaignPlan, folder: &Path, watch: &dyn Watch) -> Result<Self, CampaignError> {
        let campaign = Self::open_in(plan, folder, None, watch)?;
        campaign.folder.has_no_shards()?;
        campaign.folder.sweep()?;
        Ok(campaign)
    }

    /// The plan of the campaign in a folder, for a program of that name and version: what it is in the folder, the scene's text as it was when the campaign began.
    ///
    /// # Errors
    ///
    /// [`CampaignError::NoCampaign`] if the folder has none; [`CampaignError`] if the folder cannot be read or what says which campaign it is makes no sense;
    /// [`CampaignError::Other`] for a comparison, which leaves combinations out and whose command knows why.
    pub fn plan_in(folder: &Path, program: &str) -> Result<CampaignPlan, CampaignError> {
        if !Folder::has_campaign(folder)? {
            return Err(CampaignError::NoCampaign { path: folder.to_path_buf() });
        }
        let manifest = Manifest::read(&folder.join(crate::folder::MANIFEST))?;
        let plan = manifest.plan(folder, program)?;
        let differences = manifest.differences(&plan);
        if differences.is_empty() { Ok(plan) } else { Err(CampaignError::Other { path: folder.to_path_buf(), differences }) }
    }

    /// [`Campaign::open`] of one whose runs are all done, by shards or otherwise, to put the table together.
    ///
    /// # Errors
    ///
    /// Those of [`Campaign::open`]; [`CampaignError::NoCampaign`] if the folder has none, [`CampaignError::Missing`] if parts of it are not done.
    pub fn open_whole(plan: CampaignPlan, folder: &Path) -> Result<Self, CampaignError> {
        if !Folder::has_campaign(folder)? {
            return Err(CampaignError::NoCampaign { path: folder.to_path_buf() });
        }
        let campaign = Self::open_in(plan, folder, None, &NoWatch)?;
        if !campaign.is_finished() {
            // By their names alone: parts that are damaged are computed again by `run`.
            let missing = campaign.absent()?;
            if !missing.is_empty() {
                let missing = Missing { piece: "part", count: campaign.parts.count(), pieces: missing };
                return Err(CampaignError::Missing { path: folder.to_path_buf(), missing });
            }
        }
        // A worker may still do what another one has done too, and is let to.
        if campaign.folder.has_no_shards().is_ok() {
            campaign.folder.sweep()?;
        }
        Ok(campaign)
    }

    /// Opens the campaign for this process alone, or for one of several workers.
    pub(crate) fn open_in(plan: CampaignPlan, folder: &Path, worker: Option<&str>, watch: &dyn Watch) -> Result<Self, CampaignError> {
        let begun = Folder::has_campaign(folder)?;
        let new = if begun { None } else { Some(Self::new_manifest(&plan, watch)?) };
        let folder = if worker.is_none() { Folder::take(folder)? } else { Folder::share(folder)? };
        let manifest = match new {
            // Unless somebody else began one meanwhile.
            Some(manifest) if !folder.manifest().exists() => {
                let manifest = manifest.of_file(plan.file(), folder.path());
                if let Err(error) = manifest.write(&folder.manifest(), worker) {
                    folder.give_up();
                    return Err(error);
                }
                manifest
            }
            Some(_) | None => Self::same_manifest(&plan, &folder)?,
        };
        Ok(Self::of(plan, manifest, folder))
    }

    /// The campaign that a manifest in a folder says.
    pub(crate) fn of(plan: CampaignPlan, manifest: Manifest, folder: Folder) -> Self {
        let accepted = manifest.accepted(&plan);
        let parts = manifest.parts(accepted.runs());
        let columns = columns(plan.variations(), plan.has_verdicts(), &manifest.roster);
        let hash = hash(manifest.about().as_bytes());
        Self { plan, manifest, accepted, parts, columns, hash, folder, judgements: Arc::from([]) }
    }

    fn new_manifest(plan: &CampaignPlan, watch: &dyn Watch) -> Result<Manifest, CampaignError> {
        let checked = plan.check(watch)?;
        let parts = Parts::of(plan, &checked, columns(plan.variations(), plan.has_verdicts(), &checked.roster).len())?;
        Ok(Manifest::new(plan, plan.fingerprint_of(&checked.numbers), checked, parts))
    }

    /// The manifest in the folder, which must be that of this plan.
    pub(crate) fn same_manifest(plan: &CampaignPlan, folder: &Folder) -> Result<Manifest, CampaignError> {
        let manifest = Manifest::read(&folder.manifest())?;
        let mut differences = manifest.differences(plan);
        if differences.is_empty() && !manifest.has_fingerprint(plan.fingerprint()?) {
            differences.push("a file that the scene names says something else there than it does here".to_owned());
        }
        if differences.is_empty() { Ok(manifest) } else { Err(CampaignError::Other { path: folder.path().to_path_buf(), differences }) }
    }

    /// The plan.
    #[must_use]
    pub const fn plan(&self) -> &CampaignPlan {
        &self.plan
    }

    /// The columns of the table.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The combinations that are left out, each with its reason.
    #[must_use]
    pub const fn refused(&self) -> &Refused {
        &self.manifest.refused
    }

    /// How many runs there are, without those of combinations that are left out.
    #[must_use]
    pub const fn runs(&self) -> u64 {
        self.accepted.runs()
    }

    /// Whether the table is there.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.table_file().exists()
    }

    /// Judges the combinations that are not judged yet, on all threads of the pool that it is called in. Each judgement is kept as soon as it is known.
    /// Gives how many combinations have none: above 0 if the watch or the judge ended it. Of a plan without verdicts none is missing.
    ///
    /// # Errors
    ///
    /// [`CampaignError::File`] if a judgement cannot be kept, [`CampaignError::Damaged`] if the judgements are not as they were written.
    pub fn judge(&mut self, by: &dyn Judge, watch: &dyn Watch) -> Result<u64, CampaignError> {
        if !self.plan.has_verdicts() || !self.judgements.is_empty() {
            return Ok(0);
        }
        match self.judged(&self.folder.verdicts(), by, watch)? {
            Ok(judgements) => {
                self.judgements = judgements.into();
                Ok(0)
            }
            Err(missing) => Ok(missing),
        }
    }

    /// Judges the combinations as [`Campaign::judge`] does, for a plan without verdicts: the judgements stand in `stability.csv` and not in the table. `Err` with
    /// the number of combinations that have none if the watch or the judge ended it.
    ///
    /// # Errors
    ///
    /// Those of [`Campaign::judge`].
    pub fn judge_apart(&self, by: &dyn Judge, watch: &dyn Watch) -> Result<Result<Vec<Judgement>, u64>, CampaignError> {
        self.judged(&self.folder.stability(), by, watch)
    }

    /// The file of the table, which is there once the campaign is finished.
    #[must_use]
    pub fn table_file(&self) -> PathBuf {
        self.folder.table(self.plan.format())
    }

    /// The file of [`Campaign::judge`]; `None` of a plan without verdicts.
    #[must_use]
    pub fn verdicts_file(&self) -> Option<PathBuf> {
        self.plan.has_verdicts().then(|| self.folder.verdicts())
    }

    /// The file of [`Campaign::judge_apart`].
    #[must_use]
    pub fn stability_file(&self) -> PathBuf {
        self.folder.stability()
    }

    /// The judgements in the table of that name, which is made if it is not there; `Err` with how many are missing.
    fn judged(&self, path: &Path, by: &dyn Judge, watch: &dyn Watch) -> Result<Result<Vec<Judgement>, u64>, CampaignError> {
        let judgements = self.judge_some(path, None, &|_| true, by, watch)?;
        let missing = judgements.iter().filter(|judgement| judgement.is_none()).count() as u64;
        if missing > 0 {
            return Ok(Err(missing));
        }
        let judgements: Vec<Judgement> = judgements.into_iter().flatten().collect();
        // A table of before the end is written anew: nothing says that it is as it was written.
        if !self.is_finished() || !path.exists() {
            write_all(path, &self.plan, &judgements)?;
        }
        if self.is_finished() {
            self.folder.remove_journals(path)?;
        }
        Ok(Ok(judgements))
    }

    /// The judgements that are known, by whichever worker, and then those of the wanted combinations; `None` where there is none.
    pub(crate) fn judge_some(
        &self,
        path: &Path,
        worker: Option<&str>,
        is_wanted: &dyn Fn(u64) -> bool,
        by: &dyn Judge,
        watch: &dyn Watch,
    ) -> Result<Vec<Option<Judgement>>, CampaignError> {
        // A campaign goes on from journals, whose lines have digests. The table of judgements has none: only a finished campaign shows what it says.
        if self.is_finished()
            && let Some(judgements) = read_whole(path, &self.plan)?
        {
            return Ok(judgements.into_iter().map(Some).collect());
        }
        let combinations = self.plan.combinations();
        let mut judgements = vec![None; usize::try_from(combinations).unwrap_or_default()];
        let refused = self.refused().iter().map(|(combination, reason)| (*combination, Judgement::Refused(reason.as_str().into())));
        let mut known = refused.collect::<Vec<_>>();
        for journal in self.folder.journals(path)? {
            let Lines { known: lines, damaged, .. } = Journal::read(&journal, &self.hash, combinations)?;
            known.extend(lines);
            if damaged > 0 {
                watch.damaged(&journal, &format!("{damaged} of its lines are not as they were written: their combinations are judged again"));
            }
        }
        for (combination, judgement) in known {
            judgements[usize::try_from(combination).unwrap_or_default()] = Some(judgement);
        }
        watch.judged(judgements.iter().flatten().count() as u64);
        let missing: Vec<u64> = (0..)
            .zip(&judgements)
            .filter(|(combination, known)| known.is_none() && is_wanted(*combination))
            .map(|(combination, _)| combination)
            .collect();
        if missing.is_empty() {
            return Ok(judgements);
        }
        let (mut file, _) = Journal::open(Folder::journal(path, worker), &self.hash, combinations)?;
        judge(&self.plan, by, watch, &mut file, &missing, judgements)
    }

    /// Does the runs that are missing, on all threads of the pool that it is called in, and puts the table together. A campaign that is finished is left as
    /// it is.
    ///
    /// # Errors
    ///
    /// [`CampaignError::File`] if a file cannot be written: whole parts are kept, of others nothing is left, and once there is room the campaign goes on.
    /// [`CampaignError::Damaged`] if a part or the table is not as it was written. [`CampaignError::NotJudged`] if verdicts are asked for and not known.
    pub fn run(&mut self, watch: &dyn Watch) -> Result<Outcome, CampaignError> {
        if self.plan.has_verdicts() && self.judgements.is_empty() {
            return Err(CampaignError::NotJudged);
        }
        let (mut computed, mut merges) = (0, 0);
        while !self.is_finished() {
            let missing = self.missing(&|_| true, watch)?;
            let done = self.compute(&missing, &self.judgements, &|part, rows| self.keep(None, part, rows), watch)?;
            computed += done;
            let left = self.runs_of(&missing) - done;
            if left > 0 {
                return Ok(Outcome::Interrupted { kept: self.runs() - left });
            }
            merges += 1;
            watch.puts_together();
            match self.merge() {
                // The part was damaged since it was looked at. The next look names it. A disk that does so again and again is an error.
                Err(CampaignError::Damaged { .. }) if merges < MOST_MERGES => {}
                merged => merged?,
            }
        }
        let report = self.report(computed)?;
        self.folder.remove_parts(self.parts.count(), self.plan.format())?;
        self.folder.remove_journals(&self.folder.verdicts())?;
        if self.folder.stability().exists() {
            self.folder.remove_journals(&self.folder.stability())?;
        }
        self.folder.remove_traces_of_shards()?;
        Ok(Outcome::Finished(report))
    }

    /// Does these parts, and gives how many runs have been put away.
    pub(crate) fn compute(&self, parts: &[u64], judgements: &[Judgement], keep: &Keep<'_>, watch: &dyn Watch) -> Result<u64, CampaignError> {
        let (plan, roster, accepted) = (&self.plan, &self.manifest.roster, &self.accepted);
        Work { plan, roster, judgements, accepted, parts: self.parts, watch, keep }.run(parts)
    }

    /// Compares the values of the first key, which are [`Strategies`](crate::Strategies), by the table of a finished campaign.
    ///
    /// # Errors
    ///
    /// [`CampaignError::File`] if the table cannot be read, [`CampaignError::Damaged`] if it is not as it was written, [`CampaignError::Size`] if it has more than
    /// [`MOST_NUMBERS_COMPARED`](crate::MOST_NUMBERS_COMPARED) numbers.
    pub fn compare(&self) -> Result<Comparison, CampaignError> {
        let measures = compared(&self.columns, self.runs())?;
        let path = self.table_file();
        let file = File::open(&path).map_err(|error| CampaignError::File { verb: "read", path: path.clone(), error })?;
        let names: Vec<&str> = measures.iter().map(|measure| measure.name.as_str()).collect();
        let columns = self.plan.format().read_columns(file, &names).map_err(|error| unread(&path, error, TABLE_WAY_OUT))?;
        let (found, runs) = (columns.complete.len() as u64, self.runs());
        if found != runs || columns.columns.iter().any(|column| column.len() != columns.complete.len()) {
            return Err(CampaignError::Damaged { path, message: format!("{found} rows: expected {runs}"), way_out: TABLE_WAY_OUT });
        }
        Ok(Comparison::of(&self.plan, &self.accepted, self.refused(), measures, &columns))
    }

    pub(crate) fn head<'a>(&'a self, about: &'a str) -> Head<'a> {
        Head { columns: &self.columns, about, program: self.plan.program() }
    }

    /// Sums the table up.
    fn report(&self, computed: u64) -> Result<Report, CampaignError> {
        let path = self.table_file();
        let file = File::open(&path).map_err(|error| CampaignError::File { verb: "read", path: path.clone(), error })?;
        let mut tally = Tally::new(self.plan.runs_of_each(), self.plan.combinations(), &self.accepted);
        let read = self.plan.format().read_gists(file, &mut |gist| tally.add(gist));
        read.map_err(|error| unread(&path, error, TABLE_WAY_OUT))?;
        let (found, runs) = (tally.runs(), self.runs());
        if found != runs {
            return Err(CampaignError::Damaged { path, message: format!("{found} rows: expected {runs}"), way_out: TABLE_WAY_OUT });
        }
        let (combinations, quantiles) = tally.finish();
        let (judgements, refused) = (self.judgements.clone(), self.manifest.refused.clone());
        Ok(Report { runs, computed, combinations, quantiles, judgements, refused })
    }
}

pub(crate) fn unwritten(path: &Path, error: TableError) -> CampaignError {
    let error = match error {
        TableError::Io(error) => error,
        error @ (TableError::Content(_) | TableError::Part { .. }) => std::io::Error::other(error.to_string()),
    };
    CampaignError::File { verb: "write", path: path.to_path_buf(), error }
}

pub(crate) fn unread(path: &Path, error: TableError, way_out: &'static str) -> CampaignError {
    match error {
        TableError::Io(error) => CampaignError::File { verb: "read", path: path.to_path_buf(), error },
        error @ (TableError::Content(_) | TableError::Part { .. }) => {
            CampaignError::Damaged { path: path.to_path_buf(), message: error.to_string(), way_out }
        }
    }
}

/// Is told how far a campaign has come, and can end it. Called from many threads.
pub trait Watch: Sync {
    /// Whether to go on. PlanSpec before every few combinations that are checked, before each that is judged, and before every few runs.
    fn keep_going(&self) -> bool {
        true
    }

    /// All runs are done, and their table is put together now. [`Watch::keep_going`] is not asked any more.
    fn puts_together(&self) {}

    /// This number of combinations was checked since the last call.
    fn checked(&self, _combinations: u64) {}

    /// A number of combinations more have been judged.
    fn judged(&self, _combinations: u64) {}

    /// This number of runs was done since the last call.
    fn ran(&self, _runs: u64) {}

    /// A file that a campaign goes on from is not as it was written. `fault`: the difference, and the work that is done again, in words.
    fn damaged(&self, _file: &Path, _fault: &str) {}

    /// A part was put away, which has this number of runs.
    fn kept(&self, _part: u64, _runs: u64) {}
}

/// Nobody looks on.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoWatch;

impl Watch for NoWatch {}
