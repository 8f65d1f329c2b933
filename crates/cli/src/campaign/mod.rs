//! `cohaptic campaign`: runs a scene with all combinations of varied keys. Also the steps in common with `compare`: pool, verdicts, runs and failures.

pub(crate) mod sharing;

use std::io::Write as _;
use std::path::{Component, Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant as Clock;

use cohaptic_answers::campaign::{ByAnalysis, Drawn, Finished, Written};
use cohaptic_answers::page::Origin;
use cohaptic_campaign::{
    Campaign, CampaignError, CampaignPlan, Format, Judge, Judgement, Outcome, PlanSpec, Report, SharedCampaign, Variation, Watch,
};
use cohaptic_scene::{Diagnostic, Scene};

use crate::analysis_watch::Interruptible;
use crate::arguments::CampaignArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::file::write_into;
use crate::progress::Progress;
use crate::shard::Sharing;
use crate::shell::CommandLine;
use crate::{input, interrupt, output, shard};

/// Name and version of the program, for the record in the folder of a campaign.
pub(crate) const PROGRAM: &str = concat!("cohaptic ", env!("CARGO_PKG_VERSION"));

/// Judge of combinations, by analysis. Stops when the user asks for the end.
const JUDGE: ByAnalysis<'static> = ByAnalysis(&Interruptible);

/// Does the missing runs of the whole campaign or of a shard, and prints the results.
pub(crate) fn campaign(arguments: &CampaignArguments) -> Result<ExitCode, Failure> {
    let sharing = Sharing::of(&arguments.shards, arguments.out.as_deref())?;
    let plan = plan(arguments, sharing)?;
    let scene = scene_file(arguments);
    let measures = arguments.measure.override_text();
    let refused = |error: CampaignError| failure(error, scene, ("--measure", measures.as_slice()));
    match sharing {
        Sharing::Whole(_) | Sharing::Merge(_) => {}
        Sharing::Shard(shard, out) => {
            let judge = |shared: &mut SharedCampaign, watch: &dyn Watch| shared.judge(shard, &JUDGE, watch);
            let done = pool(arguments.table.threads, || sharing::shard(plan, shard, out, judge))?;
            return shard::answer(arguments.json, &done.map_err(|ended| ended.unwrap_or_else(refused))?);
        }
        Sharing::Status(out) => return sharing::status(arguments.json, plan, out).map_err(|ended| ended.unwrap_or_else(refused)),
    }
    let out = sharing.folder().unwrap_or_else(|| Path::new("."));
    let start = Clock::now();
    let done = pool(arguments.table.threads, || execute(sharing, out, plan.clone()))?;
    let (report, paths) = done.map_err(|ended| ended.unwrap_or_else(refused))?;
    // The time covers judging and runs, and not the pictures and pages below.
    let wall_s = start.elapsed().as_secs_f64();
    // A refused first combination has no scene. The name of the file then stands in for the title.
    let title = plan.scene(0).map_or_else(|_| output::path(input::named(scene)), |scene| scene.title);
    let notes = cohaptic_answers::campaign::notes(&report);
    let mut finished = Finished { plan, title, report, notes };
    let mut files: Vec<String> = paths.iter().map(|file| output::path(file)).collect();
    if !arguments.no_plot {
        let Drawn { pictures, notes } = cohaptic_answers::campaign::pictures(&finished, arguments.pictures.size());
        let pictures: Vec<(&str, String)> = pictures.into_iter().map(|(name, picture)| (name, picture.svg())).collect();
        for (name, svg) in &pictures {
            files.push(write_into(out, name, svg)?);
        }
        finished.notes.extend(notes);
        files.push(write_into(out, "campaign.html", page(arguments, &finished, &pictures))?);
    }
    let written = Written { wall_s, out: output::path(out), files };
    let document = cohaptic_answers::campaign::document(&finished, Some(&written));
    let words = || cohaptic_answers::campaign::words(&finished, wall_s);
    output::answer(arguments.json, DocumentSchema::CAMPAIGN, &document, words, &written.files)?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the page of a campaign. The command on the page does the whole campaign, however many shards did the runs.
fn page(arguments: &CampaignArguments, finished: &Finished, pictures: &[(&str, String)]) -> String {
    let plan = &finished.plan;
    // Without a scene on the command line, the folder of the campaign tells the path of the scene.
    let scene = arguments.scene.clone().unwrap_or_else(|| shortened(plan.file()));
    let command = CommandLine::new("campaign", &scene, plan.set())
        .option("--vary", plan.variations().iter().map(Variation::text))
        .option("--runs", [plan.runs_of_each()])
        .flag("--verdicts", plan.has_verdicts())
        .option("--format", (plan.format() == Format::Csv).then_some("csv"))
        .out()
        .option("--size", arguments.pictures.word())
        .text();
    let pictures: Vec<(&str, &str)> = pictures.iter().map(|(name, svg)| (*name, svg.as_str())).collect();
    let file = output::path(input::named(&scene));
    cohaptic_answers::campaign::html(
        finished,
        &Origin { command: &command, file: &file, overrides: plan.set(), scene: plan.text(), pictures: &pictures },
    )
}

/// Returns a path without `FOLDER/..`, such as `scenes/a.toml` for `out/../scenes/a.toml`.
fn shortened(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut short, part| {
        // `..` at the beginning of the path, or after another `..`, leaves no named folder and stays.
        let leaves = part == Component::ParentDir && matches!(short.components().next_back(), Some(Component::Normal(_)));
        if leaves {
            short.pop();
        } else {
            short.push(part);
        }
        short
    })
}

/// Does `work` on a new pool of `threads` threads. `None` stands for one thread per processor.
///
/// # Errors
///
/// [`Failure::System`] if the system refuses the threads.
pub(crate) fn pool<T: Send>(threads: Option<u16>, work: impl FnOnce() -> T + Send) -> Result<T, Failure> {
    let threads = usize::from(threads.unwrap_or(0));
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => Ok(pool.install(work)),
        Err(error) => Err(Failure::System(format!("--threads {threads}: {error}"))),
    }
}

