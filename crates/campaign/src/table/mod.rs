//! The table of a campaign: one row per run, with columns of integers, numbers and text. A table is written as Parquet or as comma-separated values.

mod columns;
mod comma_separated;
mod content;
mod format;
mod memory;
mod parquet_file;
mod row;

use std::io::{self, Write};

use crate::value::{Kind, Value};

pub(crate) use columns::{Roster, columns};
pub(crate) use content::{Gist, Head, OpenPart, RunColumns, TableError};
pub use format::Format;
pub(crate) use memory::{gists, run_columns};
pub(crate) use row::{RunId, row};

/// A column of the table.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Column {
    /// Name of the column. The name ends in the unit, if there is a unit.
    pub name: String,
    /// Type of the values.
    pub kind: Kind,
    /// `true` if a row may have [`Value::Absent`] here.
    pub optional: bool,
}

/// The values of a run, indexed by column.
pub type Row = Vec<Value>;

/// Writes a table of any rows as a file of its own. `about`: key and text of the origin, which Parquet keeps as metadata. `program`: name and version of the
/// writing program.
///
/// # Errors
///
/// The error of the writer, or [`io::ErrorKind::Other`] for rows that do not have the columns.
pub fn write_table(
    format: Format,
    to: &mut (dyn Write + Send),
    columns: &[Column],
    rows: &[Row],
    (about, program): ((&str, &str), &str),
) -> io::Result<()> {
    format.write(to, Head { columns, about, program }, rows).map_err(|error| match error {
        TableError::Io(error) => error,
        error @ (TableError::Content(_) | TableError::Part { .. }) => io::Error::other(error.to_string()),
    })
}
