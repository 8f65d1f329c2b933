//! `cohaptic compare`: compares strategies of coordination in the same scene, by runs and by analysis.

mod page;
mod preset;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant as Clock;

use cohaptic_answers::campaign::Written;
use cohaptic_answers::compare::{ByAnalysisOrRuns, Finished};
use cohaptic_campaign::{CampaignError, CampaignPlan, Judge, PlanSpec, SharedCampaign, Strategies, Variation, Watch};

use crate::analysis_watch::Interruptible;
use crate::arguments::{CompareArguments, MeasureArguments};
use crate::campaign::{self, PROGRAM, Shown};
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::file::write_into;
use crate::shard::Sharing;
use crate::{input, output, shard};
use preset::Asked;

/// Judge of combinations, by analysis or by runs. Stops when the user asks for the end.
const JUDGE: ByAnalysisOrRuns<'static> = ByAnalysisOrRuns(&Interruptible);

/// Does the missing runs, and writes and prints the comparison of the strategies.
pub(crate) fn compare(arguments: &CompareArguments) -> Result<ExitCode, Failure> {
    let asked = Asked::of(arguments).map_err(|error| Failure::Input(format!("--strategies: {error}")))?;
    // These overrides tell a failure of a strategy from a failure of `--set`, so that the message names `--strategies`.
    let settings: Vec<String> = overrides(&asked.strategies);
    let refused = |error: CampaignError| campaign::failure(error, &arguments.scene.scene, ("--strategies", &settings));
    let plan = plan(arguments, &asked).map_err(|error| error.unwrap_or_else(refused))?;
    let sharing = Sharing::of(&arguments.shards, arguments.out.as_deref())?;
    match sharing {
        Sharing::Whole(_) | Sharing::Merge(_) => {}
        Sharing::Shard(shard, out) => {
            let judge = |shared: &mut SharedCampaign, watch: &dyn Watch| shared.judge_apart(shard, &JUDGE, watch);
            let done = campaign::pool(arguments.table.threads, || campaign::sharing::shard(plan, shard, out, judge))?;
            return shard::answer(arguments.scene.json, &done.map_err(|error| error.unwrap_or_else(refused))?);
        }
        Sharing::Status(out) => {
            return campaign::sharing::status(arguments.scene.json, plan, out).map_err(|error| error.unwrap_or_else(refused));
        }
    }
    let out = sharing.folder().unwrap_or_else(|| Path::new("."));
    let start = Clock::now();
    let finished = campaign::pool(arguments.table.threads, || execute(arguments, sharing, out, plan))?;
    let (finished, paths) = finished.map_err(|error| error.unwrap_or_else(refused))?;
    let wall_s = start.elapsed().as_secs_f64();
    let scene = input::text(&arguments.scene.scene)?;
    let html = cohaptic_answers::compare::html(&finished, &page::source(arguments, &finished, &scene)?);
    let mut files: Vec<String> = paths.iter().map(|file| output::path(file)).collect();
    for (name, content) in [("compare.csv", cohaptic_answers::compare::csv(&finished)), ("compare.html", html)] {
        files.push(write_into(out, name, content)?);
    }
    for (name, picture) in cohaptic_answers::compare::pictures(&finished) {
        files.push(write_into(out, &name, picture.svg())?);
    }
    let written = Written { wall_s, out: output::path(out), files };
    let document = cohaptic_answers::compare::document(&finished, Some(&written));
    let words = || cohaptic_answers::compare::words(&finished, wall_s);
    output::answer(arguments.scene.json, DocumentSchema::COMPARE, &document, words, &written.files)?;
    Ok(ExitCode::SUCCESS)
}

/// Returns all overrides that the strategies put into scenes.
fn overrides(strategies: &Strategies) -> Vec<String> {
    let variation = strategies.variation();
    (0..variation.count()).flat_map(|place| variation.overrides(place)).collect()
}

/// Returns the overrides of every run: the overrides of the user, and all measures.
fn set(arguments: &CompareArguments) -> Vec<String> {
    arguments.scene.overrides.set.iter().cloned().chain(MeasureArguments::all().override_text()).collect()
}

fn plan(arguments: &CompareArguments, asked: &Asked) -> Result<CampaignPlan, campaign::Ended> {
    let said = campaign::Ended::Said;
    let mut variations = vec![asked.strategies.variation()];
    for text in &asked.vary {
        let variation = Variation::parse(text).map_err(|error| campaign::Ended::Error(error.into()))?;
        // The first variation already varies the key of the strategies, and a key can vary only once.
        if variation.is_key(Strategies::KEY) {
            return Err(said(Failure::Input(format!("--vary {text}: the strategies are those of --strategies: expected another key"))));
        }
        variations.push(variation);
    }
    let (file, set) = (&arguments.scene.scene, set(arguments));
    let (text, file) = (input::text(file).map_err(|error| said(error.into()))?, input::named(file));
    let (format, part) = (arguments.table.format.into(), arguments.table.part());
    let plan = CampaignPlan::new(PlanSpec { text: &text, file, set: &set, variations, runs: arguments.runs, format, part, program: PROGRAM });
    Ok(plan.map_err(campaign::Ended::Error)?.leaving_out(Strategies::fallback()))
}

/// Judges the combinations and does the runs. Returns the comparison, and the paths of the table of runs and of the table of verdicts.
fn execute(arguments: &CompareArguments, sharing: Sharing<'_>, out: &Path, plan: CampaignPlan) -> Result<(Finished, [PathBuf; 2]), campaign::Ended> {
    let failed = campaign::Ended::Error;
    let combinations = plan.combinations();
    let mut campaign = campaign::open(sharing, plan, out)?;
    let judging = Shown::judging(combinations);
    // A merge makes no verdicts: the shards have made all of them.
    let by: &dyn Judge = if matches!(sharing, Sharing::Merge(_)) { &campaign::Nobody } else { &JUDGE };
    let judged = campaign.judge_apart(by, &judging);
    judging.clear();
    let stability = match judged.map_err(failed)? {
        Ok(stability) => stability,
        Err(missing) => return Err(campaign::Ended::Said(campaign::not_all_judged(sharing, combinations - missing, combinations, out))),
    };
    let report = campaign::run_to_end(&mut campaign, out)?;
    let comparison = campaign.compare().map_err(failed)?;
    let plan = campaign.plan().clone();
    // The title is taken from the first combination that was not refused, because a refused combination has no scene.
    let first = (0..combinations).find(|combination| !report.refused.contains_key(combination)).unwrap_or_default();
    let title = plan.scene(first).map_or_else(|_| output::path(input::named(&arguments.scene.scene)), |scene| scene.title);
    let files = [campaign.table_file(), campaign.stability_file()];
    Ok((Finished { plan, title, report, comparison, stability }, files))
}
