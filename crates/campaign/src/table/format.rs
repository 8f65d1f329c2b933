//! The two formats of a table's file, and the types shared by both: head, open parts, figures read back, errors.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use cohaptic_files::WholeFile;

use super::{Column, Row, comma_separated, parquet_file};

/// Format of the table's file.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Format {
    /// Apache Parquet without compression, one row group per part.
    #[default]
    Parquet,
    /// Comma-separated values with a header (RFC 4180, lines end in a line feed). Numbers have the fewest digits that read back as the same `f64`.
    Csv,
}

impl Format {
    /// Returns `parquet` or `csv`, which is also the extension of the file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Parquet => "parquet",
            Self::Csv => "csv",
        }
    }

    /// Writes a file with these rows: a part.
    pub(crate) fn write(self, to: &mut (impl Write + Send), head: Head<'_>, rows: &[Row]) -> Result<(), TableError> {
        match self {
            Self::Parquet => parquet_file::write(to, head, rows),
            Self::Csv => Ok(comma_separated::write(to, head.columns, rows)?),
        }
    }

    /// Writes the table with the rows of all parts, in the order of the parts.
    pub(crate) fn merge(
        self,
        file: &mut WholeFile,
        head: Head<'_>,
        parts: impl ExactSizeIterator<Item = Result<OpenPart, TableError>>,
    ) -> Result<(), TableError> {
        match self {
            Self::Parquet => parquet_file::merge(file, head, parts),
            Self::Csv => comma_separated::merge(file, head.columns, parts),
        }
    }

    /// Reads the gist of every row, in order.
    pub(crate) fn read_gists(self, file: File, each: Gists<'_>) -> Result<(), TableError> {
        match self {
            Self::Parquet => parquet_file::read_gists(file, each),
            Self::Csv => comma_separated::read_gists(file, each),
        }
    }

    /// Reads columns of numbers by their names, and which runs came to their end.
    pub(crate) fn read_columns(self, file: File, names: &[&str]) -> Result<RunColumns, TableError> {
        match self {
            Self::Parquet => parquet_file::read_columns(file, names),
            Self::Csv => comma_separated::read_columns(file, names),
        }
    }
}

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
    /// Text of the manifest, stored by formats with a place for it.
    pub(crate) about: &'a str,
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
