//! A campaign bound to its folder: opening, judging, running, merging and comparing.
//!
//! The module decides the order of these steps. The files are read and written by `folder`, `kept`, `table` and `verdicts`; the runs are made by `work`.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::compare::{Comparison, compared};
use crate::error::CampaignError;
use crate::folder::{Folder, Manifest, hash};
use crate::judgement::Judgement;
use crate::plan::{Accepted, CampaignPlan, Parts, Refused};
use crate::report::{Report, Tally};
use crate::shard::Missing;
use crate::table::{Column, Head, TableError, columns};
use crate::verdicts::{Journal, Judge, Lines, judge, read_whole, write_all};
use crate::watch::{NoWatch, Watch};
use crate::work::{Keep, Work};

/// Greatest number of attempts of one call to merge the parts. After each attempt but the last, a part found damaged is computed again.
const MOST_MERGES: u32 = 3;

/// Advice to the user about a damaged table, printed with the error.
const TABLE_WAY_OUT: &str = "remove the folder, or choose another one";

/// A campaign in its folder. A campaign opened with [`Campaign::open`] keeps the folder locked against other processes as long as the value lives.
#[derive(Debug)]
pub struct Campaign {
    pub(crate) plan: CampaignPlan,
    pub(crate) manifest: Manifest,
    pub(crate) accepted: Accepted,
    pub(crate) parts: Parts,
    columns: Vec<Column>,
    /// Hash of the manifest. The digest of each part contains this hash.
    pub(crate) hash: String,
    pub(crate) folder: Folder,
    /// Judgements, indexed by combination. Empty before [`Campaign::judge`] has judged every combination, and always empty for a plan without verdicts.
    judgements: Arc<[Judgement]>,
}

/// End of a call of [`Campaign::run`].
#[derive(Clone, PartialEq, Debug)]
pub enum Outcome {
    /// All runs are done, and the table is written.
    Finished(Report),
    /// The watch stopped the campaign. The same plan in the same folder continues it.
    Interrupted {
        /// Number of runs stored in the folder, including the runs of earlier calls.
        kept: u64,
    },
}

impl Campaign {
    /// Begins a campaign in a folder, or continues the campaign found in the folder if the plans are equal. A new campaign first checks every combination, on
    /// all threads of the current thread pool; nothing is written before all are accepted.
    ///
    /// # Errors
    ///
    /// [`CampaignError`] if a combination is refused, if the path is no folder, if the folder holds foreign files or another campaign, if another process works
    /// on the folder, or if the folder cannot be read or written.
    pub fn open(plan: CampaignPlan, folder: &Path, watch: &dyn Watch) -> Result<Self, CampaignError> {
        let campaign = Self::open_in(plan, folder, None, watch)?;
        campaign.folder.has_no_shards()?;
        campaign.folder.sweep()?;
        Ok(campaign)
    }

    /// Returns the plan of the campaign in a folder, with the text of the scene as of the beginning of the campaign. `program`: name and version of the calling
    /// program, as in [`PlanSpec::program`](crate::PlanSpec::program).
    ///
    /// # Errors
    ///
    /// [`CampaignError::NoCampaign`] if the folder has no campaign; [`CampaignError`] if the folder cannot be read or its manifest makes no sense;
    /// [`CampaignError::Other`] for a campaign of another program, and for a comparison, because its manifest does not store the overrides of
    /// [`CampaignPlan::leaving_out`].
    pub fn plan_in(folder: &Path, program: &str) -> Result<CampaignPlan, CampaignError> {
        if !Folder::has_campaign(folder)? {
            return Err(CampaignError::NoCampaign { path: folder.to_path_buf() });
        }
        let manifest = Manifest::read(&folder.join(crate::folder::MANIFEST))?;
        let plan = manifest.plan(folder, program)?;
        let differences = manifest.differences(&plan);
        if differences.is_empty() { Ok(plan) } else { Err(CampaignError::Other { path: folder.to_path_buf(), differences }) }
    }

