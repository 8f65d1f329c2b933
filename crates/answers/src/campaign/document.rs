//! A campaign as a JSON document.

use cohaptic_campaign::Judgement;
use serde::Serialize;

use super::{Finished, Written};
use crate::document;

/// The answer of `cohaptic campaign --json`. `written`: the time that the campaign took and its files, if they are said.
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
            // Nothing unless verdicts are asked for.
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
            // The table, verdicts, pictures.
            files: written.files.as_slice(),
        }),
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
