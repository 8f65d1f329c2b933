//! A bench for tests: a folder, a scene, and campaigns over the scene.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use cohaptic_campaign::{
    Campaign, CampaignError, CampaignPlan, Format, NoWatch, Outcome, PlanSpec, Report, Shard, ShardReport, SharedCampaign, Variation, Watch,
};
use tempfile::TempDir;

/// Two users for 40 ticks, over links with random losses and delays.
pub(crate) const SCENE: &str = r#"
[scene]
duration = "40ms"
seed     = 7

[object]
mass = 0.3

[coordination]
strategy  = "average-position"
stiffness = 1000.0
damping   = 20.0
update    = "2ms"

[peer]
device   = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 3500.0, damping = 5.0 }

[[peers]]
name = "left"
hand = { force = 1.5 }

[[peers]]
name = "right"

[link]
delay  = "6ms"
jitter = "1ms"
loss   = "20%"
"#;

/// Variations of most tests, with four combinations.
pub(crate) const VARY: [&str; 2] = ["coordination.stiffness=500..1500/2", "link.loss=0%,40%"];

pub(crate) struct Bench {
    folder: TempDir,
    pub(crate) text: String,
    pub(crate) set: Vec<String>,
    pub(crate) vary: Vec<String>,
    pub(crate) runs: u64,
    pub(crate) part: Option<u64>,
    pub(crate) format: Format,
    pub(crate) program: &'static str,
}

impl Bench {
    pub(crate) fn new(vary: &[&str], runs: u64) -> Self {
        let vary = vary.iter().map(|text| (*text).to_owned()).collect();
        let folder = tempfile::tempdir().unwrap();
        Self { folder, text: SCENE.to_owned(), set: Vec::new(), vary, runs, part: None, format: Format::Parquet, program: "a test" }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Returns the names of the files in a folder, sorted.
    pub(crate) fn files(&self, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.path(folder)).unwrap().map(Result::unwrap);
        let mut files: Vec<String> = entries.map(|entry| entry.file_name().into_string().unwrap()).collect();
        files.sort();
        files
    }

    /// Returns the names of the parts in a folder, sorted and without the digests.
    pub(crate) fn parts(&self, folder: &str) -> Vec<String> {
        let is_part = |name: &String| name.starts_with("part-") && name.ends_with(self.format.name());
        self.files(folder).into_iter().filter(is_part).collect()
    }

    pub(crate) fn plan(&self) -> Result<CampaignPlan, CampaignError> {
        let variations = self.vary.iter().map(|text| Variation::parse(text)).collect::<Result<_, _>>()?;
        let file = self.folder.path().join("scene.toml");
        let Self { text, set, runs, format, part, program, .. } = self;
        CampaignPlan::new(PlanSpec { text, file: &file, set, variations, runs: *runs, format: *format, part: *part, program })
    }

    pub(crate) fn open(&self, folder: &str) -> Result<Campaign, CampaignError> {
        Campaign::open(self.plan()?, &self.path(folder), &NoWatch)
    }

    /// Runs the campaign with this number of threads until its end or until the watch stops it.
    pub(crate) fn outcome(&self, folder: &str, threads: usize, watch: &dyn Watch) -> Result<Outcome, CampaignError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Campaign::open(self.plan()?, &self.path(folder), watch)?.run(watch))
    }

    /// Does a shard with this number of threads, as a worker with this name.
    pub(crate) fn shard(&self, folder: &str, shard: Shard, worker: &str, threads: usize, watch: &dyn Watch) -> Result<ShardReport, CampaignError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| SharedCampaign::open(self.plan()?, &self.path(folder), worker, watch)?.run(shard, watch))
    }

    /// Merges the shards.
    pub(crate) fn merge(&self, folder: &str) -> Result<Report, CampaignError> {
        Ok(finished(Campaign::open_whole(self.plan()?, &self.path(folder))?.run(&NoWatch)?))
    }

    /// Runs the campaign to its end.
    pub(crate) fn finish(&self, folder: &str, threads: usize) -> Report {
        finished(self.outcome(folder, threads, &NoWatch).unwrap())
    }

    /// Returns the bytes of the table.
    pub(crate) fn table(&self, folder: &str) -> Vec<u8> {
        std::fs::read(self.path(folder).join(format!("runs.{}", self.format.name()))).unwrap()
    }

    /// Checks that the campaign is refused, with a message containing all of these parts.
    pub(crate) fn assert_refused(&self, folder: &str, parts: &[&str]) -> CampaignError {
        let error = self.open(folder).map(drop).unwrap_err();
        for part in parts {
            assert!(error.to_string().contains(part), "no {part:?} in: {error}");
        }
        error
    }
}

pub(crate) fn finished(outcome: Outcome) -> Report {
    match outcome {
        Outcome::Finished(report) => report,
        Outcome::Interrupted { kept } => panic!("interrupted with {kept} runs"),
    }
}

/// Stops a campaign after this number of runs.
pub(crate) struct StopAfter(pub(crate) u64, AtomicU64);

impl StopAfter {
    pub(crate) const fn runs(runs: u64) -> Self {
        Self(runs, AtomicU64::new(0))
    }
}

impl Watch for StopAfter {
    fn keep_going(&self) -> bool {
        self.1.load(Ordering::SeqCst) < self.0
    }

    fn ran(&self, runs: u64) {
        self.1.fetch_add(runs, Ordering::SeqCst);
    }
}

/// Reads a table of CSV: header and rows.
pub(crate) fn comma_separated(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let header = reader.headers().unwrap().iter().map(str::to_owned).collect();
    (header, reader.records().map(|record| record.unwrap().iter().map(str::to_owned).collect()).collect())
}
