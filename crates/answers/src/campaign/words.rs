//! The text about a finished campaign.

use std::fmt::Write as _;

use cohaptic_campaign::{CombinationReport, Judgement};
use cohaptic_units::print::Counted;

use super::Finished;
use crate::{figure, length};

/// Greatest number of combinations listed in the text. The table of runs has all.
const MOST_COMBINATIONS: usize = 20;

/// Returns the text about a campaign. `wall_s`: wall time of this call \[s\].
#[must_use]
pub fn words(finished: &Finished, wall_s: f64) -> String {
    let Finished { plan, title, report, notes } = finished;
    let mut text = format!("{title}\n");
    // Writing to a string cannot fail.
    let mut line = |line: &str| {
        let _ = writeln!(text, "{line}");
    };
    line(&format!("  {}", amount(finished)));
    if report.computed == 0 {
        line("  all results were in the folder already: nothing was run");
    } else {
        let before = report.runs - report.computed;
        let kept = if before > 0 { format!(", {before} {} there already", if before == 1 { "was" } else { "were" }) } else { String::new() };
        line(&format!("  {} took {wall_s:.3} s: {:.0} per second{kept}", Counted(report.computed, "run"), finished.runs_per_s(wall_s)));
    }
    line(&format!("  {}", outcome(finished)));
    if !plan.variations().is_empty() || !report.judgements.is_empty() {
        line("");
        table(finished).iter().for_each(|row| line(row));
        if report.combinations.len() > MOST_COMBINATIONS {
            line(&format!("  ... and {}", Counted(report.combinations.len() - MOST_COMBINATIONS, "more combination")));
        }
    }
    notes.iter().for_each(|note| line(&format!("note: {note}")));
    text
}

/// Returns the numbers of runs and combinations, in words.
pub(super) fn amount(Finished { plan, report, .. }: &Finished) -> String {
    format!("{} of {}, {} of each", Counted(report.runs, "run"), Counted(plan.combinations(), "combination"), plan.runs_of_each())
}

/// Returns the number of diverged runs and the largest discrepancy of the others, in words.
pub(super) fn outcome(Finished { report, .. }: &Finished) -> String {
    match report.worst() {
        Some(CombinationReport { largest_discrepancy: Some(largest), worst_run: Some(run), .. }) => {
            let others = if report.diverged() > 0 { " of the others" } else { "" };
            format!("{} diverged; the largest discrepancy{others} is {}, in run {run}", report.diverged(), length(*largest))
        }
        // `worst` is `None` only if no run came to its end.
        Some(_) | None => format!("all {} diverged", report.runs),
    }
}

/// Returns the rows of a text table with aligned columns: a head, then a row per combination with its values and figures.
fn table(finished: &Finished) -> Vec<String> {
    let rows = cells(finished, MOST_COMBINATIONS);
    // Characters and not bytes, because keys and names may be in any script.
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
    rows.iter().map(|row| row.iter().zip(&widths).map(|(cell, width)| format!("  {cell:>width$}")).collect()).collect()
}

/// Returns the cells of a table: a head, then a row for each of the first `most` combinations with its values and figures.
pub(super) fn cells(finished: &Finished, most: usize) -> Vec<Vec<String>> {
    let keys: Vec<String> = finished.plan.variations().iter().map(|vary| vary.key().to_owned()).collect();
    let judgements = &finished.report.judgements;
    let heads: &[&str] = if judgements.is_empty() { &[] } else { &["verdict", "judged", "radius"] };
    let heads = heads.iter().chain(&["diverged", "mean discrepancy", "largest"]).map(|head| (*head).to_owned());
    let mut rows: Vec<Vec<String>> = vec![keys.iter().cloned().chain(heads).collect()];
    for (number, combination) in finished.report.combinations.iter().enumerate().take(most) {
        let places = finished.plan.places(number as u64);
        let values = finished.plan.variations().iter().zip(places).map(|(vary, place)| vary.value_text(place).to_owned());
        let metres = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), length);
        let figures = [combination.diverged.to_string(), metres(combination.mean_discrepancy), metres(combination.largest_discrepancy)];
        rows.push(values.chain(judgements.get(number).into_iter().flat_map(judged)).chain(figures).collect());
    }
    rows
}

/// Returns the cells of a judgement: verdict, kind and radius, or dashes.
fn judged(judgement: &Judgement) -> [String; 3] {
    match judgement.verdict() {
        Some(verdict) => [verdict.word.to_string(), verdict.judged.to_string(), figure(verdict.radius, 6)],
        None => [const { "-" }; 3].map(str::to_owned),
    }
}