/// Returns the file to name in messages: the scene of the command line, otherwise the file of the campaign in the folder.
fn scene_file(arguments: &CampaignArguments) -> &Path {
    arguments.scene.as_deref().unwrap_or_else(|| Path::new("campaign.json"))
}

fn plan(arguments: &CampaignArguments, sharing: Sharing<'_>) -> Result<CampaignPlan, Failure> {
    let measures = arguments.measure.override_text();
    let refused = |error: CampaignError| failure(error, scene_file(arguments), ("--measure", measures.as_slice()));
    let Some(file) = &arguments.scene else {
        // Without a scene, the command continues the campaign recorded in the folder. Options of a new campaign could contradict the record.
        let CampaignArguments { overrides, vary, measure, verdicts, .. } = arguments;
        if !overrides.set.is_empty() || !vary.is_empty() || measure.word().is_some() || *verdicts {
            return Err(Failure::Input("these options of a campaign need its scene: expected the scene too, or none of these options".to_owned()));
        }
        return Campaign::plan_in(sharing.folder().unwrap_or_else(|| Path::new(".")), PROGRAM).map_err(refused);
    };
    let variations =
        arguments.vary.iter().map(|text| Variation::parse(text)).collect::<Result<Vec<Variation>, _>>().map_err(|error| refused(error.into()))?;
    // `--measure` joins the overrides of `--set`, so that the folder records measures with all other keys.
    let set: Vec<String> = arguments.overrides.set.iter().chain(&measures).cloned().collect();
    let (text, file) = (input::text(file)?, input::named(file));
    let (format, part) = (arguments.table.format.into(), arguments.table.part());
    let plan = CampaignPlan::new(PlanSpec { text: &text, file, set: &set, variations, runs: arguments.runs, format, part, program: PROGRAM })
        .map_err(refused)?;
    Ok(if arguments.verdicts { plan.with_verdicts() } else { plan })
}

