//! The two formats of a table's file.

use std::fs::File;
use std::io::Write;

use cohaptic_files::WholeFile;

use super::content::{Gists, Head, OpenPart, RunColumns, TableError};
use super::{Row, comma_separated, parquet_file};

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

    /// Writes a file with these rows: a part. Not generic over the writer: every type of writer, here and in other crates, would compile the writer of Parquet
    /// again.
    pub(crate) fn write(self, to: &mut (dyn Write + Send), head: Head<'_>, rows: &[Row]) -> Result<(), TableError> {
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
