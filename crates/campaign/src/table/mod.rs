//! The table of a campaign: a row for each run, columns of integers, numbers and text.

mod columns;
mod comma_separated;
mod format;
mod memory;
mod parquet_file;
mod row;

use std::sync::Arc;

pub(crate) use columns::{Roster, columns};
pub(crate) use comma_separated::{number_text, text as value_text};
pub use format::Format;
pub(crate) use format::{Gist, Head, OpenPart, RunColumns, TableError};
pub(crate) use memory::{gists, run_columns};
pub(crate) use row::{RunId, row};

/// What a column holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// `i64`.
    Integer,
    /// `f64`.
    Number,
    /// UTF-8.
    Text,
}

/// One value of a row.
#[derive(Clone, PartialEq, Debug)]
pub enum Value {
    /// There is none: a peer that this run does not have, a mean of nothing.
    Absent,
    /// In a column of integers.
    Integer(i64),
    /// In a column of numbers; it may be infinite or no number in a run that diverged.
    Number(f64),
    /// In a column of text.
    Text(Arc<str>),
}

/// A column.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Column {
    /// Its name, which ends in the unit if it has one.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
    /// Whether a row may have nothing here.
    pub optional: bool,
}

/// One value for each column.
pub type Row = Vec<Value>;