/// Judges the combinations and does the runs. Returns the report, and the paths of the table of runs and of the table of verdicts, if the campaign has
/// verdicts.
fn execute(sharing: Sharing<'_>, out: &Path, plan: CampaignPlan) -> Result<(Report, Vec<PathBuf>), Ended> {
    let combinations = plan.combinations();
    let mut campaign = open(sharing, plan, out)?;
    let judging = Shown::judging(combinations);
    // A merge takes the verdicts of the shards: a missing verdict is reported, not computed.
    let by: &dyn Judge = if matches!(sharing, Sharing::Merge(_)) { &Nobody } else { &JUDGE };
    let missing = campaign.judge(by, &judging);
    judging.clear();
    let missing = missing.map_err(Ended::Error)?;
    if missing > 0 {
        return Err(Ended::Said(not_all_judged(sharing, combinations - missing, combinations, out)));
    }
    let report = run_to_end(&mut campaign, out)?;
    Ok((report, std::iter::once(campaign.table_file()).chain(campaign.verdicts_file()).collect()))
}

/// Judge of a merge. Makes no verdict, because a merge takes only the verdicts of the shards.
pub(crate) struct Nobody;

impl Judge for Nobody {
    fn judge(&self, _: &Scene) -> Option<Judgement> {
        None
    }
}

/// Begins or continues a campaign and shows the progress of checking the combinations. For a merge, opens the campaign with the runs of the shards.
pub(crate) fn open(sharing: Sharing<'_>, plan: CampaignPlan, out: &Path) -> Result<Campaign, Ended> {
    if let Sharing::Merge(folder) = sharing {
        return Campaign::open_whole(plan, folder).map_err(|error| {
            if let CampaignError::Missing { path, missing } = &error { Ended::Said(shard::missing(path, missing)) } else { Ended::Error(error) }
        });
    }
    let checking = Shown::checking(plan.combinations());
    let opened = Campaign::open(plan, out, &checking);
    checking.clear();
    opened.map_err(Ended::Error)
}

/// Returns the failure for a campaign without verdicts on all combinations: the user ended the judging, or the verdicts of a shard are missing.
pub(crate) fn not_all_judged(sharing: Sharing<'_>, judged: u64, combinations: u64, out: &Path) -> Failure {
    let kept = format!("{judged} of {combinations} verdicts are kept in {}", output::path(out));
    match sharing {
        Sharing::Merge(_) => {
            Failure::System(format!("{kept}: expected all. Run the missing shards again, or the command with --out and without --shard"))
        }
        Sharing::Whole(_) | Sharing::Shard(..) | Sharing::Status(_) => {
            Failure::Interrupted(format!("{kept}; repeat the command to go on from there"))
        }
    }
}

/// Reason why a command on a campaign ended without its result.
pub(crate) enum Ended {
    /// A failure whose message is complete.
    Said(Failure),
    /// An error of the campaign. The caller adds the names of its own options.
    Error(CampaignError),
}

impl Ended {
    /// Returns the failure, converting an error of the campaign by `said`.
    pub(crate) fn unwrap_or_else(self, said: impl FnOnce(CampaignError) -> Failure) -> Failure {
        match self {
            Self::Said(failure) => failure,
            Self::Error(error) => said(error),
        }
    }
}