    /// Opens a campaign like [`Campaign::open`], and requires all of its runs to be done, by shards or otherwise. [`Campaign::run`] then only merges the parts
    /// into the table.
    ///
    /// # Errors
    ///
    /// The errors of [`Campaign::open`]; [`CampaignError::NoCampaign`] if the folder has no campaign, [`CampaignError::Missing`] if parts are not done.
    pub fn open_whole(plan: CampaignPlan, folder: &Path) -> Result<Self, CampaignError> {
        if !Folder::has_campaign(folder)? {
            return Err(CampaignError::NoCampaign { path: folder.to_path_buf() });
        }
        let campaign = Self::open_in(plan, folder, None, &NoWatch)?;
        if !campaign.is_finished() {
            // The names of the files suffice here: `run` reads every part, and computes damaged parts again.
            let missing = campaign.absent()?;
            if !missing.is_empty() {
                let missing = Missing { piece: "part", count: campaign.parts.count(), pieces: missing };
                return Err(CampaignError::Missing { path: folder.to_path_buf(), missing });
            }
        }
        // A worker may still repeat a finished shard, which is harmless. Its partial files must not be removed then.
        if campaign.folder.has_no_shards().is_ok() {
            campaign.folder.sweep()?;
        }
        Ok(campaign)
    }

    /// Opens the campaign for this process alone (`worker` is `None`), or for one of several workers with that name.
    pub(crate) fn open_in(plan: CampaignPlan, folder: &Path, worker: Option<&str>, watch: &dyn Watch) -> Result<Self, CampaignError> {
        // A new campaign is checked before the folder is created, so that a refused plan leaves nothing behind.
        let begun = Folder::has_campaign(folder)?;
        let new = if begun { None } else { Some(Self::new_manifest(&plan, watch)?) };
        let folder = if worker.is_none() { Folder::take(folder)? } else { Folder::share(folder)? };
        // The folder is created only now, after the check of a new campaign has accepted every combination.
        let manifest = match new {
            // Another worker may have written a manifest since `has_campaign`. Then the plan must match that manifest.
            Some(manifest) if !folder.manifest().exists() => {
                let manifest = manifest.of_file(plan.file(), folder.path());
                if let Err(error) = manifest.write(&folder.manifest(), worker) {
                    // The folder may have been created a moment ago. Without a manifest it would be an empty folder nobody asked for.
                    folder.give_up();
                    return Err(error);
                }
                manifest
            }
            Some(_) | None => Self::same_manifest(&plan, &folder)?,
        };
        Ok(Self::of(plan, manifest, folder))
    }

    /// Returns the campaign with this manifest, without reading any file.
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

    /// Reads the manifest in the folder, and checks it against the plan and against the files named by the scene.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Other`] with all differences if the manifest is of another campaign.
    pub(crate) fn same_manifest(plan: &CampaignPlan, folder: &Folder) -> Result<Manifest, CampaignError> {
        let manifest = Manifest::read(&folder.manifest())?;
        let mut differences = manifest.differences(plan);
        if differences.is_empty() && !manifest.has_fingerprint(plan.fingerprint()?) {
            // Equal texts can still name a changed file, such as a trace. Only the fingerprint covers the content of files.
            differences.push("a file that the scene names says something else there than it does here".to_owned());
        }
        if differences.is_empty() { Ok(manifest) } else { Err(CampaignError::Other { path: folder.path().to_path_buf(), differences }) }
    }

    /// Returns the plan.
    #[must_use]
    pub const fn plan(&self) -> &CampaignPlan {
        &self.plan
    }

    /// Returns the columns of the table.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Returns the left out combinations, each with its reason.
    #[must_use]
    pub const fn refused(&self) -> &Refused {
        &self.manifest.refused
    }

    /// Returns the number of runs, without the runs of left out combinations.
    #[must_use]
    pub const fn runs(&self) -> u64 {
        self.accepted.runs()
    }

