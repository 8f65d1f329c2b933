//! The JSON document of a campaign.

use std::path::Path;

use cohaptic_campaign::Judgement;
use serde::Serialize;

use super::Finished;
use crate::document_schema::document;
use crate::output;

/// The answer of `cohaptic campaign --json`.
pub(super) fn of(finished: &Finished, out: &Path) -> impl Serialize {
    let report = &finished.report;
    let combinations = report.combinations.iter().enumerate().map(|(number, combination)| {
        document! {
            vary: finished.plan.varied(number as u64),
            runs: combination.runs,
            diverged: combination.diverged,
            mean_discrepancy_m: combination.mean_discrepancy,
            largest_discrepancy_m: combination.largest_discrepancy,
            worst_run: combination.worst_run,
            // Nothing unless verdicts are asked for.
            #[serde(flatten)]
            judgement: report.judgements.get(number).map(of_judgement),
        }
    });
    document! {
        title: finished.title.clone(),
        runs: report.runs,
        runs_computed: report.computed,
        wall_s: finished.wall_s,
        runs_per_s: finished.runs_per_s(),
        out: output::path(out),
        file: output::path(&report.file),
        // The table, verdicts, pictures.
        files: finished.files.iter().map(|file| output::path(file)).collect::<Vec<_>>(),
        diverged: report.diverged(),
        combinations: combinations.collect::<Vec<_>>(),
        notes: finished.notes.as_slice(),
    }
}

/// All but the reason is `null` where there is no verdict.
fn of_judgement(judgement: &Judgement) -> impl Serialize {
    let (verdict, reason) = match judgement {
        Judgement::Known(verdict) => (Some(verdict), None),
        Judgement::Refused(reason) => (None, Some(&**reason)),
    };
    document! {
        verdict: verdict.map(|verdict| &*verdict.word),
        judged: verdict.map(|verdict| &*verdict.judged),
        radius: verdict.map(|verdict| verdict.radius),
        error_bound: verdict.map(|verdict| verdict.error),
        reason: reason,
    }
}

impl Finished {
    /// Of those of this time.
    #[expect(clippy::cast_precision_loss, reason = "fewer runs than 2^52")]
    pub(super) fn runs_per_s(&self) -> f64 {
        self.report.computed as f64 / self.wall_s
    }
}
