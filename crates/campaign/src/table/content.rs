//! Content of a table file, the same for both formats: the head of the file, open parts, figures of runs, and errors.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use super::Column;

/// A part whose bytes match its digest.
#[derive(Debug)]
pub(crate) struct OpenPart {
    /// Path of the part, for messages.
    pub(crate) path: PathBuf,
    /// Open file of the part, positioned at the beginning.
    pub(crate) file: File,
    /// Number of rows of the part.
    pub(crate) rows: u64,
}

/// The content of every file of a table apart from the rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Head<'a> {
    pub(crate) columns: &'a [Column],
    /// Key and text of the origin of the table, such as the manifest of a campaign, stored by formats with a place for it.
    pub(crate) about: (&'a str, &'a str),
    /// Name and version of the writing program.
    pub(crate) program: &'a str,
}

/// The figures of a run used by the summary. `max_discrepancy` is in metres.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Gist {
    pub(crate) diverged: bool,
    pub(crate) max_discrepancy: f64,
}

/// Columns of a table, each indexed by run.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct RunColumns {
    /// `true` if the run came to its end without [diverging](cohaptic_harness::Summary::has_diverged), indexed by run.
    pub(crate) complete: Vec<bool>,
    /// Requested columns, in the requested order; NaN for a run without a value.
    pub(crate) columns: Vec<Vec<f64>>,
}

impl RunColumns {
    /// Returns this number of empty columns.
    pub(super) fn of(columns: usize) -> Self {
        Self { complete: Vec::new(), columns: vec![Vec::new(); columns] }
    }
}

/// Value of the column `ending` for a run without divergence which came to its end.
pub(super) const COMPLETE: &str = "complete";

/// Value of the column `ending` for a diverged run.
pub(super) const DIVERGED: &str = "diverged";

/// Names of the columns of a [`Gist`].
pub(super) const GIST: [&str; 2] = ["ending", "max_discrepancy_m"];

/// Receiver of the gists, called once per row, in order.
pub(crate) type Gists<'a> = &'a mut dyn FnMut(Gist);

/// Why a table cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum TableError {
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The content of a file is not as it was written.
    #[error("{0}")]
    Content(String),
    /// A part cannot be read during the merge.
    #[error("{}: {error}", path.display())]
    Part { path: PathBuf, error: Box<Self> },
}

impl TableError {
    pub(crate) fn of_part(path: &Path) -> impl Fn(Self) -> Self + Copy {
        |error| Self::Part { path: path.to_path_buf(), error: Box::new(error) }
    }
}

/// Returns the error for a file with `found` rows in place of `expected` rows.
pub(super) fn rows_missing(found: u64, expected: u64) -> TableError {
    TableError::Content(format!("{found} rows: expected {expected}"))
}
