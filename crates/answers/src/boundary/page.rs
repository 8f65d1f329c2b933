//! The page `boundary.html`.

use cohaptic_picture::page::{Html, Table};
use cohaptic_units::print::{Counted, SixDigits, six_digits};

use super::{Searched, words};
use crate::page::{AnswerPage, MOST_ROWS, Origin, clauses, headed, more_rows, range};

/// Returns the page of a finished search. The bytes of the page depend on the search and on the picture alone.
#[must_use]
pub fn html(searched: &Searched<'_>, origin: &Origin<'_>) -> String {
    let found = searched.found;
    let mut limits = words::limits(searched, false).into_iter();
    let resolution = limits.next();
    let asked = vec![
        ("Along", range(searched.range)),
        ("First values", Counted(searched.options.samples, "value").to_string().into()),
        ("Tolerance of a crossing", format!("{}{}", SixDigits(searched.options.tolerance), searched.range.unit).into()),
    ];
    let crossings = found.crossings.len() as u64;
    AnswerPage {
        title: format!("{}: stability along {}", searched.title, searched.range.key),
        // The search was not settled if there is a second line.
        warnings: limits.collect(),
        sentences: vec![clauses(&words::verdicts(searched, six_digits))],
        asked,
        tables: headed("Crossings", &crossings_table(searched))
            .and(more_rows(crossings, "crossings", "boundary.csv"))
            .and(headed("Values looked at", &values_table(searched))),
        notes: resolution.into_iter().chain(searched.notes()).collect(),
    }
    .html(origin)
}

/// Returns the table of crossings, with the verdict before and after each.
fn crossings_table(Searched { range, found, .. }: &Searched<'_>) -> Table {
    let head = Table::new().column("at").column("before").column("after");
    let shown = found.crossings.iter().take(MOST_ROWS);
    shown
        .fold(head, |table, crossing| table.row([range.text(crossing.value), crossing.from.word().into(), crossing.to.word().into()].map(Html::from)))
}

/// Returns the table of checked values: a row for each kind of verdict.
fn values_table(searched: &Searched<'_>) -> Table {
    let head = Table::new().column("judged by").number("values").number("stable [%]");
    searched.kinds().present().fold(head, |table, (kind, count)| {
        let stable = 100.0 * searched.stable_fraction(kind);
        table.row([kind.radius_name().to_owned(), count.to_string(), format!("{stable:.2}")].map(Html::from))
    })
}
