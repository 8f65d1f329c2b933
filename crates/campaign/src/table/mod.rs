//! The table of a campaign: one row per run, with columns of integers, numbers and text. A table is written as Parquet or as comma-separated values.

mod columns;
mod comma_separated;
mod content;
mod format;
mod memory;
mod parquet_file;
mod row;

use std::sync::Arc;

pub(crate) use columns::{Roster, columns};
pub(crate) use comma_separated::{number_text, text as value_text};
pub(crate) use content::{Gist, Head, OpenPart, RunColumns, TableError};
pub use format::Format;
pub(crate) use memory::{gists, run_columns};
pub(crate) use row::{RunId, row};

/// Type of the values of a column.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Integers, `i64`.
    Integer,
    /// Numbers, `f64`.
    Number,
    /// Text, UTF-8.
    Text,
}

/// A value of a row.
#[derive(Clone, PartialEq, Debug)]
pub enum Value {
    /// No value: a peer absent from this run, or a mean of nothing.
    Absent,
    /// A value of an integer column.
    Integer(i64),
    /// A value of a number column; may be infinite or NaN in a diverged run.
    Number(f64),
    /// A value of a text column.
    Text(Arc<str>),
}

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
