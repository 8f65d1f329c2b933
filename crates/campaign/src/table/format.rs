//! A table as a file in either format: its head, the figures that sum a run up, and the failure to write or read it.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use cohaptic_files::WholeFile;

use super::{Column, Row, comma_separated, parquet_file};

/// As what the table is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Format {
    /// Apache Parquet without compression, a row group for each part.
    #[default]
    Parquet,
    /// Comma-separated values with a header (RFC 4180, lines end in a line feed), numbers with the fewest digits that read back as the same `f64`.
    Csv,
}

impl Format {
    /// `parquet` or `csv`, which is also how names of files end.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Parquet => "parquet",
            Self::Csv => "csv",
        }
    }

    /// A table of its own with these rows.
    pub(crate) fn write(self, to: &mut (impl Write + Send), head: Head<'_>, rows: &[Row]) -> Result<(), TableError> {
        match self {
            Self::Parquet => parquet_file::write(to, head, rows),
            Self::Csv => Ok(comma_separated::write(to, head.columns, rows)?),
        }
    }

    /// Writes a file with the rows of all parts, in the order of the parts.
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

    /// The gist of every row of a file, in order.
    pub(crate) fn read_gists(self, file: File, each: Gists<'_>) -> Result<(), TableError> {
        match self {
            Self::Parquet => parquet_file::read_gists(file, each),
            Self::Csv => comma_separated::read_gists(file, each),
        }
    }

    /// Columns of numbers by their names, and which runs were complete.
    pub(crate) fn read_columns(self, file: File, names: &[&str]) -> Result<RunColumns, TableError> {
        match self {
            Self::Parquet => parquet_file::read_columns(file, names),
            Self::Csv => comma_separated::read_columns(file, names),
        }
    }
}

/// A part that was checked: its bytes are those that were written.
#[derive(Debug)]
pub(crate) struct OpenPart {
    /// The name of the file, for messages.
    pub(crate) path: PathBuf,
    /// The file, at its beginning.
    pub(crate) file: File,
    /// How many rows the part has.
    pub(crate) rows: u64,
}

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

/// Columns of a table, by run.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct RunColumns {
    /// Whether the run came to its end without [diverging](cohaptic_harness::Summary::has_diverged).
    pub(crate) complete: Vec<bool>,
    /// The columns in the order in which they were asked for; no number where a run has none.
    pub(crate) columns: Vec<Vec<f64>>,
}

impl RunColumns {
    /// Empty columns.
    pub(super) fn of(columns: usize) -> Self {
        Self { complete: Vec::new(), columns: vec![Vec::new(); columns] }
    }
}

/// What the column `ending` says of a run that came to its end.
pub(super) const COMPLETE: &str = "complete";

/// What the column `ending` says of a run that diverged.
pub(super) const DIVERGED: &str = "diverged";

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
    pub(crate) fn of_part(path: &Path) -> impl Fn(Self) -> Self + Copy {
        |error| Self::Part { path: path.to_path_buf(), error: Box::new(error) }
    }
}

/// What to say of a file with another number of rows than were written.
pub(super) fn rows_missing(found: u64, expected: u64) -> TableError {
    TableError::Content(format!("{found} rows: expected {expected}"))
}
