//! Rows as tables for a terminal.

use std::fmt::Write as _;

use crate::Row;
use crate::groups::{Group, groups};
use crate::numbers::short;

/// Returns the tables, one for each subject, case, error unit and cost unit.
#[must_use]
pub fn text(rows: &[Row]) -> String {
    let mut text = String::new();
    for group in groups(rows) {
        table(&mut text, &group);
    }
    text
}

/// Appends the table of a group.
fn table(text: &mut String, group: &Group<'_>) {
    let _ = writeln!(text, "{}", group.title());
    for reference in group.references() {
        let _ = writeln!(text, "  against: {reference}");
    }
    let cells: Vec<[String; 5]> =
        group.rows.iter().map(|row| [row.method.clone(), row.setting.clone(), short(row.cost), short(row.error), row.note.clone()]).collect();
    // The note is the last column and has no width: notes are long, and no column follows.
    let head = ["method", "setting", group.cost_unit, group.error_unit, ""].map(str::to_owned);
    let mut widths = [0; 4];
    for line in std::iter::once(&head).chain(&cells) {
        for (width, cell) in widths.iter_mut().zip(line) {
            // Characters, not bytes: units contain µ and ².
            *width = (*width).max(cell.chars().count());
        }
    }
    let [method, setting, cost, error] = widths;
    for [a, b, c, d, note] in std::iter::once(&head).chain(&cells) {
        let line = format!("  {a:<method$}  {b:<setting$}  {c:>cost$}  {d:>error$}  {note}");
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text.push('\n');
}
