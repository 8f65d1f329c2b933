//! The page `campaign.html`.

use cohaptic_campaign::Variation;
use cohaptic_picture::page::{Html, Table};

use super::{Finished, words};
use crate::page::{AnswerPage, MOST_ROWS, Origin, headed, more_rows};

/// Returns the page. The bytes of the page depend on the campaign and on the pictures alone, not on how many of the runs this call has done.
#[must_use]
pub fn html(finished: &Finished, origin: &Origin<'_>) -> String {
    let Finished { plan, title, report, notes } = finished;
    let mut asked = vec![("Runs of each combination", Html::text(&plan.runs_of_each().to_string()))];
    if !plan.variations().is_empty() {
        asked.insert(0, ("Varied", Html::lines(plan.variations().iter().map(|vary| Html::code(vary.text())))));
    }
    asked.push(("Seeds", seeds(finished).into()));
    asked.push(("Verdicts", if plan.has_verdicts() { "of each combination, by analysis" } else { "not asked for" }.into()));
    let file = format!("runs.{}", plan.format().name());
    AnswerPage {
        title: format!("{title}: campaign{}", over(finished)),
        sentences: vec![words::amount(finished), words::outcome(finished)],
        asked,
        tables: headed("Combinations", &combinations(finished)).and(more_rows(report.combinations.len() as u64, "combinations", &file)),
        notes: notes.clone(),
        ..AnswerPage::default()
    }
    .html(origin)
}

/// Returns the varied keys, in words; empty if nothing is varied.
fn over(Finished { plan, .. }: &Finished) -> String {
    let keys: Vec<&str> = plan.variations().iter().map(Variation::key).collect();
    if keys.is_empty() { String::new() } else { format!(" over {}", keys.join(" and ")) }
}

/// Returns the seeds of the runs, in words.
fn seeds(Finished { plan, .. }: &Finished) -> String {
    if plan.variations().iter().any(|vary| vary.is_key("scene.seed")) {
        return "varied".to_owned();
    }
    let Ok(scene) = plan.scene(0) else { return "those of the scene and the following".to_owned() };
    // Every combination begins with the seed of the scene, so that all combinations share the seeds.
    match plan.runs_of_each() {
        1 => format!("{} for every combination", scene.seed),
        each => format!("{} to {}, the same for every combination", scene.seed, scene.seed + (each - 1)),
    }
}

/// Returns the table of combinations: values of the varied keys, verdicts if there are any, and figures of the runs.
fn combinations(finished: &Finished) -> Table {
    let mut rows = words::cells(finished, MOST_ROWS).into_iter();
    let head = rows.next().unwrap_or_default();
    let keys: Vec<&str> = finished.plan.variations().iter().map(Variation::key).collect();
    let table = if keys.is_empty() { Table::new().column("") } else { Table::new() };
    let table = head.into_iter().fold(table, |table, name| table.number(name));
    rows.fold(table, |table, row| {
        // The first cell of a row is the row's heading. A campaign that varies nothing has a single row without one.
        let unnamed = keys.is_empty().then(|| Html::text("all runs"));
        table.row(unnamed.into_iter().chain(row.into_iter().map(Html::from)))
    })
}
