//! As what the table is written.

use std::fs::File;
use std::path::Path;

use cohaptic_files::WholeFile;

use super::file::{Gists, Head, TableError};
use super::{Row, comma_separated, parquet_file};

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

    /// A file of its own with these rows.
    pub(crate) fn write(self, file: &mut WholeFile, head: Head<'_>, rows: &[Row]) -> Result<(), TableError> {
        match self {
            Self::Parquet => parquet_file::write(file, head, rows),
            Self::Csv => Ok(comma_separated::write(file, head.columns, rows)?),
        }
    }

    /// One file with the rows of all parts, one after the other. Each is given with how many rows it must have.
    pub(crate) fn merge<'a>(self, file: &mut WholeFile, head: Head<'_>, parts: impl Iterator<Item = (&'a Path, u64)>) -> Result<(), TableError> {
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
}
