//! The JSON document of a finished campaign.

use cohaptic_campaign::Judgement;
use serde::Serialize;

use super::{Finished, Written};
use crate::document;

/// Returns the answer of `cohaptic campaign --json`. `written`: time and files of the campaign; `None` leaves these keys out.
pub fn document(finished: &Finished, written: Option<&Written>) -> impl Serialize {
    let report = &finished.report;
    let combinations = report.combinations.iter().enumerate().map(|(number, combination)| {
        document! {
            vary: finished.plan.varied(number as u64),
            runs: combination.runs,
            diverged: combination.diverged,
            mean_discrepancy_m: combination.mean_discrepancy,
            largest_discrepancy_m: combination.largest_discrepancy,
            worst_run: combination.worst_run,
            // Absent without verdicts.
            #[serde(flatten)]
            judgement: report.judgements.get(number).map(of_judgement),
        }
    });
    document! {
        title: finished.title.as_str(),
        runs: report.runs,
        runs_computed: report.computed,
        #[serde(flatten)]
        written: written.map(|written| document! {
            wall_s: written.wall_s,
            runs_per_s: finished.runs_per_s(written.wall_s),
            out: written.out.as_str(),
            file: written.files.first(),
            // The table of runs, the verdicts and the pictures.
            files: written.files.as_slice(),
        }),
        diverged: report.diverged(),
        combinations: combinations.collect::<Vec<_>>(),
        notes: finished.notes.as_slice(),
    }
}

/// Returns the document of a judgement. Without a verdict, all keys but the reason are `null`.
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
