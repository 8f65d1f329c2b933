//! A file of a table in either format: its head, the figures that sum a run up, and the failure to write or read it.

use std::io;
use std::path::{Path, PathBuf};

use super::Column;

/// What goes into every file of a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Head<'a> {
    pub(crate) columns: &'a [Column],
    /// What the table belongs to, for formats that have room for it.
    pub(crate) about: &'a str,
    /// The program that writes it.
    pub(crate) program: &'a str,
}

/// The figures that sum a run up.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Gist {
    pub(crate) diverged: bool,
    pub(crate) max_discrepancy: f64,
}

/// The names of the columns that a [`Gist`] comes from.
pub(super) const GIST: [&str; 2] = ["ending", "max_discrepancy_m"];

/// Takes the gist of each row, in order.
pub(crate) type Gists<'a> = &'a mut dyn FnMut(Gist);

/// Why a table cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum TableError {
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The content of a file is not the content that was written.
    #[error("{0}")]
    Content(String),
    /// Of the parts that are put together, this one cannot be read.
    #[error("{}: {error}", path.display())]
    Part { path: PathBuf, error: Box<Self> },
}

impl TableError {
    pub(super) fn of_part(path: &Path) -> impl Fn(Self) -> Self + Copy {
        |error| Self::Part { path: path.to_path_buf(), error: Box::new(error) }
    }
}

/// What to say of a file with another number of rows than were written.
pub(super) fn rows_missing(found: u64, expected: u64) -> TableError {
    TableError::Content(format!("{found} rows: expected {expected}"))
}
