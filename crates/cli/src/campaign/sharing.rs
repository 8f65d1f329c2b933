//! Shards of a campaign or comparison, and the status of a folder that shards work in.

use std::path::Path;
use std::process::ExitCode;

use cohaptic_campaign::{CampaignError, CampaignPlan, FolderState, Shard, SharedCampaign, Watch};

use super::{Ended, Shown};
use crate::failure::Failure;
use crate::output;
use crate::shard::{Done, Names, Piece, Worker, owner, show};

const NAMES: Names = Names { piece: "part", unit: "run" };

/// Judges the combinations of a shard and does the shard's runs. `judge` returns the number of combinations without a verdict, above 0 if the judging was
/// ended.
pub(crate) fn shard(
    plan: CampaignPlan,
    shard: Shard,
    folder: &Path,
    judge: impl FnOnce(&mut SharedCampaign, &dyn Watch) -> Result<u64, CampaignError>,
) -> Result<Done, Ended> {
    let combinations = plan.combinations();
    let owner = owner();
    let checking = Shown::checking(combinations);
    let opened = SharedCampaign::open(plan, folder, &owner.name(), &checking);
    checking.clear();
    let mut shared = opened.map_err(Ended::Error)?;
    // The campaign is opened before the lease is taken, so that a refused campaign leaves no lease and no log.
    let worker = Worker::begin(folder, shard, &owner).map_err(Ended::Said)?;
    let done = work(&mut shared, shard, folder, &worker, judge);
    worker.end(done, Ended::Said)
}

fn work(
    shared: &mut SharedCampaign,
    shard: Shard,
    folder: &Path,
    worker: &Worker,
    judge: impl FnOnce(&mut SharedCampaign, &dyn Watch) -> Result<u64, CampaignError>,
) -> Result<Done, Ended> {
    let ended = |what: &str| {
        Ended::Said(Failure::Interrupted(format!(
            "shard {shard}: {what} is kept in {}; repeat the command to go on from there",
            output::path(folder)
        )))
    };
    let judging = Shown::judging(shared.campaign().plan().combinations());
    let missing = judge(shared, &Working { shown: &judging, worker });
    judging.clear();
    if missing.map_err(Ended::Error)? > 0 {
        return Err(ended("each verdict that was made"));
    }
    // An estimate of the shard's runs: the parts of a campaign need not divide evenly among the shards.
    let running = Shown::running(shared.campaign().runs() / shard.count(), 0);
    let report = shared.run(shard, &Working { shown: &running, worker });
    running.clear();
    // A fault of the file system, such as a full disk, does not harm whole parts, so that the message tells how to continue.
    let report = report.map_err(|error| {
        if !matches!(error, CampaignError::File { .. }) {
            return Ended::Error(error);
        }
        Ended::Said(Failure::System(format!(
            "{error}\nParts that are whole are kept: once the cause is removed, repeat the command to go on from there"
        )))
    })?;
    if report.left > 0 {
        return Err(ended(&format!("all but {} of its {} runs", report.left, report.runs)));
    }
    let wall_s = worker.wall_s();
    Ok(Done { shard, folder: output::path(folder), names: NAMES, pieces: report.parts, units: report.runs, computed: report.computed, wall_s })
}

/// Progress of a shard. Ends the shard when the user asks for the end or when another process has taken the shard.
struct Working<'a> {
    shown: &'a Shown,
    worker: &'a Worker,
}

impl Watch for Working<'_> {
    fn keep_going(&self) -> bool {
        self.worker.goes_on()
    }

    fn judged(&self, combinations: u64) {
        self.shown.judged(combinations);
    }

    fn ran(&self, runs: u64) {
        self.shown.ran(runs);
    }

    fn damaged(&self, file: &Path, fault: &str) {
        self.shown.damaged(file, fault);
    }

    fn kept(&self, part: u64, runs: u64) {
        self.worker.kept(part, runs);
    }
}

/// Prints the state of each part of the campaign in a folder: done or missing.
pub(crate) fn status(json: bool, plan: CampaignPlan, folder: &Path) -> Result<ExitCode, Ended> {
    let FolderState { parts, is_merged } = SharedCampaign::state_in(plan, folder).map_err(Ended::Error)?;
    let pieces: Vec<Piece> = parts.iter().map(|part| Piece { units: part.runs, is_done: part.is_done }).collect();
    show(json, folder, NAMES, &pieces, is_merged).map_err(Ended::Said)
}
