//! Figures from rows in memory, equal to the figures read from a file with these rows.

use super::content::{COMPLETE, DIVERGED, GIST, Gist, RunColumns};
use super::{Column, Row, TableError, Value};

/// Returns the index of a column.
fn place(columns: &[Column], name: &str) -> Result<usize, TableError> {
    columns.iter().position(|column| column.name == name).ok_or_else(|| TableError::Content(format!("no column {name}")))
}

/// Returns the text of a cell; empty for a cell without text.
fn word(row: &Row, place: usize) -> &str {
    match row.get(place) {
        Some(Value::Text(text)) => text,
        Some(Value::Absent | Value::Integer(_) | Value::Number(_)) | None => "",
    }
}

/// Returns the floating-point number in a cell; NaN for a cell without such a number.
fn number(row: &Row, place: usize) -> f64 {
    match row.get(place) {
        Some(Value::Number(number)) => *number,
        Some(Value::Absent | Value::Integer(_) | Value::Text(_)) | None => f64::NAN,
    }
}

/// Returns the gist of each row, in order.
///
/// # Errors
///
/// [`TableError::Content`] if a column of the gist is missing.
pub(crate) fn gists<'a>(columns: &[Column], rows: &'a [Row]) -> Result<impl Iterator<Item = Gist> + use<'a>, TableError> {
    let [ending, discrepancy] = [place(columns, GIST[0])?, place(columns, GIST[1])?];
    Ok(rows.iter().map(move |row| Gist { diverged: word(row, ending) == DIVERGED, max_discrepancy: number(row, discrepancy) }))
}

/// Returns columns of numbers by their names, and which runs came to their end.
///
/// # Errors
///
/// [`TableError::Content`] if a column is missing.
pub(crate) fn run_columns(columns: &[Column], rows: &[Row], names: &[&str]) -> Result<RunColumns, TableError> {
    let ending = place(columns, GIST[0])?;
    let places = names.iter().map(|name| place(columns, name)).collect::<Result<Vec<usize>, TableError>>()?;
    let of = |place: &usize| rows.iter().map(|row| number(row, *place)).collect();
    let complete = rows.iter().map(|row| word(row, ending) == COMPLETE).collect();
    Ok(RunColumns { complete, columns: places.iter().map(of).collect() })
}
