//! The table of a campaign: one row per run, with columns of integers, numbers and text. A table is written as Parquet or as comma-separated values.

mod columns;
mod comma_separated;
mod content;
mod format;
mod memory;
mod parquet_file;
mod row;

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