/// Does the missing runs and shows their progress.
pub(crate) fn run_to_end(campaign: &mut Campaign, out: &Path) -> Result<Report, Ended> {
    let runs = campaign.runs();
    let running = Shown::running(runs, campaign.kept());
    let outcome = campaign.run(&running);
    running.clear();
    match outcome {
        Ok(Outcome::Finished(report)) => Ok(report),
        Ok(Outcome::Interrupted { kept }) => {
            let out = output::path(out);
            Err(Ended::Said(Failure::Interrupted(format!("{kept} of {runs} runs are kept in {out}; repeat the command to go on from there"))))
        }
        // An error of a file, such as a full disk, does not harm the runs that are kept, so the message tells how to continue.
        Err(error @ CampaignError::File { .. }) => {
            let kept = campaign.kept();
            let going_on = format!("{error}\n{kept} of {runs} runs are kept: once the cause is removed, repeat the command to go on from there");
            Err(Ended::Said(Failure::System(going_on)))
        }
        Err(error) => Err(Ended::Error(error)),
    }
}

/// Converts an error of a campaign into a failure with the name of the option at fault. `given`: an option of the command, with the overrides of that option.
pub(crate) fn failure(error: CampaignError, scene: &Path, (given, overrides): (&'static str, &[String])) -> Failure {
    match error {
        CampaignError::Scene { error, varied } => {
            // The override at fault is looked for among the overrides of each option. A strategy is a variation too, so `given` is asked first.
            let culprit = error.diagnostic().and_then(Diagnostic::override_text).unwrap_or_default();
            let among = |texts: &[String]| texts.iter().any(|text| text == culprit);
            let option = match (among(overrides), among(&varied)) {
                (true, _) => given,
                (false, true) => "--vary",
                (false, false) => "--set",
            };
            Failure::Combination { error, option, combination: combination(&varied) }
        }
        CampaignError::NotRun { message, varied } => Failure::Input(format!("{}: {message}{}", output::path(scene), combination(&varied))),
        error @ (CampaignError::Vary(_) | CampaignError::SameKey { .. }) => Failure::Input(format!("--vary: {error}")),
        error @ CampaignError::Seeds { .. } => Failure::Input(format!("--runs: {error}")),
        error @ CampaignError::Size(_) => Failure::Input(error.to_string()),
        error @ (CampaignError::NoFolder { .. } | CampaignError::Foreign { .. } | CampaignError::Other { .. }) => {
            Failure::Input(format!("--out: {error}"))
        }
        error @ CampaignError::NoCampaign { .. } => Failure::Input(error.to_string()),
        error @ CampaignError::Stopped => Failure::Interrupted(error.to_string()),
        error @ (CampaignError::Damaged { .. } | CampaignError::Busy { .. } | CampaignError::File { .. } | _) => Failure::System(error.to_string()),
    }
}

/// Returns a line that names the combination of a fault. Empty if the campaign varies nothing.
fn combination(varied: &[String]) -> String {
    if varied.is_empty() { String::new() } else { format!("\nnote: in the combination {}", varied.join(", ")) }
}

/// Progress of a campaign on the terminal. Ends the campaign when the user asks for the end.
pub(crate) struct Shown(Progress);

impl Shown {
    fn checking(combinations: u64) -> Self {
        Self(Progress::new(combinations, "checking combinations {bar:30} {pos}/{len}, {eta} left"))
    }

    pub(crate) fn judging(combinations: u64) -> Self {
        Self(Progress::new(combinations, "judging combinations {bar:30} {pos}/{len}, {eta} left"))
    }

    fn running(runs: u64, kept: u64) -> Self {
        Self(Progress::through_runs(runs, kept))
    }

    pub(crate) fn clear(&self) {
        self.0.clear();
    }
}

impl Watch for Shown {
    fn keep_going(&self) -> bool {
        !interrupt::requested()
    }

    fn puts_together(&self) {
        interrupt::has_results();
    }

    fn checked(&self, combinations: u64) {
        self.0.more(combinations);
    }

    fn judged(&self, combinations: u64) {
        self.0.more(combinations);
    }

    fn ran(&self, runs: u64) {
        self.0.more(runs);
    }

    fn damaged(&self, file: &Path, fault: &str) {
        // The damaged file is computed again even if standard error cannot be written to.
        self.0.aside(|| drop(writeln!(std::io::stderr(), "note: {} is damaged: {}", output::path(file), fault)));
    }
}
