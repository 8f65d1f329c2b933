//! Figures of rows that are in memory, as they are read from a file.

use super::format::{COMPLETE, DIVERGED, GIST, Gist, RunColumns};
use super::{Column, Row, TableError, Value};

/// Returns the place of a column.
fn place(columns: &[Column], name: &str) -> Result<usize, TableError> {
    columns.iter().position(|column| column.name == name).ok_or_else(|| TableError::Content(format!("no column {name}")))
}

/// Returns the word in a cell of text; empty in other cells.
fn word(row: &Row, place: usize) -> &str {
    match row.get(place) {
        Some(Value::Text(text)) => text,
        Some(Value::Absent | Value::Integer(_) | Value::Number(_)) | None => "",
    }
}

/// Returns the number in a cell; NaN where there is none.
fn number(row: &Row, place: usize) -> f64 {
    match row.get(place) {
        Some(Value::Number(number)) => *number,
        Some(Value::Absent | Value::Integer(_) | Value::Text(_)) | None => f64::NAN,
    }
}

/// Returns the gist of each row.
///
/// # Errors
///
/// [`TableError::Content`] if the columns are not those of a campaign.
pub(crate) fn gists<'a>(columns: &[Column], rows: &'a [Row]) -> Result<impl Iterator<Item = Gist> + use<'a>, TableError> {
    let [ending, discrepancy] = [place(columns, GIST[0])?, place(columns, GIST[1])?];
    Ok(rows.iter().map(move |row| Gist { diverged: word(row, ending) == DIVERGED, max_discrepancy: number(row, discrepancy) }))
}

/// Returns columns of numbers by their names, and which runs were complete.
///
/// # Errors
///
/// [`TableError::Content`] if there is no such column.
pub(crate) fn run_columns(columns: &[Column], rows: &[Row], names: &[&str]) -> Result<RunColumns, TableError> {
    let ending = place(columns, GIST[0])?;
    let places = names.iter().map(|name| place(columns, name)).collect::<Result<Vec<usize>, TableError>>()?;
    let of = |place: &usize| rows.iter().map(|row| number(row, *place)).collect();
    let complete = rows.iter().map(|row| word(row, ending) == COMPLETE).collect();
    Ok(RunColumns { complete, columns: places.iter().map(of).collect() })
}