    /// Returns `true` if the table exists.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.table_file().exists()
    }

    /// Judges the combinations without a judgement, on all threads of the current thread pool. Each judgement is written to the journal at once.
    ///
    /// Returns the number of combinations still without a judgement: above 0 if the watch or the judge stopped the work. For a plan without verdicts the number
    /// is 0.
    ///
    /// # Errors
    ///
    /// [`CampaignError::File`] if a judgement cannot be written, [`CampaignError::Damaged`] if the table of judgements is not as it was written.
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

    /// Judges the combinations like [`Campaign::judge`], for a plan without verdicts: the judgements are written to `stability.csv` and not to the table.
    /// `Ok(Err)` holds the number of combinations without a judgement, if the watch or the judge stopped the work.
    ///
    /// # Errors
    ///
    /// The errors of [`Campaign::judge`].
    pub fn judge_apart(&self, by: &dyn Judge, watch: &dyn Watch) -> Result<Result<Vec<Judgement>, u64>, CampaignError> {
        self.judged(&self.folder.stability(), by, watch)
    }

    /// Returns the path of the table. The file exists once the campaign is finished.
    #[must_use]
    pub fn table_file(&self) -> PathBuf {
        self.folder.table(self.plan.format())
    }

    /// Returns the path of the judgements made by [`Campaign::judge`]; `None` for a plan without verdicts.
    #[must_use]
    pub fn verdicts_file(&self) -> Option<PathBuf> {
        self.plan.has_verdicts().then(|| self.folder.verdicts())
    }

    /// Returns the path of the judgements made by [`Campaign::judge_apart`].
    #[must_use]
    pub fn stability_file(&self) -> PathBuf {
        self.folder.stability()
    }

    /// Judges all combinations into the table of judgements at `path`, and returns the judgements, indexed by combination. `Ok(Err)` holds the number of
    /// missing judgements.
    fn judged(&self, path: &Path, by: &dyn Judge, watch: &dyn Watch) -> Result<Result<Vec<Judgement>, u64>, CampaignError> {
        let judgements = self.judge_some(path, None, &|_| true, by, watch)?;
        let missing = judgements.iter().filter(|judgement| judgement.is_none()).count() as u64;
        if missing > 0 {
            return Ok(Err(missing));
        }
        let judgements: Vec<Judgement> = judgements.into_iter().flatten().collect();
        // Before the campaign is finished, an existing table of judgements has no digest and may be damaged. The journals have digests, so the table is rebuilt
        // from them.
        if !self.is_finished() || !path.exists() {
            // Written as a whole, in the order of the combinations, whatever the order of the journal.
            write_all(path, &self.plan, &judgements)?;
        }
        if self.is_finished() {
            // The journals stay until the end of the campaign, because only their lines have digests.
            self.folder.remove_journals(path)?;
        }
        Ok(Ok(judgements))
    }

    /// Returns the judgements, indexed by combination: first the known judgements of all workers, then new judgements of the wanted combinations. An entry is
    /// `None` if its combination is neither known nor judged now. `worker` names the journal to write.
    pub(crate) fn judge_some(
        &self,
        path: &Path,
        worker: Option<&str>,
        is_wanted: &dyn Fn(u64) -> bool,
        by: &dyn Judge,
        watch: &dyn Watch,
    ) -> Result<Vec<Option<Judgement>>, CampaignError> {
        // A running campaign continues from the journals, because every line has a digest. The table of judgements has no digest, so only a finished campaign
        // reads it.
        if self.is_finished()
            && let Some(judgements) = read_whole(path, &self.plan)?
        {
            return Ok(judgements.into_iter().map(Some).collect());
        }
        let combinations = self.plan.combinations();
        let mut judgements = vec![None; usize::try_from(combinations).unwrap_or_default()];
        let refused = self.refused().iter().map(|(combination, reason)| (*combination, Judgement::Refused(reason.as_str().into())));
        let mut known = refused.collect::<Vec<_>>();
        // All workers judge alike, so the judgement of a combination found in two journals is the same, and the order of the journals does not matter.
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
        // Refused combinations are known above, so the judge never sees a scene which cannot be read.
        let missing: Vec<u64> = (0..)
            .zip(&judgements)
            .filter(|(combination, known)| known.is_none() && is_wanted(*combination))
            .map(|(combination, _)| combination)
            .collect();
        if missing.is_empty() {
            return Ok(judgements);
        }
        // Each worker appends to a journal of its own, so no lock is needed between workers.
        let (mut file, _) = Journal::open(Folder::journal(path, worker), &self.hash, combinations)?;
        judge(&self.plan, by, watch, &mut file, &missing, judgements)
    }

    /// Does the missing runs, on all threads of the current thread pool, and merges the parts into the table. A finished campaign is left unchanged.
    ///
    /// # Errors
    ///
    /// [`CampaignError::File`] if a file cannot be written: whole parts stay, unfinished parts are removed, and the campaign can be continued once there is
    /// room. [`CampaignError::Damaged`] if a part or the table is not as it was written. [`CampaignError::NotJudged`] if the plan has verdicts and
    /// [`Campaign::judge`] has not finished.
    pub fn run(&mut self, watch: &dyn Watch) -> Result<Outcome, CampaignError> {
        if self.plan.has_verdicts() && self.judgements.is_empty() {
            return Err(CampaignError::NotJudged);
        }
        let (mut computed, mut merges) = (0, 0);
        while !self.is_finished() {
            let missing = self.missing(&|_| true, watch)?;
            let done = self.compute(&missing, &self.judgements, &|part, rows| self.keep(None, part, rows), watch)?;
            computed += done;
            // Runs of a part count only once the whole part is stored.
            let left = self.runs_of(&missing) - done;
            if left > 0 {
                return Ok(Outcome::Interrupted { kept: self.runs() - left });
            }
            merges += 1;
            // The merge cannot be stopped by the watch: it only copies bytes.
            watch.puts_together();
            match self.merge() {
                // The part was damaged after `missing` had read it. The next pass names and repeats the part. A disk that fails again and again ends with the
                // error.
                Err(CampaignError::Damaged { .. }) if merges < MOST_MERGES => {}
                merged => merged?,
            }
        }
        let report = self.report(computed)?;
        // The parts and journals are removed last: a process killed before this line finds everything again.
        self.folder.remove_parts(self.parts.count(), self.plan.format())?;
        self.folder.remove_journals(&self.folder.verdicts())?;
        if self.folder.stability().exists() {
            self.folder.remove_journals(&self.folder.stability())?;
        }
        self.folder.remove_traces_of_shards()?;
        Ok(Outcome::Finished(report))
    }

    /// Computes these parts, and returns the number of stored runs. `judgements` is indexed by combination.
    pub(crate) fn compute(&self, parts: &[u64], judgements: &[Judgement], keep: &Keep<'_>, watch: &dyn Watch) -> Result<u64, CampaignError> {
        let (plan, roster, accepted) = (&self.plan, &self.manifest.roster, &self.accepted);
        Work { plan, roster, judgements, accepted, parts: self.parts, watch, keep }.run(parts)
    }

    /// Compares the values of the first varied key, which must be [`Strategies`](crate::Strategies), from the table of a finished campaign.
    ///
    /// # Errors
    ///
    /// [`CampaignError::File`] if the table cannot be read, [`CampaignError::Damaged`] if the table is not as it was written, [`CampaignError::Size`] if the
    /// comparison needs more than [`MOST_NUMBERS_COMPARED`](crate::MOST_NUMBERS_COMPARED) numbers.
    pub fn compare(&self) -> Result<Comparison, CampaignError> {
        let measures = compared(&self.columns, self.runs())?;
        let path = self.table_file();
        let file = File::open(&path).map_err(|error| CampaignError::File { verb: "read", path: path.clone(), error })?;
        let names: Vec<&str> = measures.iter().map(|measure| measure.name.as_str()).collect();
        let columns = self.plan.format().read_columns(file, &names).map_err(|error| unread(&path, error, TABLE_WAY_OUT))?;
        // The table has no digest. The number of its rows shows a truncated table.
        let (found, runs) = (columns.complete.len() as u64, self.runs());
        if found != runs || columns.columns.iter().any(|column| column.len() != columns.complete.len()) {
            return Err(CampaignError::Damaged { path, message: format!("{found} rows: expected {runs}"), way_out: TABLE_WAY_OUT });
        }
        Ok(Comparison::of(&self.plan, &self.accepted, self.refused(), measures, &columns))
    }

    pub(crate) fn head<'a>(&'a self, about: &'a str) -> Head<'a> {
        Head { columns: &self.columns, about: ("cohaptic.campaign", about), program: self.plan.program() }
    }

    /// Reads the table and sums it up. `computed`: number of runs done by this call.
    fn report(&self, computed: u64) -> Result<Report, CampaignError> {
        let path = self.table_file();
        let file = File::open(&path).map_err(|error| CampaignError::File { verb: "read", path: path.clone(), error })?;
        // The report comes from the table and not from the rows in memory: most rows may be from earlier calls.
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
    // The caller knows one kind of failed write, so a fault in the content becomes an error of input and output.
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
