//! The JSON document of a campaign.

use std::path::Path;

use cohaptic_campaign::{CombinationReport, Judgement, Verdict};
use serde::Serialize;

use super::Finished;
use crate::output;

/// What `cohaptic campaign --json` prints.
#[derive(Serialize)]
pub(super) struct CampaignDocument<'a> {
    title: String,
    runs: u64,
    runs_computed: u64,
    wall_s: f64,
    runs_per_s: f64,
    out: String,
    file: String,
    /// The table, verdicts, pictures.
    files: Vec<String>,
    diverged: u64,
    combinations: Vec<Combination<'a>>,
    notes: &'a [String],
}

#[derive(Serialize)]
struct Combination<'a> {
    vary: Vec<String>,
    runs: u64,
    diverged: u64,
    mean_discrepancy_m: Option<f64>,
    largest_discrepancy_m: Option<f64>,
    worst_run: Option<u64>,
    /// Nothing unless verdicts are asked for.
    #[serde(flatten)]
    judgement: Option<JudgementDocument<'a>>,
}

/// All but the reason is `null` where there is no verdict.
#[derive(Serialize)]
struct JudgementDocument<'a> {
    verdict: Option<&'a str>,
    judged: Option<&'a str>,
    radius: Option<f64>,
    error_bound: Option<f64>,
    /// Why there is no verdict.
    reason: Option<&'a str>,
}

impl<'a> JudgementDocument<'a> {
    fn new(judgement: &'a Judgement) -> Self {
        match judgement {
            Judgement::Known(Verdict { word, judged, radius, error }) => {
                Self { verdict: Some(word), judged: Some(judged), radius: Some(*radius), error_bound: Some(*error), reason: None }
            }
            Judgement::Refused(reason) => Self { verdict: None, judged: None, radius: None, error_bound: None, reason: Some(reason) },
        }
    }
}

impl<'a> CampaignDocument<'a> {
    pub(super) fn new(finished: &'a Finished, out: &Path) -> Self {
        let report = &finished.report;
        let combination = |(number, combination): (usize, &CombinationReport)| Combination {
            vary: finished.plan.varied(number as u64),
            runs: combination.runs,
            diverged: combination.diverged,
            mean_discrepancy_m: combination.mean_discrepancy,
            largest_discrepancy_m: combination.largest_discrepancy,
            worst_run: combination.worst_run,
            judgement: report.judgements.get(number).map(JudgementDocument::new),
        };
        Self {
            title: finished.title.clone(),
            runs: report.runs,
            runs_computed: report.computed,
            wall_s: finished.wall_s,
            runs_per_s: finished.runs_per_s(),
            out: output::path(out),
            file: output::path(&report.file),
            files: finished.files.iter().map(|file| output::path(file)).collect(),
            diverged: report.diverged(),
            combinations: report.combinations.iter().enumerate().map(combination).collect(),
            notes: &finished.notes,
        }
    }
}

impl Finished {
    /// Of those of this time.
    #[expect(clippy::cast_precision_loss, reason = "fewer runs than 2^52")]
    pub(super) fn runs_per_s(&self) -> f64 {
        self.report.computed as f64 / self.wall_s
    }
}
